//! Processor in the loop: the binary that would be flashed flies the plant, tick by tick.

use impromptu_firmware::{adapter::Lanes, learning::Phase, model::Model};
use impromptu_flight::{
    learning::KEPT,
    link::{
        Reason,
        message::{LearnOrder, Telemetry},
    },
    replay::ANSWER,
};
use impromptu_model_export::Precision;
use impromptu_pil::{self as pil, Board, Faults, Faulty, LinkKind, PilError};
use impromptu_sim::{
    condition::Condition,
    flights::Loop,
    learned::commissioning,
    plant::Vehicle,
    rollout::{FlightPlan, fly_on},
    trajectory::strokes,
};

use crate::board::model;

/// The loop of the emulated flights.
pub(crate) fn closed_loop() -> Loop {
    Loop::new(Vehicle::named("crazyflie").unwrap(), "stock", Condition::named("lab").unwrap()).unwrap()
}

#[test]
fn flights_through_the_firmware_have_every_bit_of_the_software_and_miss_no_deadline() {
    let closed_loop = closed_loop();
    let file = model::file(&model::TANH, Precision::Int8);
    let model = Model::from_bytes(&file).unwrap();
    let trajectories = strokes(1, 30, 1.0, closed_loop.rate_hz()).unwrap();
    let (mut emulated, mut board) = pil::start(Some(&file), LinkKind::Lockstep, 3).unwrap();
    assert_eq!(board.introduce().unwrap(), Some(model.checksum()));
    let plans: Vec<FlightPlan<'_>> = trajectories
        .iter()
        .zip(7..)
        .map(|(trajectory, seed)| FlightPlan::new(trajectory, seed).with(&model, Lanes::BOTH))
        .chain([FlightPlan::new(&trajectories[0], 7)])
        .collect();
    let (records, report) = pil::fly(&mut board, &closed_loop, &plans, |_| ()).unwrap();
    println!("{report:?}");
    assert!(report.bit_identical);
    assert!(records.iter().all(|record| record.rms > 0.01 && record.rms < 0.5), "the flights prove something");
    assert!(report.ticks > 300_000 / 4, "{} ticks", report.ticks);
    let figures = report.figures;
    assert_eq!((figures.deadline_misses, figures.late_inferences, figures.dropped), (0, 0, 0));
    board.end();
    assert_eq!(emulated.ended().unwrap(), Some(0));
}

