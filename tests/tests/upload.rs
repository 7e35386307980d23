//! A model that is uploaded to the emulated board flies after its restart with every bit of the software, whatever happened on
//! the way.

use impromptu_firmware::{
    adapter::Lanes,
    model::{Model, file},
};
use impromptu_flight::{
    link::{Reason, outcome::ModelFault},
    types::{Setpoint, State, Tick},
};
use impromptu_model_export::Precision;
use impromptu_pil::{self as pil, Board, Faults, Faulty, Line, LinkKind, PilError};
use impromptu_sim::{
    condition::Condition,
    flights::Loop,
    plant::Vehicle,
    rollout::{FlightPlan, FlightStack as _, fly_on},
    trajectory::strokes,
};
use impromptu_tests::emulator::{BOARD, build_firmware};

use crate::{board::model, image};

fn closed_loop() -> Loop {
    Loop::new(Vehicle::named("crazyflie").unwrap(), "stock", Condition::named("lab").unwrap()).unwrap()
}

fn reason(result: Result<(), PilError>) -> Reason {
    match result {
        Err(PilError::Refused { reason, .. }) => reason,
        other => panic!("{other:?}"),
    }
}

/// One flight, in software and on the board, has the same bits.
fn flies<L: Line>(board: &mut Board<L>, closed_loop: &Loop, model: &Model<'_>) {
    let trajectory = strokes(1, 1, 1.0, closed_loop.rate_hz()).unwrap().remove(0);
    let plan = FlightPlan { record: true, model: Some((model, Lanes::BOTH)), ..FlightPlan::new(&trajectory, 7) };
    let software = closed_loop.fly(std::slice::from_ref(&plan)).unwrap().remove(0);
    let flight = board.prepare(&closed_loop.settings, Some(Lanes::BOTH)).unwrap();
    let hardware = fly_on(flight, &closed_loop.vehicle, &closed_loop.settings, &closed_loop.condition, &plan).unwrap();
    assert!(software.recorded == hardware.recorded);
}

#[test]
fn an_uploaded_model_flies_after_the_restart_and_never_before() {
    let closed_loop = closed_loop();
    let [old, new] = [Precision::Int8, Precision::Float].map(|precision| model::file(&model::TANH, precision));
    let [first, second] = [&old, &new].map(|file| Model::from_bytes(file).unwrap());
    let (emulated, mut board) = pil::start(Some(&old), LinkKind::Lockstep, 3).unwrap();
    assert_eq!(board.introduce().unwrap(), Some(first.checksum()));
    board.upload(&new).unwrap();
    // Not armed before the restart, which may come at any time.
    assert_eq!(board.introduce().unwrap(), Some(first.checksum()));
    let mut flight = board.prepare(&closed_loop.settings, None).unwrap();
    flight.step(Tick(0), &State::default());
    assert_eq!(reason(flight.check()), Reason::Busy);

    let (emulated, mut board) = pil::restart(emulated).unwrap();
    assert_eq!(board.introduce().unwrap(), Some(second.checksum()));
    flies(&mut board, &closed_loop, &second);
    // And back again, into the other slot.
    assert_eq!(reason(board.upload(&old)), Reason::Armed);
    board.prepare(&closed_loop.settings, None).unwrap();
    board.upload(&old).unwrap();
    // The board looks at its stack once in a thousand ticks: by now at that of a start, a flight and an upload.
    (0..2_100).for_each(|_| assert_eq!(board.introduce().unwrap(), Some(second.checksum())));
    let (measured, bound) = (board.telemetry().stack_bytes, image::emulated_stack());
    println!("stack: {measured} bytes of at most {bound}");
    assert!((bound / 2..=bound).contains(&measured), "{measured} bytes of at most {bound}");
    let (_emulated, mut board) = pil::restart(emulated).unwrap();
    assert_eq!(board.introduce().unwrap(), Some(first.checksum()));
    flies(&mut board, &closed_loop, &first);
}

#[test]
fn an_upload_comes_through_a_line_that_loses_cuts_and_flips() {
    let [old, new] = [Precision::Int8, Precision::Float].map(|precision| model::file(&model::TANH, precision));
    let elf = build_firmware("impromptu-board", "emulated", BOARD, &[]).unwrap();
    let (emulated, line) = pil::connect(&elf, &[], Some(&old), LinkKind::Lockstep, 3).unwrap();
    let faults = Faults { loss: 0.2, bit_errors: 1e-4, cuts: 0.05, late: 0.05, garbage: 20, ..Faults::default() };
    let mut board = Board::new(Faulty::new(line, faults, 5), true);
    board.upload(&new).unwrap();
    let (_emulated, mut board) = pil::restart(emulated).unwrap();
    assert_eq!(board.introduce().unwrap(), Some(file::checksum(&new)));
}

#[test]
fn what_is_no_model_for_this_vehicle_is_refused_and_the_old_one_flies_on() {
    let old = model::file(&model::TANH, Precision::Int8);
    let (emulated, mut board) = pil::start(Some(&old), LinkKind::Lockstep, 3).unwrap();
    let mut damaged = old.clone();
    damaged[200] ^= 1;
    assert_eq!(reason(board.upload(&damaged)), Reason::Model(ModelFault::Damaged));
    let foreign = include_bytes!("../golden/models/int8-lane.model");
    assert!(matches!(reason(board.upload(foreign)), Reason::Model(ModelFault::Signal { .. })));
    assert_eq!(reason(board.upload(&vec![0; 80_000])), Reason::Length { limit: 72 * 1024 - 32 });

    let (_emulated, mut board) = pil::restart(emulated).unwrap();
    assert_eq!(board.introduce().unwrap(), Some(file::checksum(&old)));
    let closed_loop = closed_loop();
    let mut flight = board.prepare(&closed_loop.settings, None).unwrap();
    for _ in 0..4 {
        flight.push_setpoint(&Setpoint::default());
    }
    flight.step(Tick(0), &State::default());
    flight.check().unwrap();
    assert_eq!(reason(board.upload(&old)), Reason::Armed);
}
