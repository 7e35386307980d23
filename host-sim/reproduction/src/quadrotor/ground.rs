//! What the sections share: the predecessor's loop, its flights and the paper's recipe.

use impromptu_firmware::{features::Feature, model::Interpolation};
use impromptu_model_export::float_network::Activation;
use impromptu_sim::{
    flight_log::FlightLog,
    flights::Loop,
    trajectory::{STROKE_SPEED, by_name, stroke},
};
use impromptu_training::{
    FlightSet, Purpose, Recipe, Signal, derived,
    supervised::{Skip, TrainingSettings},
};

use super::{
    addon::Course,
    predecessor::{DIVISOR, SPEED, at_its_pace, predecessor},
    settings::QuadrotorSettings,
};

/// What the sections share: the predecessor's loop, what it is trained on and flown over.
pub(super) struct Ground<'a> {
    pub(super) settings: &'a QuadrotorSettings,
    pub(super) closed_loop: Loop,
    pub(super) logs: Vec<FlightLog>,
    pub(super) validation: Course,
    pub(super) test: Course,
}

/// The five test trajectories of Table I, one of them the letters in a plane.
pub(super) const TEST: [&str; 5] = ["letters:DSL", "figure8", "star", "trefoil", "lissajous"];

impl<'a> Ground<'a> {
    pub(super) fn new(settings: &'a QuadrotorSettings) -> anyhow::Result<Self> {
        let closed_loop = predecessor()?;
        let rate = closed_loop.rate_hz();
        let seed = derived(settings.seed, Purpose::Validation);
        let validation: Vec<_> = (0..settings.validation as u64)
            .map(|index| stroke(seed, index).scaled(SPEED / STROKE_SPEED).sampled(rate))
            .collect::<Result<_, _>>()?;
        let test: Vec<_> = TEST.iter().map(|name| Ok(at_its_pace(by_name(name)?, rate)?)).collect::<anyhow::Result<_>>()?;
        let first = derived(settings.seed, Purpose::Training);
        Ok(Self {
            logs: closed_loop.collect(&multisine(settings.flights).motions(first), None, first)?,
            validation: Course::new(&closed_loop, validation, seed)?,
            test: Course::new(&closed_loop, test, derived(settings.seed, Purpose::Test))?,
            closed_loop,
            settings,
        })
    }

    /// 4 x 128 ReLU without a skip, held at 6.67 Hz: the paper's network for a list of inputs.
    pub(super) fn recipe(&self, features: Vec<Feature>) -> Recipe {
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
            ..Recipe::long()
        }
    }
}

/// Twelve tones an axis. The loop is slow: it flies less than it is asked for.
pub(super) fn multisine(flights: u32) -> FlightSet {
    FlightSet { signal: Signal::Multisine, flights, seconds: 100.0, max_speed: 2.0, max_acceleration: 4.0, shortest_s: 1.5 }
}