#[test]
fn the_firmware_commissions_learns_and_keeps_across_a_power_cut_with_every_bit_of_the_software() {
    let closed_loop = closed_loop();
    let rate_hz = closed_loop.rate_hz();
    let mut trajectories = vec![commissioning(rate_hz).unwrap()];
    trajectories.extend(strokes(1, 3, 1.0, rate_hz).unwrap());
    let plans: Vec<FlightPlan<'_>> = trajectories.iter().zip(7..).map(|(flown, seed)| FlightPlan::new(flown, seed)).collect();
    let (hover, learned, next) = (&plans[..1], &plans[1..3], &plans[3..]);
    let mut software = pil::learner(&closed_loop).unwrap();

    let (emulated, mut board) = pil::start(None, LinkKind::Lockstep, 3).unwrap();
    assert_eq!(board.introduce().unwrap(), None);
    software.add_on().commission();
    board.prepare(&closed_loop.settings, None).unwrap();
    board.learn(LearnOrder::Commission).unwrap();
    let refused = board.learn(LearnOrder::Keep).unwrap_err();
    assert!(refused.to_string().contains("commission"), "{refused}");
    let (_, report) = pil::fly_learning(&mut board, &closed_loop, hover, &mut software, |_| ()).unwrap();
    assert!(report.bit_identical);
    let told = *board.learning().unwrap();
    assert_eq!((told.phase, told.problem, told.recalled), (Phase::Learning, None, false));
    let (records, report) = pil::fly_learning(&mut board, &closed_loop, learned, &mut software, |_| ()).unwrap();
    assert!(report.bit_identical && report.figures.deadline_misses == 0, "{report:?}");
    let baseline = closed_loop.errors(&trajectories[1..], None, 1.0, 8).unwrap();
    assert!(records[1].rms < 0.2 * baseline[1], "{} m, of {}", records[1].rms, baseline[1]);

    let mut bytes = [0; KEPT];
    let kept = software.keep(None, &mut bytes).unwrap();
    for refused in [board.learned().unwrap_err(), board.learn(LearnOrder::Keep).unwrap_err()] {
        assert!(matches!(refused, PilError::Refused { reason: Reason::Armed, .. }), "{refused}");
    }
    board.disarm().unwrap();
    assert_eq!(board.learned().unwrap(), kept);
    board.learn(LearnOrder::Keep).unwrap();
    // What is forgotten is forgotten in RAM alone.
    board.learn(LearnOrder::Forget).unwrap();
    assert_ne!(board.learned().unwrap(), kept);

    let (emulated, mut board) = pil::restart(emulated).unwrap();
    board.introduce().unwrap();
    let mut recalled = pil::learner(&closed_loop).unwrap();
    recalled.recall(None, kept).unwrap();
    assert_eq!(board.learned().unwrap(), kept);
    board.learn(LearnOrder::Learn).unwrap();
    let (records, report) = pil::fly_learning(&mut board, &closed_loop, next, &mut recalled, |_| ()).unwrap();
    assert!(report.bit_identical && board.learning().unwrap().recalled);
    // As if the power had not been cut.
    let uncut = closed_loop.fly_learning(&next[0], &mut software).unwrap();
    println!("{report:?}, {:.2} cm of {:.2}, uncut {:.2}", 100.0 * records[0].rms, 100.0 * baseline[2], 100.0 * uncut.rms);
    assert!(records[0].rms < 1.2 * uncut.rms, "{} m, of {}", records[0].rms, uncut.rms);

    // Beside a model it is another loop, and nothing is gone on with. It is measured without the model's lanes.
    let file = model::file(&model::TANH, Precision::Int8);
    let model = Model::from_bytes(&file).unwrap();
    drop((emulated, board));
    let (_emulated, mut board) = pil::start_recalling(Some(&file), kept, LinkKind::Lockstep, 3).unwrap();
    board.introduce().unwrap();
    let mut beside = pil::learner(&closed_loop).unwrap();
    assert_eq!(board.learned().unwrap(), beside.keep(Some(model.checksum()), &mut [0; KEPT]).unwrap());
    beside.add_on().commission();
    board.learn(LearnOrder::Commission).unwrap();
    let [hover, stroke] = [&hover[0], &next[0]].map(|plan| plan.clone().with(&model, Lanes::BOTH));
    let (_, report) = pil::fly_learning(&mut board, &closed_loop, &[hover], &mut beside, |_| ()).unwrap();
    assert!(report.bit_identical && board.learning().unwrap().phase == Phase::Learning);
    for axis in 0..3 {
        assert_eq!(beside.add_on().response(axis), software.add_on().response(axis));
    }
    let (_, report) = pil::fly_learning(&mut board, &closed_loop, &[stroke], &mut beside, |_| ()).unwrap();
    let telemetry = board.telemetry();
    assert!(report.bit_identical && telemetry.network.weight == 1.0 && telemetry.feedback.weight > 0.0, "{telemetry:?}");
}

/// Exchanges until the vehicle has taken off.
const TAKE_OFF: u64 = 1_000;

/// What came of a flight through a line with faults.
struct Flown {
    /// RMS error, m.
    rms: f64,
    /// Motor fractions of every control tick.
    motors: Vec<[f32; 4]>,
    /// Exchanges before the first control tick: the upload.
    uploaded: u64,
    telemetry: Telemetry,
}

/// Flies a stroke through a line that has these faults from the take-off on.
fn with_faults(faults: Faults) -> Flown {
    let closed_loop = closed_loop();
    let trajectory = strokes(1, 1, 1.0, closed_loop.rate_hz()).unwrap().remove(0);
    let file = model::file(&model::TANH, Precision::Int8);
    let model = Model::from_bytes(&file).unwrap();
    let (_emulated, line) = pil::connect(&pil::firmware().unwrap(), &[], Some(&file), LinkKind::Lockstep, 3).unwrap();
    let mut board = Board::new(Faulty::new(line, Faults { first: TAKE_OFF, ..faults }, 11), true);
    board.introduce().unwrap();
    let mut flight = board.prepare(&closed_loop.settings, Some(Lanes::BOTH)).unwrap();
    let plan = FlightPlan { record: true, ..FlightPlan::new(&trajectory, 7).with(&model, Lanes::BOTH) };
    let record = fly_on(&mut flight, &closed_loop.vehicle, &closed_loop.settings, &closed_loop.condition, &plan).unwrap();
    // After the motors are off the trajectory is refused.
    let refused = flight.check().is_err();
    assert!(!refused || !board.telemetry().armed);
    let answers = record.recorded.unwrap().answers;
    let motor = |bytes: &[u8], index: usize| f32::from_le_bytes(*bytes[4 * index..].first_chunk().unwrap());
    let motors: Vec<[f32; 4]> = answers.chunks(ANSWER).map(|answer| std::array::from_fn(|index| motor(answer, index))).collect();
    let uploaded = board.line().exchanges() - motors.len() as u64;
    Flown { rms: record.rms, motors, uploaded, telemetry: *board.telemetry() }
}

