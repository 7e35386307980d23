//! Processor in the loop: the binary that would be flashed flies the plant, tick by tick.

use impromptu_firmware::{adapter::Lanes, model::Model};
use impromptu_host_sim::{
    condition::Condition,
    experiment::Loop,
    pil::{self, Board, Faults, Faulty, LinkKind},
    plant::Vehicle,
    rollout::{FlightPlan, FlightRecord, fly_on},
    trajectory::{Trajectory, strokes},
};
use impromptu_model_export::Precision;

use crate::board::model;

/// The loop of the emulated flights.
fn plant() -> Loop {
    Loop::new(Vehicle::named("crazyflie").unwrap(), "stock", Condition::named("lab").unwrap()).unwrap()
}

fn stroke(plant: &Loop) -> Trajectory {
    strokes(1, 1, 1.0, plant.rate_hz()).unwrap().remove(0)
}

#[test]
fn flights_through_the_firmware_have_every_bit_of_the_software_and_miss_no_deadline() {
    let plant = plant();
    let file = model::file(&model::TANH, Precision::Int8);
    let model = Model::from_bytes(&file).unwrap();
    let trajectories = strokes(1, 30, 1.0, plant.rate_hz()).unwrap();
    let (mut emulated, mut board) = pil::start(Some(&file), LinkKind::Lockstep, 3).unwrap();
    assert_eq!(board.introduce().unwrap(), Some(model.checksum()));
    let plans: Vec<FlightPlan<'_>> = trajectories
        .iter()
        .zip(7..)
        .map(|(trajectory, seed)| FlightPlan::new(trajectory, seed).with(&model, Lanes::BOTH))
        .chain([FlightPlan::new(&trajectories[0], 7)])
        .collect();
    let (records, report) = pil::fly(&mut board, &plant, &plans, |_| ()).unwrap();
    println!("{report:?}");
    assert!(report.bit_identical);
    assert!(records.iter().all(|record| record.rms > 0.01 && record.rms < 0.5), "the flights prove something");
    assert!(report.ticks > 300_000 / 4, "{} ticks", report.ticks);
    let figures = report.figures;
    assert_eq!((figures.deadline_misses, figures.late_inferences, figures.dropped), (0, 0, 0));
    board.end();
    assert_eq!(emulated.ended().unwrap(), Some(0));
}

/// Flies a stroke through a line with faults, after a whole line for the upload; gives the record and the telemetry's end.
fn with_faults(faults: Faults) -> (FlightRecord, Board<Faulty<Box<dyn pil::Line>>>, pil::Emulated) {
    let plant = plant();
    let trajectory = stroke(&plant);
    let file = model::file(&model::TANH, Precision::Int8);
    let model = Model::from_bytes(&file).unwrap();
    let elf = pil::firmware().unwrap();
    let (emulated, line) = pil::connect(&elf, Some(&file), LinkKind::Lockstep, 3).unwrap();
    let mut board = Board::new(Faulty::new(line, faults, 11), true);
    board.introduce().unwrap();
    let mut flight = board.prepare(&plant.settings, Some(Lanes::BOTH)).unwrap();
    let plan = FlightPlan { record: true, ..FlightPlan::new(&trajectory, 7).with(&model, Lanes::BOTH) };
    let record = fly_on(&mut flight, &plant.vehicle, &plant.settings, &plant.condition, &plan).unwrap();
    (record, board, emulated)
}
