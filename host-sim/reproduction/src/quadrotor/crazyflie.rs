//! The Crazyflie's part of the study: clean and in the lab, trained on strokes of other seeds, with the window of desired
//! positions.
//!
//! *in* settings; *out* loops, logs, recipe and the flights by which sweeps are judged; *never* a test stroke among them;
//! *source* this project's pilot.

use impromptu_firmware::model::Interpolation;
use impromptu_sim::{
    condition::Condition,
    flight_log::FlightLog,
    flights::Loop,
    plant::Vehicle,
    trajectory::{STROKE_ACCELERATION, STROKE_SPEED, strokes},
};
use impromptu_training::{FlightSet, Purpose, Recipe, Signal, derived, supervised::TrainingSettings};

use super::{addon::Course, settings::QuadrotorSettings};

/// Loops, logs and recipe.
pub(super) struct Crazyflie {
    pub(super) clean: Loop,
    pub(super) lab: Loop,
    pub(super) clean_logs: Vec<FlightLog>,
    pub(super) lab_logs: Vec<FlightLog>,
    /// Strokes of the validation set's seed.
    pub(super) clean_course: Course,
    pub(super) lab_course: Course,
    /// The same at 1.7 times the speed, where the motors saturate.
    pub(super) fast_course: Course,
    pub(super) recipe: Recipe,
    /// The brushless vehicle, clean: a loop whose inverse is less linear.
    pub(super) brushless: Loop,
    pub(super) brushless_logs: Vec<FlightLog>,
    pub(super) brushless_course: Course,
    pub(super) brushless_fast_course: Course,
}

/// Training strokes at some speeds.
pub(super) fn training_flights(speeds: &[f64], flights: u32) -> Vec<FlightSet> {
    let of = |speed: &f64| FlightSet {
        signal: Signal::Strokes,
        flights,
        seconds: 0.0,
        max_speed: speed * STROKE_SPEED,
        max_acceleration: speed * speed * STROKE_ACCELERATION,
        shortest_s: 0.0,
    };
    speeds.iter().map(of).collect()
}

/// Settings of a network that is not used: a sweep of linear maps trains for one epoch.
pub(super) fn linear(network: &TrainingSettings) -> TrainingSettings {
    TrainingSettings { hidden: vec![1], epochs: 1, batch: 256, ..network.clone() }
}

impl Crazyflie {
    pub(super) fn new(settings: &QuadrotorSettings) -> anyhow::Result<Self> {
        let vehicle = Vehicle::named("crazyflie")?;
        let condition = |name: &str| Condition::named(name).ok_or_else(|| anyhow::anyhow!("no condition `{name}`"));
        let clean = Loop::new(vehicle.clone(), "stock", condition("clean")?)?.unguarded();
        let lab = Loop::new(vehicle, "stock", condition("lab")?)?.unguarded();
        let brushless = Loop::new(Vehicle::named("crazyflie-brushless")?, "stock", condition("clean")?)?.unguarded();
        let first = derived(settings.seed, Purpose::Training);
        let training_flights = training_flights(&[1.0, 2.0], settings.crazyflie_flights / 2);
        let collect = |closed_loop: &Loop| -> anyhow::Result<Vec<FlightLog>> {
            let mut logs = Vec::new();
            for (kind, flight_set) in training_flights.iter().enumerate() {
                let seed = first.wrapping_add(10_000 * kind as u64);
                logs.extend(closed_loop.collect(&flight_set.motions(seed), None, seed)?);
            }
            Ok(logs)
        };
        let seed = derived(settings.seed, Purpose::Validation);
        let course = |closed_loop: &Loop, speed| {
            Course::new(closed_loop, strokes(seed, settings.validation, speed, closed_loop.rate_hz())?, seed)
        };
        Ok(Self {
            clean_logs: collect(&clean)?,
            lab_logs: collect(&lab)?,
            clean_course: course(&clean, 1.0)?,
            lab_course: course(&lab, 1.0)?,
            fast_course: course(&lab, 1.7)?,
            brushless_logs: collect(&brushless)?,
            brushless_course: course(&brushless, 1.0)?,
            brushless_fast_course: course(&brushless, 1.7)?,
            brushless,
            recipe: Recipe {
                interpolation: Interpolation::Linear,
                stride: 10,
                training_flights: training_flights.clone(),
                network: TrainingSettings {
                    epochs: settings.epochs / 3,
                    weight_decay: 0.1,
                    learning_rate: 2e-3,
                    seed: settings.seed,
                    ..TrainingSettings::default()
                },
                weight_decays: vec![0.1],
                validation_strokes: settings.validation,
                ..Recipe::long()
            },
            clean,
            lab,
        })
    }

    /// Settings for sweeps of linear maps.
    pub(super) fn linear(&self) -> TrainingSettings {
        linear(&self.recipe.network)
    }
}
