//! The quadrotor study: Insights 2 and 3 on the predecessor's loop and on a Crazyflie.
//!
//! *in* [`QuadrotorSettings`]; *out* a [`Study`]; *never* a choice made on the test trajectories; *source* Zhou 2017, section V; Li et al., ICRA 2017.

pub mod addon;
mod bias;
mod crazyflie;
pub mod half_height;
pub mod inputs;
mod origins;
pub mod predecessor;
mod rates;
pub mod references;
mod signals;
pub mod sizes;
mod strokes;
mod table;

use serde::{Deserialize, Serialize};

use super::Study;
use crate::{
    experiment::{Excitation, Loop, Purpose, Recipe, Signal, derived},
    flight_log::FlightLog,
    training::{Skip, TrainingSettings},
    trajectory::{STROKE_SPEED, by_name, stroke},
};
use addon::Course;
use crazyflie::Crazyflie;
use impromptu_firmware::{features::Feature, model::Interpolation};
use impromptu_model_export::float_network::Activation;
use predecessor::{DIVISOR, SPEED, at_its_pace, predecessor};

/// Rows of the paper's promises that are answered here.
pub const ROWS: &[u8] = &[1, 2, 15, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30];

/// What the study covers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct QuadrotorSettings {
    /// Seed of everything random.
    pub seed: u64,
    /// Training flights on the predecessor's loop, of 100 s each.
    pub flights: u32,
    /// Passes over the training data.
    pub epochs: usize,
    /// Validation strokes.
    pub validation: usize,
    /// Test strokes.
    pub strokes: usize,
    /// Trials of iterative learning.
    pub trials: usize,
    /// Training strokes on the Crazyflie.
    pub crazyflie_flights: u32,
}

impl Default for QuadrotorSettings {
    fn default() -> Self {
        Self { seed: 1, flights: 8, epochs: 60, validation: 8, strokes: 30, trials: 10, crazyflie_flights: 300 }
    }
}

impl QuadrotorSettings {
    /// A few flights and epochs: the same conclusions, other numbers.
    pub fn quick() -> Self {
        Self { flights: 4, epochs: 16, validation: 4, strokes: 6, trials: 3, crazyflie_flights: 60, ..Self::default() }
    }
}

/// What the sections share: the predecessor's loop, what it is trained on and flown over.
struct Ground<'a> {
    settings: &'a QuadrotorSettings,
    plant: Loop,
    logs: Vec<FlightLog>,
    validation: Course,
    test: Course,
}

/// The five test trajectories of Table I, one of them the letters in a plane.
const TEST: [&str; 5] = ["letters:DSL", "figure8", "star", "trefoil", "lissajous"];

impl<'a> Ground<'a> {
    fn new(settings: &'a QuadrotorSettings) -> anyhow::Result<Self> {
        let plant = predecessor()?;
        let rate = plant.rate_hz();
        let seed = derived(settings.seed, Purpose::Validation);
        let validation: Vec<_> = (0..settings.validation as u64)
            .map(|index| stroke(seed, index).scaled(SPEED / STROKE_SPEED).sampled(rate))
            .collect::<Result<_, _>>()?;
        let test: Vec<_> = TEST.iter().map(|name| Ok(at_its_pace(by_name(name)?, rate)?)).collect::<anyhow::Result<_>>()?;
        let first = derived(settings.seed, Purpose::Training);
        Ok(Self {
            logs: plant.collect(&multisine(settings.flights).motions(first), None, first)?,
            validation: Course::new(&plant, validation, seed)?,
            test: Course::new(&plant, test, derived(settings.seed, Purpose::Test))?,
            plant,
            settings,
        })
    }

    /// 4 x 128 ReLU without a skip, held at 6.67 Hz: the paper's network for a list of inputs.
    fn recipe(&self, features: Vec<Feature>) -> Recipe {
        Recipe {
            features: Some(features),
            divisor: DIVISOR,
            interpolation: Interpolation::Hold,
            stride: 3,
            network: TrainingSettings {
                hidden: vec![128; 4],
                activation: Activation::Relu,
                skip: Skip::Absent,
                initial_output_gain: 1.0,
                epochs: self.settings.epochs,
                batch: 64,
                // From the validation strokes: 0 lets the loop through the measured state run away on one of them.
                weight_decay: 1.0,
                seed: self.settings.seed,
                ..TrainingSettings::default()
            },
            ..Recipe::default()
        }
    }
}

/// Twelve tones an axis. The loop is slow: it flies less than it is asked for.
fn multisine(flights: u32) -> Excitation {
    Excitation { signal: Signal::Multisine, flights, seconds: 100.0, max_speed: 2.0, max_acceleration: 4.0, shortest_s: 1.5 }
}

/// Runs the study. `stage` is told what is done next.
///
/// # Errors
/// If anything cannot be flown, trained or encoded.
pub fn run(settings: &QuadrotorSettings, command: &str, stage: &dyn Fn(&str)) -> anyhow::Result<Study> {
    let mut study = Study::new("The quadrotor study", command, settings.seed);
    stage("training flights of the predecessor's loop");
    let ground = Ground::new(settings)?;
    stage("Table I and Fig. 3");
    let networks = table::run(&ground, &mut study)?;
    stage("reference points");
    origins::run(&ground, &networks.twelve, &mut study)?;
    stage("training signals");
    signals::run(&ground, &mut study)?;
    stage("Fig. 4");
    bias::run(&ground, &mut study)?;
    stage("training flights of the Crazyflie");
    let crazyflie = Crazyflie::new(settings)?;
    signals::crazyflie(&ground, &crazyflie, &mut study)?;
    stage("sub-rates and previews");
    rates::run(&ground, &crazyflie, &mut study)?;
    stage("network sizes");
    sizes::run(&crazyflie, &mut study)?;
    stage("strokes on the predecessor's loop");
    strokes::predecessor(&ground, &networks, &mut study)?;
    stage("strokes on the Crazyflie");
    strokes::crazyflie(&ground, &crazyflie, &mut study)?;
    Ok(study)
}

#[cfg(test)]
mod tests;
