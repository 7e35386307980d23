//! The main job, as a newcomer runs it, and what it must show: 30 strokes that nobody trained on, three conditions, two vehicles.

use std::{
    path::PathBuf,
    sync::{LazyLock, Mutex},
};

use impromptu_experiment::demo::{DemoSettings, run};
use impromptu_firmware::{adapter::Lanes, model::Model};
use impromptu_report::{Method, Results, Row};
use impromptu_reproduction::robustness::{CASES, Comparison};
use impromptu_sim::{
    condition::Condition,
    flights::Loop,
    plant::Vehicle,
    rollout::FlightPlan,
    trajectory::{hover, strokes},
};
use impromptu_tests::{board, golden};
use impromptu_training::{Purpose, derived, observer::Observer};

struct Silent;

impl Observer for Silent {
    fn stage(&self, _: &str) {}
    fn steps(&self, _: u64, _: u64) {}
}

/// Folder of the models and logs that the demo writes.
fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("demo")
}

/// The demo of `cargo run --release`, flown once for all tests.
static RESULTS: LazyLock<Results> =
    LazyLock::new(|| run(&DemoSettings { out: Some(folder()), ..DemoSettings::default() }, &Silent).expect("the demo runs"));

/// Folder of the models of the demo.
pub(crate) fn models() -> PathBuf {
    LazyLock::force(&RESULTS);
    folder().join("models")
}

fn row(vehicle: &str, condition: &str, speed: f64, method: Method) -> &'static Row {
    let found = RESULTS
        .table
        .iter()
        .find(|row| row.vehicle == vehicle && row.condition == condition && row.speed == speed && row.method == method);
    found.unwrap_or_else(|| panic!("{vehicle} {condition} {speed} {method:?} is in the table"))
}

const VEHICLES: [&str; 2] = ["crazyflie", "crazyflie-brushless"];

fn at_least(row: &Row, mean: f64, worst: f64) {
    assert!(row.reduction_mean >= mean && row.reduction_worst >= worst, "asked {mean} / {worst}: {row:?}");
}

#[test]
fn both_lanes_track_unseen_strokes_better() {
    for (condition, mean, worst) in [("clean", 98.5, 95.0), ("lab", 96.5, 93.0), ("rough", 93.5, 87.0)] {
        for vehicle in VEHICLES {
            at_least(row(vehicle, condition, 1.0, Method::FullInt8), mean, worst);
        }
    }
}

#[test]
fn twenty_milliseconds_more_delay_do_no_harm() {
    for (condition, mean) in [("lab+20ms", 92.0), ("rough+20ms", 87.0)] {
        for vehicle in VEHICLES {
            at_least(row(vehicle, condition, 1.0, Method::FullInt8), mean, 0.0);
        }
    }
}

/// The demo's model on a vehicle and in an air that it was not made for, with the guard.
#[test]
fn both_lanes_bear_what_differs_at_test_time_only() {
    let closed_loop =
        Loop::new(Vehicle::named("crazyflie").expect("a vehicle"), "stock", Condition::named("lab").expect("a condition"));
    let closed_loop = closed_loop.expect("a loop");
    let file = std::fs::read(models().join("crazyflie-stock-lab-seed1.impromptu")).expect("the demo's model");
    let model = Model::from_bytes(&file).expect("a model");
    let seed = derived(RESULTS.seed, Purpose::Test);
    let trajectories = strokes(seed, 30, 1.0, closed_loop.rate_hz()).expect("strokes");
    for case in CASES {
        let flown = Comparison::fly(&case.mismatch.applied(&closed_loop), &model, &trajectories, seed).expect("flights");
        let ((mean, worst), (network, _)) = (flown.both_lanes(), flown.network_alone());
        golden::announce(&format!("{}: both lanes {mean:.1} / {worst:.1} %, network {network:.1} %", case.what));
        assert!(mean >= case.asked && worst > 0.0 && mean > network, "{}: {mean} / {worst}, asked {}", case.what, case.asked);
    }
}

#[test]
fn the_network_lane_alone_is_what_the_paper_promises_and_more() {
    for (condition, mean) in [("clean", 98.0), ("lab", 89.0), ("rough", 76.0)] {
        for vehicle in VEHICLES {
            at_least(row(vehicle, condition, 1.0, Method::NetInt8), mean, 0.0);
        }
    }
}

#[test]
fn the_network_earns_its_place_against_ridge_regression() {
    let over = |vehicle, condition: &str, speed| {
        let mean = |method| row(vehicle, condition, speed, method).reduction_mean;
        mean(Method::NetF32) - mean(Method::Ridge)
    };
    for vehicle in VEHICLES {
        for condition in Condition::NAMES {
            for speed in [1.0, 1.35, 1.7] {
                let points = over(vehicle, condition, speed);
                assert!(points >= -0.3, "{vehicle} {condition} {speed}: {points}");
            }
        }
    }
    assert!(over("crazyflie-brushless", "clean", 1.35) >= 2.5);
    assert!(over("crazyflie-brushless", "clean", 1.7) >= 4.0);
    assert!(over("crazyflie", "clean", 1.7) >= 1.5);
}

