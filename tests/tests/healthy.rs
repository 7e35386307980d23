//! Healthy flights: the vehicle that the model was made for, in the laboratory, with both lanes, over trajectories that it was
//! not trained on. The guard trips in none of them.
//!
//! A trip hands over a lane that did no harm: who sees that too often switches the guard off, and has none when it matters.

use std::{collections::BTreeMap, fmt::Write as _};

use impromptu_firmware::{
    adapter::Lanes,
    guard::{Trip, Trips},
    model::Model,
};
use impromptu_reproduction::robustness::{Change, handover::windows};
use impromptu_sim::{
    condition::Condition,
    flights::Loop,
    plant::{GRAVITY, Vehicle},
    rollout::FlightPlan,
    trajectory::{Motion, Trajectory, by_name, hover, stroke},
};
use impromptu_tests::golden;

const SEED: u64 = 2_024;
/// Simulated time in the test command, and in the long tests, s.
const SECONDS: f64 = 480.0;
const LONG: f64 = 10.0 * 3_600.0;
const VEHICLES: [&str; 2] = ["crazyflie", "crazyflie-brushless"];
/// Beside these, a round has so many strokes, of which the last are flown at the other speed that models are validated at, and
/// a hover of so many seconds.
const SHAPES: [&str; 7] = ["circle", "figure8", "lissajous", "helix", "trefoil", "star", "letters:IMPROMPTU"];
const STROKES: u64 = 8;
const FAST_STROKES: u64 = 2;
const FAST: f64 = 1.7;
const HOVER_S: f64 = 20.0;

/// What is flown in a round; no stroke comes twice.
fn round(number: u64) -> Vec<Motion> {
    let strokes = (0..STROKES).map(|index| {
        let motion = stroke(SEED, number * STROKES + index);
        if index < STROKES - FAST_STROKES {
            return motion;
        }
        let name = format!("fast {}", motion.name());
        motion.scaled(FAST).named(name)
    });
    let shapes = SHAPES.iter().map(|name| by_name(name).expect("a known name"));
    strokes.chain(shapes).chain([hover(HOVER_S)]).collect()
}

/// Flies rounds of both vehicles in turn until `seconds` are flown; the table of what was flown, and each trip.
fn flown(seconds: f64) -> (String, Vec<String>) {
    let fleet = VEHICLES.map(|vehicle| {
        let file = crate::demo::models().join(format!("{vehicle}-stock-lab-seed1.impromptu"));
        let condition = Condition::named("lab").expect("a condition");
        let closed_loop = Loop::new(Vehicle::named(vehicle).expect("a vehicle"), "stock", condition).expect("a loop");
        (closed_loop, std::fs::read(file).expect("the demo's model"))
    });
    // Flights and seconds of each vehicle and kind.
    let mut done: BTreeMap<(&str, String), (u32, f64)> = BTreeMap::new();
    let (mut total, mut trips, mut number) = (0.0, Vec::new(), 0);
    while total < seconds {
        let (closed_loop, bytes) = &fleet[number as usize % fleet.len()];
        let model = Model::from_bytes(bytes).expect("a model");
        let rate_hz = closed_loop.rate_hz();
        let trajectories: Vec<Trajectory> =
            round(number).iter().map(|motion| motion.sampled(rate_hz).expect("a trajectory")).collect();
        let first = SEED + number * trajectories.len() as u64;
        let plans: Vec<FlightPlan<'_>> = trajectories
            .iter()
            .zip(first..)
            .map(|(trajectory, seed)| FlightPlan::new(trajectory, seed).with(&model, Lanes::BOTH))
            .collect();
        for (plan, record) in plans.iter().zip(closed_loop.fly(&plans).expect("flights")) {
            let seconds = plan.trajectory.samples.len() as f64 / rate_hz;
            let kind = plan.trajectory.name.split(':').next().unwrap_or_default().to_owned();
            let entry = done.entry((closed_loop.vehicle.name.as_str(), kind)).or_default();
            (entry.0, entry.1, total) = (entry.0 + 1, entry.1 + seconds, total + seconds);
            if record.trips != Trips::NONE {
                trips.push(told(closed_loop, &model, plan.trajectory, plan.seed));
            }
        }
        number += 1;
    }
    let mut text = format!("seed {SEED}: {:.1} simulated minutes\n", total / 60.0);
    for ((vehicle, kind), (flights, seconds)) in &done {
        writeln!(text, "{vehicle:<20} {kind:<13} {flights:>5} flights {:>7.1} min", seconds / 60.0).expect("a text takes it");
    }
    (text, trips)
}

/// The trips of a flight, flown once more, each with its time and what went before: the error of half a second with and without
/// the add-on, and the largest force that was desired in a second as a share of what the rotors give.
fn told(closed_loop: &Loop, model: &Model<'_>, trajectory: &Trajectory, seed: u64) -> String {
    let mut text = format!("{} {}, seed {seed}:", closed_loop.vehicle.name, trajectory.name);
    let fly = |model| Change::NONE.fly(closed_loop, model, trajectory, seed).expect("a flight");
    let (assisted, baseline) = (fly(Some(model)), fly(None));
    let second = closed_loop.rate_hz() as usize;
    let errors = [&assisted, &baseline].map(|flown| windows(&flown.squared_errors(), second / 2));
    let vehicle = &closed_loop.vehicle;
    let most = 4.0 * vehicle.thrust_coefficient * vehicle.rotor_speed_max.powi(2) / vehicle.mass;
    let share = |[x, y, z]: [f64; 3]| (x * x + y * y + (z + GRAVITY).powi(2)).sqrt() / most;
    for (tick, pair) in (1_usize..).zip(assisted.lanes.windows(2)) {
        for trip in Trip::ALL {
            let [before, after] = [&pair[0], &pair[1]].map(|lanes| [lanes.trips.network, lanes.trips.feedback]);
            for (lane, name) in ["network", "feedback"].iter().enumerate() {
                if after[lane][trip.index()] > before[lane][trip.index()] {
                    let [with, without] = errors.each_ref().map(|errors| 100.0 * errors[(tick + 1).saturating_sub(second / 2)]);
                    let asked = &trajectory.samples[tick.saturating_sub(second)..=tick];
                    let asked = asked.iter().map(|sample| share(sample.acceleration)).fold(0.0, f64::max);
                    let (at, trip) = (tick as f64 / closed_loop.rate_hz(), trip.name());
                    write!(text, " {name} {trip} at {at:.2} s, {with:.1} cm, without {without:.1} cm, force {asked:.2};")
                        .expect("a text takes it");
                }
            }
        }
    }
    text
}

fn nothing_trips(seconds: f64) {
    let (text, trips) = flown(seconds);
    golden::announce(&text);
    assert!(trips.is_empty(), "{} flights with false trips:\n{}", trips.len(), trips.join("\n"));
}

#[test]
fn the_guard_trips_in_no_healthy_flight() {
    nothing_trips(SECONDS);
}

#[test]
#[ignore = "long"]
fn long_healthy_flights() {
    nothing_trips(LONG);
}
