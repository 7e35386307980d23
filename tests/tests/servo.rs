//! The servo of `firmware/examples`: its model is made again from its logs, byte for byte, and flown as the example says.

// Each example has the servo for a module of its own.
#![allow(clippy::duplicate_mod)]

#[path = "../../firmware/examples/deferred.rs"]
mod deferred;
#[path = "../../firmware/examples/one_axis.rs"]
mod one_axis;

use std::{f32::consts::TAU, fs, path::PathBuf, time::Duration};

use impromptu_firmware::{
    adapter::Lanes,
    features::{self, Feature},
    guard::Trip,
    math::sin_cos,
    model::{Interpolation, Output},
};
use impromptu_model_export::{
    Description, Precision,
    description::{Provenance, Timing},
    encode,
};
use impromptu_tests::{
    emulator::{FIRMWARE, build_firmware, run, workspace},
    golden,
};
use impromptu_training::supervised::{Dataset, RowMatrix, Skip, TrainingSettings, train};
use one_axis::servo::{RATE_HZ, SIGNALS, Servo};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

const SEED: u64 = 1;
/// Logs, the last of which choose the epoch; ticks of each: 10 s.
const LOGS: usize = 40;
const KEPT: usize = 6;
const TICKS: i32 = 5_000;
/// Loop ticks in a tick of the network.
const DIVISOR: u16 = 10;
/// Loop ticks from one training row to the next.
const STRIDE: usize = 7;
/// Tones of the reference in a log, each of at most these rad and rad/s.
const TONES: usize = 6;
const SWING: f32 = 0.7;
const QUICKEST: f32 = 9.0;

/// What the loop was told, and what it did, at each tick.
struct Log {
    references: Vec<f32>,
    angles: Vec<f32>,
}

impl Log {
    /// The loop alone, which follows a few tones.
    fn record(random: &mut Xoshiro256PlusPlus) -> Self {
        let tones: [[f32; 3]; TONES] = std::array::from_fn(|_| {
            let speed = random.random_range(0.5..QUICKEST);
            [random.random_range(0.1..SWING) / (1.0 + 0.3 * speed), speed, random.random_range(0.0..TAU)]
        });
        let mut servo = Servo::new();
        let (mut references, mut angles) = (Vec::new(), Vec::new());
        for tick in 0..TICKS {
            let time = tick as f32 / RATE_HZ;
            let reference = tones.iter().map(|[swing, speed, phase]| swing * sin_cos(speed * time + phase).0).sum();
            angles.push(servo.angle());
            references.push(reference);
            servo.track(reference);
        }
        Self { references, angles }
    }
}

/// In training the output stands in the place of the desired trajectory.
impl features::Signals for Log {
    fn desired(&self, tick: i32, _: usize) -> f32 {
        self.angles[tick as usize]
    }
    fn measured(&self, tick: i32, _: usize) -> f32 {
        self.angles[tick as usize]
    }
    fn reference(&self, tick: i32, _: usize) -> f32 {
        self.references[tick as usize]
    }
}

/// Where the shaft shall be, from 40 ms ago to 160 ms ahead, seen from where it shall be now.
fn window() -> Vec<Feature> {
    features::window(&[0], -2..=8).collect()
}

/// Rows of features, and the correction that made the loop do what it did.
fn rows(logs: &[Log], window: &[Feature]) -> Dataset {
    let (mut inputs, mut labels) = (RowMatrix::new(window.len()), RowMatrix::new(1));
    let mut row = vec![0.0; window.len()];
    let divisor = i32::from(DIVISOR);
    for log in logs {
        for tick in ((2 * divisor)..(TICKS - 8 * divisor)).step_by(STRIDE) {
            features::evaluate(window, log, tick, divisor, &mut row);
            inputs.push(&row);
            labels.push(&[log.references[tick as usize] - log.angles[tick as usize]]);
        }
    }
    Dataset::new(inputs, labels).unwrap()
}