/// At 12 m/s² motors saturate in some strokes, which neither lane can mend; the feedback lane must not make them worse.
#[test]
fn fast_flights_keep_the_gain_of_both_lanes() {
    for vehicle in VEHICLES {
        for condition in ["lab", "rough"] {
            let [network, both] = [Method::NetInt8, Method::FullInt8].map(|method| row(vehicle, condition, 1.7, method));
            at_least(both, network.reduction_mean + 0.5, 84.0);
        }
    }
}

/// The flatness comparison has a feedback lane of its own, chosen for it with wider clamps.
#[test]
fn both_lanes_beat_flatness_with_the_strongest_feedback_by_five_points() {
    for full in RESULTS.table.iter().filter(|row| row.method == Method::FullInt8 && row.vehicle == "crazyflie") {
        let flatness = row(&full.vehicle, &full.condition, full.speed, Method::FeedforwardFeedback);
        assert!(full.reduction_mean - flatness.reduction_mean >= 5.0, "{full:?} against {flatness:?}");
    }
}

#[test]
fn quantisation_costs_at_most_half_a_point() {
    for int8 in &RESULTS.table {
        let float = match int8.method {
            Method::NetInt8 => Method::NetF32,
            Method::FullInt8 => Method::FullF32,
            _ => continue,
        };
        let float = row(&int8.vehicle, &int8.condition, int8.speed, float);
        assert!(int8.reduction_mean >= float.reduction_mean - 0.5, "{int8:?} against {float:?}");
    }
}

/// The README's table is what the demo shows, up to what another processor's rounding may change.
#[test]
fn the_readme_tells_the_numbers_of_the_demo() {
    let readme = include_str!("../../README.md");
    let mut checked = 0;
    for line in readme.lines().filter(|line| VEHICLES.iter().any(|vehicle| line.starts_with(&format!("| {vehicle} |")))) {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        let speed: f64 = cells[2].trim_end_matches('x').parse().expect("a speed");
        let methods = [Method::FeedforwardFeedback, Method::Ridge, Method::NetInt8, Method::FullInt8];
        for (cell, method) in cells[4..].iter().zip(methods) {
            let found = row(cells[0], cells[1], speed, method);
            let (mean, worst) = cell.split_once(" / ").expect("mean / worst");
            let near =
                |text: &str, value: f64, tolerance: f64| (text.parse::<f64>().expect("a number") - value).abs() <= tolerance;
            assert!(near(mean, found.reduction_mean, 0.3) && near(worst, found.reduction_worst, 2.0), "{line}: {found:?}");
            checked += 1;
        }
    }
    assert!(checked >= 24, "the README has a table of the demo");
}

/// The delay margin that a model states is the one that it is flown with: a hover with the feedback lane alone and no guard, on
/// seeds of its own, has at most twice the error, and a millimetre more, 10 ms before it, and more 10 ms after it.
#[test]
fn stated_delay_margins_are_what_is_flown() {
    for vehicle in VEHICLES {
        for condition in ["lab", "rough"] {
            let file = std::fs::read(models().join(format!("{vehicle}-stock-{condition}-seed1.impromptu"))).expect("a file");
            let model = Model::from_bytes(&file).expect("a model");
            let stated = f64::from(model.card().feedback.as_ref().expect("a lane").margins.delay_ms);
            let condition = Condition::named(condition).expect("a condition");
            let closed_loop =
                Loop::new(Vehicle::named(vehicle).expect("a vehicle"), "stock", condition).expect("a loop").unguarded();
            let hovers = vec![hover(12.0).sampled(closed_loop.rate_hz()).expect("a hover"); 4];
            let lanes = Lanes { network: false, feedback: true };
            let error = |milliseconds: f64| {
                let delayed = closed_loop.delayed(milliseconds * 1e-3);
                let errors = delayed.errors(&hovers, Some((&model, lanes)), 1.0, 77).expect("flights");
                errors.iter().sum::<f64>() / errors.len() as f64
            };
            let most = 2.0 * error(0.0) + 1e-3;
            let [before, after] = [stated - 10.0, stated + 10.0].map(|milliseconds| error(milliseconds.max(0.0)));
            assert!(before <= most && after > most, "{vehicle}, {stated} ms: {before} {after} of {most} m");
        }
    }
}

/// The file that the demo wrote, over one of its test strokes, on the emulated board.
#[test]
fn a_flight_of_the_trained_model_has_the_same_bits_on_the_board() {
    static ONE_BOARD: Mutex<()> = Mutex::new(());
    let _one = ONE_BOARD.lock();
    let results = &*RESULTS;
    let file = std::fs::read(folder().join("models/crazyflie-stock-lab-seed1.impromptu")).expect("the demo's model");
    let model = Model::from_bytes(&file).expect("a model");
    let vehicle = Vehicle::named("crazyflie").expect("a vehicle");
    let closed_loop = Loop::new(vehicle, "stock", Condition::named("lab").expect("a condition")).expect("a loop");
    let trajectories = strokes(results.seed + 1000, 1, 1.0, closed_loop.rate_hz()).expect("a stroke");
    let plan = FlightPlan { record: true, ..FlightPlan::new(&trajectories[0], 5).with(&model, Lanes::BOTH) };
    let records = closed_loop.fly(&[plan]).expect("a flight");
    let recorded = records[0].recorded.as_ref().expect("a recording");
    let report = board::fly_again("trained", Some(&file), recorded).expect("the same bits");
    golden::announce(&format!("trained model on the board: {report}"));
}
