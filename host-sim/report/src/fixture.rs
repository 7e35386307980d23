//! Invented results for the tests: plausible in size, flown by nobody.

use crate::{
    method::Method,
    results::{FlightTrace, LaneOutcome, Margins, ModelCard, PerFlight, Results},
    summary::summarise,
};
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::{Distribution as _, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// No flights at all.
pub(super) fn empty() -> Results {
    Results {
        title: "Nothing flown".to_owned(),
        command: "host-sim report".to_owned(),
        seed: 7,
        software_version: "0.1.0".to_owned(),
        table: Vec::new(),
        flights: Vec::new(),
        per_flight: Vec::new(),
        models: Vec::new(),
        timings: Vec::new(),
        conditions: Vec::new(),
        notes: Vec::new(),
    }
}

/// One flight of the Crazyflie with its stock gains under `lab`.
pub(super) fn flight(method: Method, trajectory: &str, rms_cm: f64, reduction: f64) -> PerFlight {
    PerFlight {
        vehicle: "crazyflie".to_owned(),
        gains: "stock".to_owned(),
        condition: "lab".to_owned(),
        speed: 1.0,
        method,
        trajectory: trajectory.to_owned(),
        rms_cm,
        reduction,
        seed: 7,
    }
}

/// Two flights, four methods.
pub(super) fn small() -> Results {
    let per_flight = vec![
        flight(Method::Baseline, "stroke 1", 10.0, 0.0),
        flight(Method::Baseline, "stroke 2", 12.5, 0.0),
        flight(Method::Feedforward, "stroke 1", 4.0, 60.0),
        flight(Method::Feedforward, "stroke 2", 15.0, -20.0),
        flight(Method::NetInt8, "stroke 1", 1.0, 90.0),
        flight(Method::NetInt8, "stroke 2", 1.5, 88.0),
        flight(Method::FullInt8, "stroke 1", 0.2, 98.0),
        flight(Method::FullInt8, "stroke 2", 0.5, 96.0),
    ];
    Results {
        title: "Two flights".to_owned(),
        command: "host-sim --seed 7".to_owned(),
        table: summarise(&per_flight),
        per_flight,
        ..empty()
    }
}

/// Two vehicles, four conditions, three speeds, twelve methods, thirty flights; eight flights in full.
pub(super) fn full() -> Results {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    let mut per_flight = Vec::new();
    for (vehicle, penalty) in [("crazyflie", 1.0), ("crazyflie_brushless", 1.3)] {
        for (condition, floor_cm) in [("clean", 0.04), ("lab", 0.25), ("rough", 0.6), ("lab+20ms", 0.4)] {
            for speed in [1.0, 1.35, 1.7] {
                for stroke in 0..30 {
                    let baseline = 11.0 * speed * log_normal(&mut random, 0.15);
                    for method in Method::ALL {
                        let share = remaining(method) * penalty * speed * log_normal(&mut random, 0.3);
                        let rms_cm = if method == Method::Baseline { baseline } else { (baseline * share).hypot(floor_cm) };
                        per_flight.push(PerFlight {
                            vehicle: vehicle.to_owned(),
                            condition: condition.to_owned(),
                            speed,
                            ..flight(method, &format!("stroke {stroke}"), rms_cm, 100.0 * (1.0 - rms_cm / baseline))
                        });
                    }
                }
            }
        }
    }
    let mut flights = Vec::new();
    for stroke in 0..6 {
        let desired = stroke_path(&mut random, stroke == 5);
        flights.push(trace(&mut random, stroke, Method::Baseline, &desired));
        flights.push(trace(&mut random, stroke, Method::FullInt8, &desired));
    }
    Results {
        title: "Impromptu: 30 strokes that it never saw".to_owned(),
        command: "cargo run --release -- --seed 7 --out out".to_owned(),
        seed: 7,
        software_version: "0.1.0 (invented data)".to_owned(),
        table: summarise(&per_flight),
        per_flight,
        flights,
        models: ["clean", "lab", "rough"].map(card).into(),
        timings: [("collect", 4.2), ("train", 61.8), ("design of the lane", 9.4), ("evaluate", 38.25)]
            .map(|(stage, seconds)| (stage.to_owned(), seconds))
            .into(),
        conditions: Vec::new(),
        notes: vec!["Every number on this page is invented: it is the test of the page itself.".to_owned()],
    }
}

fn card(condition: &str) -> ModelCard {
    let refused = condition == "clean";
    ModelCard {
        name: format!("crazyflie-stock-{condition}"),
        vehicle: "crazyflie".to_owned(),
        gains: "stock".to_owned(),
        condition: condition.to_owned(),
        bytes: 24_812,
        crc32: 0x0bad_cafe,
        parameters: 21_430,
        multiply_adds: 20_992,
        margins: (!refused).then_some(Margins { delay_ms: 38.4, gain: 2.41, modulus: 0.52 }),
        lane: if refused {
            LaneOutcome::Refused("the logs carry no independent dither on the position reference".to_owned())
        } else {
            LaneOutcome::Chosen("control weight 3e-3, e_v 0.05 s², noise x1, fast clamp 0.05 m".to_owned())
        },
        minutes: Some(11.5),
        quantisation_rms_mm: Some(0.241),
    }
}

fn log_normal(random: &mut Xoshiro256PlusPlus, sigma: f64) -> f64 {
    let deviate: f64 = StandardNormal.sample(random);
    (sigma * deviate).exp()
}

fn remaining(method: Method) -> f64 {
    match method {
        Method::Baseline => 1.0,
        Method::Feedforward => 0.35,
        Method::Feedback => 0.24,
        Method::FeedforwardFeedback => 0.1,
        Method::Ridge => 0.05,
        Method::NetF32 | Method::NetInt8 => 0.035,
        Method::FullRidge => 0.02,
        Method::FullF32 | Method::FullInt8 => 0.012,
        Method::Learned | Method::FullLearned => 0.015,
    }
}

/// A smooth closed curve of a few harmonics in the x-z plane, or in space.
fn stroke_path(random: &mut Xoshiro256PlusPlus, in_space: bool) -> Vec<[f64; 3]> {
    let mut amplitude = [[0.0; 4]; 3];
    let mut phase = [[0.0; 4]; 3];
    for axis in 0..3 {
        for harmonic in 0..4 {
            let planar = axis != 1 || in_space;
            amplitude[axis][harmonic] = if planar { random.random_range(0.2..0.9) / (harmonic as f64 + 1.0) } else { 0.0 };
            phase[axis][harmonic] = random.random_range(0.0..std::f64::consts::TAU);
        }
    }
    (0..1200)
        .map(|i| {
            let turn = (f64::from(i) - 150.0).clamp(0.0, 900.0) / 900.0 * std::f64::consts::TAU;
            std::array::from_fn(|axis| {
                let height = if axis == 2 { 1.5 } else { 0.0 };
                (0..4).fold(height, |sum, k| sum + amplitude[axis][k] * (turn * (k + 1) as f64 + phase[axis][k]).sin())
            })
        })
        .collect()
}

fn trace(random: &mut Xoshiro256PlusPlus, stroke: usize, method: Method, desired: &[[f64; 3]]) -> FlightTrace {
    let baseline = method == Method::Baseline;
    // A loop of 12 rad/s lags and cuts corners; the reference that undoes this runs ahead of it.
    let (bandwidth, ahead) = if baseline { (0.12, 0) } else { (1.0, 18) };
    let (mut wander, mut smooth, mut late) = ([0.0; 3], desired[0], desired[0]);
    let flown = desired
        .iter()
        .map(|point| {
            std::array::from_fn(|axis| {
                let deviate: f64 = StandardNormal.sample(random);
                wander[axis] = 0.97 * wander[axis] + 5e-4 * deviate;
                smooth[axis] += bandwidth * (point[axis] - smooth[axis]);
                late[axis] += bandwidth * (smooth[axis] - late[axis]);
                late[axis] + wander[axis]
            })
        })
        .collect();
    let reference = (0..desired.len()).map(|i| desired[(i + ahead).min(desired.len() - 1)]).collect();
    FlightTrace {
        trajectory: format!("stroke {stroke}"),
        vehicle: "crazyflie".to_owned(),
        gains: "stock".to_owned(),
        condition: "lab".to_owned(),
        speed: 1.0,
        method,
        rate_hz: 100.0,
        desired: desired.to_vec(),
        flown,
        reference,
        scored: 150..1050,
    }
}
