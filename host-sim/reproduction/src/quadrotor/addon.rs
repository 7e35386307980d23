//! From logs to a model file, for any list of inputs and any reference point.
//!
//! *in* a recipe, logs of the baseline; *out* a network and its ridge regression, and model files of them; *never* another
//! feature function, kernel or adapter than the firmware's; *source* Zhou 2017, section III-A and Insight 3. What is trained does
//! not depend on whether y_d or y is the reference point: in the training data they are the same. Only in flight they differ.

use impromptu_firmware::{
    adapter::Lanes,
    features::Feature,
    model::{Interpolation, Model},
};
use impromptu_model_export::{ExportError, FloatNetwork, Precision};
use impromptu_sim::{
    flight_log::FlightLog,
    flights::{Loop, reduction},
    rollout::FlightPlan,
    trajectory::Trajectory,
};
use impromptu_training::{Bypass, Labels, LearnSettings, Pipeline, Recipe, describe, feedforward};

use super::inputs::Origin;

/// The network lane alone.
pub const NETWORK: Lanes = Lanes { network: true, feedback: false };
/// Largest correction of a study's model: none that it would ever ask for in order, m and m/s.
const LIMIT: f32 = 20.0;

/// What was learned.
#[derive(Clone, Debug)]
pub struct Learned {
    /// How.
    pub recipe: Recipe,
    /// The maps: a network, and the ridge regression on the same inputs.
    pub maps: impromptu_training::Learned,
}

/// Learns from logs, all of which count: one network with the recipe's weight decay, in float, and no flight judges it.
///
/// # Errors
/// If the logs hold too little.
pub fn learn(recipe: &Recipe, closed_loop: &Loop, logs: &[FlightLog], labels: Labels) -> anyhow::Result<Learned> {
    let one = Recipe { weight_decays: vec![recipe.network.weight_decay], shares: vec![1.0], ..recipe.clone() };
    let pipeline = Pipeline::unjudged(&one, closed_loop, recipe.network.seed);
    let settings = LearnSettings { labels, precision: Precision::Float, keep_broken: true, ..pipeline.settings };
    let maps = Pipeline { settings, ..pipeline }.learn(logs, &mut |_| {})?;
    Ok(Learned { recipe: recipe.clone(), maps })
}

impl Learned {
    /// A model file of one of the two maps, flown with differences of inputs as `inputs` has them and its output added to `base`.
    ///
    /// # Errors
    /// If it cannot be encoded.
    pub fn file(
        &self,
        closed_loop: &Loop,
        network: &FloatNetwork,
        inputs: &[Feature],
        base: Origin,
    ) -> Result<Vec<u8>, ExportError> {
        let mut description = describe(&self.recipe, closed_loop, &self.maps.rows, None, "study", "", self.recipe.network.seed);
        description.features = inputs.to_vec();
        for output in &mut description.outputs {
            (output.limit, output.slew) = (LIMIT, 2.0 * LIMIT);
        }
        // The adapter adds to the desired state: what is added to the measured one, or to nothing, brings the difference itself.
        let bypass = match (self.maps.labels, base) {
            (Labels::Corrections, Origin::Measured) => Some(Bypass::Measured),
            (labels, _) => labels.bypass(),
        };
        self.maps.encode_as(&description, network, Precision::Float, bypass)
    }

    /// The same, held or ramped between sub-rate ticks.
    #[must_use]
    pub fn at(&self, interpolation: Interpolation) -> Self {
        Self { recipe: Recipe { interpolation, ..self.recipe.clone() }, ..self.clone() }
    }

    /// The network's file as it was trained.
    ///
    /// # Errors
    /// If it cannot be encoded.
    pub fn network_file(&self, closed_loop: &Loop) -> Result<Vec<u8>, ExportError> {
        self.file(closed_loop, &self.maps.network, &self.recipe.features(), Origin::Desired)
    }

    /// p_r = p_d + a_d / kp, without anything learned, for the same loop.
    ///
    /// # Errors
    /// If it cannot be encoded.
    pub fn feedforward_file(&self, closed_loop: &Loop) -> Result<Vec<u8>, ExportError> {
        let description = describe(&self.recipe, closed_loop, &self.maps.rows, None, "feedforward", "", self.recipe.network.seed);
        feedforward(&closed_loop.settings, description)
    }

    /// The ridge regression's.
    ///
    /// # Errors
    /// If it cannot be encoded.
    pub fn ridge_file(&self, closed_loop: &Loop) -> Result<Vec<u8>, ExportError> {
        self.file(closed_loop, &self.maps.ridge, &self.recipe.features(), Origin::Desired)
    }
}

/// Flights over trajectories with or without the baseline's errors to compare with.
#[derive(Clone, Debug)]
pub struct Course {
    /// What is flown.
    pub trajectories: Vec<Trajectory>,
    /// Seed of the first flight.
    pub seed: u64,
    /// RMS errors of the baseline, m.
    pub baseline: Vec<f64>,
}

impl Course {
    /// Flies the baseline.
    ///
    /// # Errors
    /// If it cannot be flown.
    pub fn new(closed_loop: &Loop, trajectories: Vec<Trajectory>, seed: u64) -> anyhow::Result<Self> {
        let baseline = closed_loop.errors(&trajectories, None, 1.0, seed)?;
        Ok(Self { trajectories, seed, baseline })
    }

    /// RMS errors with a model file, m.
    ///
    /// # Errors
    /// If the file is refused.
    pub fn errors(&self, closed_loop: &Loop, file: &[u8], lanes: Lanes) -> anyhow::Result<Vec<f64>> {
        let model = Model::from_bytes(file).map_err(ExportError::Refused)?;
        Ok(closed_loop.unguarded().errors(&self.trajectories, Some((&model, lanes)), 1.0, self.seed)?)
    }

    /// Reduction of each flight, per cent.
    pub fn reductions(&self, errors: &[f64]) -> Vec<f64> {
        self.baseline.iter().zip(errors).map(|(baseline, error)| 100.0 * (1.0 - error / baseline)).collect()
    }

    /// Mean and worst reduction, per cent.
    ///
    /// # Errors
    /// If the file is refused.
    pub fn reduction(&self, closed_loop: &Loop, file: &[u8]) -> anyhow::Result<(f64, f64)> {
        Ok(reduction(&self.baseline, &self.errors(closed_loop, file, NETWORK)?))
    }

    /// Logs of the flights with a model file, or of the baseline.
    ///
    /// # Errors
    /// If the file is refused.
    pub fn logs(&self, closed_loop: &Loop, file: Option<&[u8]>) -> anyhow::Result<Vec<FlightLog>> {
        let model = file.map(Model::from_bytes).transpose().map_err(ExportError::Refused)?;
        let plans: Vec<FlightPlan<'_>> = self
            .trajectories
            .iter()
            .zip(self.seed..)
            .map(|(trajectory, seed)| FlightPlan {
                model: model.as_ref().map(|model| (model, NETWORK)),
                guard: closed_loop.unguarded().guard,
                log: true,
                ..FlightPlan::new(trajectory, seed)
            })
            .collect();
        Ok(closed_loop.fly(&plans)?.into_iter().filter_map(|record| record.log).collect())
    }
}
