//! Processor in the loop: the binary that would be flashed flies the plant, tick by tick.

use impromptu_firmware::{adapter::Lanes, model::Model};
use impromptu_host_sim::{
    condition::Condition,
    experiment::Loop,
    pil::{self, LinkKind},
    plant::Vehicle,
    rollout::{FlightPlan, fly_on},
    trajectory::strokes,
};
use impromptu_model_export::Precision;

use crate::board::model;

/// The loop of the emulated flights.
fn plant(condition: &str) -> Loop {
    Loop::new(Vehicle::named("crazyflie").unwrap(), "stock", Condition::named(condition).unwrap()).unwrap()
}

#[test]
fn flights_through_the_firmware_have_every_bit_of_the_software() {
    let plant = plant("lab");
    let file = model::file(&model::TANH, Precision::Int8);
    let model = Model::from_bytes(&file).unwrap();
    let trajectories = strokes(1, 2, 1.0, plant.rate_hz()).unwrap();
    let (_emulated, mut board) = pil::start(Some(&file), LinkKind::Lockstep, 3).unwrap();
    assert_eq!(board.introduce().unwrap(), Some(model.checksum()));
    for (trajectory, seed) in trajectories.iter().zip(7..) {
        for lanes in [None, Some(Lanes::BOTH)] {
            let plan =
                FlightPlan { record: true, model: lanes.map(|lanes| (&model, lanes)), ..FlightPlan::new(trajectory, seed) };
            let software = plant.fly(std::slice::from_ref(&plan)).unwrap().remove(0);
            let start = std::time::Instant::now();
            let flight = board.prepare(&plant.settings, lanes).unwrap();
            let hardware = fly_on(flight, &plant.vehicle, &plant.settings, &plant.condition, &plan).unwrap();
            println!("{:?} {} {}", start.elapsed(), software.rms, hardware.rms);
            assert!(software.recorded == hardware.recorded);
        }
    }
    println!("{:?}", board.telemetry());
}