#[test]
fn a_bad_line_is_borne_and_every_motor_command_is_a_fraction() {
    let whole = with_faults(Faults::default());
    assert_eq!(whole.telemetry.frames.damaged + whole.telemetry.frames.dropped, 0);
    let faults = [
        ("1 % loss", Faults { loss: 0.01, ..Faults::default() }, 1.05),
        ("10 % loss", Faults { loss: 0.1, ..Faults::default() }, 1.3),
        ("bit errors", Faults { bit_errors: 1e-4, ..Faults::default() }, 1.2),
        ("half frames", Faults { cuts: 0.05, ..Faults::default() }, 1.3),
        ("reordering", Faults { late: 0.1, ..Faults::default() }, 1.2),
        ("garbage", Faults { garbage: 600, ..Faults::default() }, 1.05),
    ];
    for (name, faults, worse) in faults {
        let flown = with_faults(faults);
        println!("{name}: {:.2} cm against {:.2} cm, {:?}", 100.0 * flown.rms, 100.0 * whole.rms, flown.telemetry.frames);
        assert!(flown.motors.iter().flatten().all(|motor| (0.0..=1.0).contains(motor)), "{name}");
        assert!(flown.telemetry.armed && flown.rms < worse * whole.rms, "{name}: {} m", flown.rms);
        let frames = flown.telemetry.frames;
        assert!(frames.damaged + frames.dropped + frames.reordered > 50, "{name}: the faults are counted");
        assert_eq!(flown.telemetry.deadline_misses, 0, "{name}");
    }
}

#[test]
fn a_silent_peer_costs_the_add_on_first_and_then_the_motors() {
    let silence = |ticks| with_faults(Faults { silence: Some(TAKE_OFF + 500..TAKE_OFF + 500 + ticks), ..Faults::default() });
    let on = |flown: &Flown| flown.motors.iter().take_while(|motors| **motors != [0.0; 4]).count();
    // 0.1 s: the newest state is held, the vehicle flies on.
    let short = silence(50);
    assert_eq!(on(&short), short.motors.len());
    assert!(short.telemetry.armed);
    // 1 s: off after 0.25 s, and off for good.
    let long = silence(500);
    let (off, silent_from) = (on(&long), (TAKE_OFF + 500 - long.uploaded) as usize);
    assert!(off < long.motors.len() && off.abs_diff(silent_from + 125) < 5, "motors off at tick {off}");
    assert!(long.motors[off..].iter().all(|motors| *motors == [0.0; 4]));
    assert!(!long.telemetry.armed);
}

#[test]
fn the_serial_port_carries_a_flight_bit_for_bit() {
    let closed_loop = closed_loop();
    let file = model::file(&model::TANH, Precision::Int8);
    let model = Model::from_bytes(&file).unwrap();
    let mut trajectory = strokes(1, 1, 1.0, closed_loop.rate_hz()).unwrap().remove(0);
    // The emulated port manages a few hundred ticks a second.
    trajectory.samples.truncate(300);
    trajectory.scored = 0..300;
    let (_emulated, mut board) = pil::start(Some(&file), LinkKind::Uart, 3).unwrap();
    assert_eq!(board.introduce().unwrap(), Some(model.checksum()));
    let plans = [FlightPlan::new(&trajectory, 7), FlightPlan::new(&trajectory, 7).with(&model, Lanes::BOTH)];
    let (_, report) = pil::fly(&mut board, &closed_loop, &plans, |_| ()).unwrap();
    assert!(report.bit_identical && report.figures.dropped == 0, "{report:?}");
}
