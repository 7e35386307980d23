//! What was learned in flight, as a network: the prior of what is learned next.
//!
//! *in* what was kept of a flight stack's learner; *out* the recipe and the network of its preview part, for the [`Pipeline`]
//! that makes model files; *never* what was learned on top of another model, of which it is only a part; *source* ours
//! ([`impromptu_firmware::learning`]): the preview part is linear in the desired motion, as the network that is all skip.
//!
//! [`Pipeline`]: crate::pipeline::Pipeline

use impromptu_firmware::{
    features::{Feature, Relative, Signals, Source, evaluate},
    learning::{Kept, NotKept, identity, offsets},
    model::Interpolation,
};
use impromptu_flight::quadrotor::{self, REFERENCE};
use impromptu_model_export::{FloatNetwork, Precision};
use impromptu_sim::{rollout::setpoint, trajectory::Trajectory};

use crate::{
    examples::Labels,
    learn::{Learned, Rows},
    recipe::Recipe,
    supervised::{Dataset, DatasetError, RowMatrix},
};

/// Axes of a flight stack's learner.
const AXES: usize = 3;

/// Why it is no network.
#[derive(Debug, thiserror::Error)]
pub enum FlownError {
    /// Nothing was kept, or of another loop.
    #[error("{0}")]
    NotKept(#[from] NotKept),
    /// Nothing was learned in motion.
    #[error("axis {axis}: learned from {learned_s:.1} s in motion, which is less than the {LEAST_S} s that are needed; fly on")]
    Little {
        /// Axis.
        axis: usize,
        /// Time in motion, s.
        learned_s: f32,
    },
    /// No rows.
    #[error("motions: {0}")]
    Rows(#[from] DatasetError),
}

/// Least time in motion that an axis has learned from, s.
const LEAST_S: f32 = 5.0;

/// Recipe and network of what a learner beside the flight stack has kept, with rows of these motions: what the network gives on
/// them is what its outputs may be. The recipe is the one given, but for features and rate, which are the learner's.
///
/// # Errors
/// If what was kept is not of a flight stack at this rate, Hz, without a model, or of too little motion.
pub fn learned_in_flight(
    recipe: &Recipe,
    kept: &[u8],
    rate_hz: f64,
    motions: &[Trajectory],
) -> Result<(Recipe, Learned), FlownError> {
    let kept = Kept::read(kept)?;
    if usize::from(kept.count()) != AXES {
        return Err(NotKept::Axes { found: kept.count() }.into());
    }
    if kept.identity != identity(quadrotor::signals(), rate_hz as f32, None) {
        return Err(NotKept::Other.into());
    }
    let (mut features, mut weights, mut constants) = (Vec::new(), Vec::new(), [0.0; REFERENCE]);
    for (axis, learned) in kept.axes().enumerate() {
        if learned.learned_s < LEAST_S {
            return Err(FlownError::Little { axis, learned_s: learned.learned_s });
        }
        let channel = axis as u8;
        for (offset, weight) in offsets(&learned.response).into_iter().zip(learned.learned.preview) {
            features.push(Feature { source: Source::Desired, channel, offset, relative: Relative::Desired(channel) });
            weights.push((axis, weight));
        }
        constants[axis] = learned.learned.preview.last().copied().unwrap_or(0.0);
    }
    let network = FloatNetwork {
        input_mean: vec![0.0; features.len()],
        input_scale: vec![1.0; features.len()],
        layers: Vec::new(),
        skip: Some(
            (0..REFERENCE).flat_map(|row| weights.iter().map(move |(axis, w)| if *axis == row { *w } else { 0.0 })).collect(),
        ),
        output_mean: constants.to_vec(),
        output_scale: vec![1.0; REFERENCE],
        notes: Default::default(),
    };
    let rows = rows(&network, &features, motions)?;
    let recipe = Recipe { features: Some(features), divisor: 1, interpolation: Interpolation::Linear, ..recipe.clone() };
    let learned = Learned {
        labels: Labels::Corrections,
        ridge: network.clone(),
        network: network.clone(),
        exported: network,
        precision: Precision::Float,
        rows,
        held_out: 0,
        determination: f64::NAN,
        broken: Vec::new(),
    };
    Ok((recipe, learned))
}

/// A desired motion, as features read it; nothing is measured or applied.
struct Motion<'a>(&'a Trajectory);

impl Signals for Motion<'_> {
    fn desired(&self, tick: i32, channel: usize) -> f32 {
        let Trajectory { samples, .. } = self.0;
        let sample = &samples[(tick.max(0) as usize).min(samples.len() - 1)];
        quadrotor::desired(&setpoint(sample)).get(channel).copied().unwrap_or(0.0)
    }
    fn measured(&self, _: i32, _: usize) -> f32 {
        0.0
    }
    fn reference(&self, _: i32, _: usize) -> f32 {
        0.0
    }
}

/// Ticks from one row to the next.
const EACH: usize = 5;
/// No output of a model has a limit of 0, though none of the velocity references is corrected; m and m/s.
const LEAST_RANGE: f32 = 1e-3;

/// What the network sees on motions, and gives.
fn rows(network: &FloatNetwork, features: &[Feature], motions: &[Trajectory]) -> Result<Rows, DatasetError> {
    let (mut inputs, mut labels) = (RowMatrix::new(features.len()), RowMatrix::new(REFERENCE));
    let mut row = vec![0.0; features.len()];
    for motion in motions {
        for tick in (0..motion.samples.len()).step_by(EACH) {
            evaluate(features, &Motion(motion), tick as i32, 1, &mut row);
            inputs.push(&row);
            labels.push(&network.evaluate(&row));
        }
    }
    let mut rows = Rows::of(&Dataset::new(inputs, labels)?);
    rows.label_range.iter_mut().for_each(|range| *range = range.max(LEAST_RANGE));
    Ok(rows)
}