/// The model file, from the servo.
fn model() -> Vec<u8> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(SEED);
    let logs: Vec<Log> = (0..LOGS).map(|_| Log::record(&mut random)).collect();
    let window = window();
    let (trained, kept) = logs.split_at(LOGS - KEPT);
    let (training, validation) = (rows(trained, &window), rows(kept, &window));
    // Without the linear part, whose last bits are not those of every processor.
    let settings =
        TrainingSettings { hidden: vec![16, 16], skip: Skip::Absent, epochs: 60, learning_rate: 3e-3, ..Default::default() };
    let learned = train(&settings, &training, &validation, &mut |_| ()).unwrap();
    let calibration: Vec<Vec<f32>> = training.inputs().iter().map(<[f32]>::to_vec).collect();
    let bounds = |column: usize| {
        calibration.iter().fold((f32::MAX, f32::MIN), |(low, high), row| (low.min(row[column]), high.max(row[column])))
    };
    let description = Description {
        name: "servo".into(),
        provenance: Provenance {
            vehicle: "a servo with friction, simulated".into(),
            software: "impromptu".into(),
            seed: SEED,
            ..Provenance::default()
        },
        signals: (&SIGNALS).into(),
        timing: Timing {
            reference_rate_hz: RATE_HZ,
            divisor: DIVISOR,
            interpolation: Interpolation::Linear,
            measurement_delay_s: 0.0,
            fade_s: 0.5,
        },
        features: window.clone(),
        outputs: vec![Output { channel: 0, limit: 1.0, slew: 0.05 }],
        envelope: (0..window.len()).map(bounds).collect(),
        feedback_lane: None,
        monitor: None,
        tie: None,
    };
    encode(&description, Some(&learned.network), Precision::Int8, &calibration).unwrap()
}

#[test]
fn the_examples_model_is_what_training_on_the_servo_gives() {
    let (stored, made) = (workspace().join("firmware/examples/one_axis.impromptu"), model());
    if golden::updating() {
        fs::write(&stored, &made).unwrap();
    }
    let same = fs::read(&stored).unwrap() == made;
    assert!(same, "{} is out of date; {}=1 writes it", stored.display(), golden::UPDATE_VARIABLE);
    assert!(made.len() < 2_048, "{} bytes", made.len());
}

/// Errors in degrees, RMS and largest, of the loop alone and with the add-on.
fn flown() -> [[f32; 2]; 2] {
    [Lanes::NONE, Lanes::BOTH].map(|lanes| one_axis::fly(lanes).unwrap().degrees())
}

#[test]
fn the_add_on_takes_most_of_the_servos_error() {
    let [alone, with] = flown();
    assert!(alone[0] > 9.0 && with[0] < 0.3, "{alone:?} {with:?}");
    one_axis::main().unwrap();
}

/// Evaluated after the tick, it makes no difference, to the bit; without the network its correction fades, and comes back.
#[test]
fn the_network_may_wait_for_the_control_task() {
    let [(_, each), (_, starved)] = deferred::SCHEDULES;
    let [alone, with] = flown();
    let (error, report) = deferred::fly(each).unwrap();
    assert_eq!((error.degrees(), report.late, report.network_weight), (with, 0, 1.0));
    let (error, report) = deferred::fly(starved).unwrap();
    assert!(error.degrees()[0] > 2.0 * with[0] && error.degrees()[0] < 0.5 * alone[0], "{error:?}");
    assert_eq!((report.late, report.trips.of(Trip::Late), report.network_weight), (50, 1, 1.0));
    deferred::main().unwrap();
}

/// As tasks of RTIC and of embassy: the same errors as here, to the bit.
#[test]
fn both_boards_examples_fly_the_servo_on_the_emulated_board() {
    let [alone, with] = flown();
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    for name in ["rtic", "embassy"] {
        let elf = build_firmware(&format!("impromptu-example-{name}"), &format!("example-{name}"), FIRMWARE, &[]).unwrap();
        let report = run(&elf, &folder, Duration::from_secs(120)).unwrap().report().unwrap();
        let errors = |key: &str| [0, 1].map(|index| report[key][index].as_f64().unwrap() as f32);
        assert_eq!((errors("alone"), errors("with"), &report["late"]), (alone, with, &0.into()), "{name}: {report}");
    }
}

/// What somebody writes for one axis, the loop itself apart.
#[test]
fn a_whole_use_in_the_docs_is_thirty_lines_at_most() {
    let source = fs::read_to_string(workspace().join("firmware/src/lib.rs")).unwrap();
    let (_, section) = source.split_once("//! # A whole use\n").unwrap();
    let example = section.split("//! ```\n").nth(1).unwrap();
    let lines = example.lines().map(|line| line.trim_start_matches("//!").trim());
    let written = lines.filter(|line| !line.is_empty() && !line.starts_with('#')).count();
    assert!((10..=30).contains(&written), "{written} lines");
}
