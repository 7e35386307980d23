//! What robustness costs: the control weight of the feedback lane swept.
//!
//! *in* a loop with its models, dithered logs; *out* margins and reductions of each design, and the limit at the same control
//! weight; *never* a choice of a design (that is made on validation flights), nor a lane that the guard saved; *source* Doyle,
//! "Guaranteed margins for LQG regulators" (1978): there are none.

use impromptu_firmware::{
    adapter::Lanes,
    model::{Margins, Model},
};
use impromptu_model_export::{Description, ExportError};
use impromptu_sim::{
    flights::{Loop, reduction},
    trajectory::Trajectory,
};
use impromptu_training::{Built, LaneRecipe, Purpose, Recipe, derived, dithered_logs, lanes};
use rayon::prelude::*;

use super::{gaussian, hover::linearise};

/// Efforts of the sweep.
pub const CONTROL_WEIGHTS: [f64; 8] = [1e-4, 3e-4, 1e-3, 3e-3, 6e-3, 1.2e-2, 3e-2, 1e-1];
/// Further delays of the whole loop at which each design flies, s.
pub const DELAYS: [f64; 3] = [0.0, 0.01, 0.02];

/// One design.
#[derive(Clone, Debug)]
pub struct Design {
    /// Weight on the square of the lane's output.
    pub control_weight: f64,
    /// Smallest margins over the axes; zero where the identified loop is unstable.
    pub margins: Margins,
    /// Mean and worst reduction over the strokes at each of [`DELAYS`], both lanes, per cent.
    pub reductions: [(f64, f64); DELAYS.len()],
    /// Root mean square of the position error that the linear-quadratic-Gaussian limit leaves at hover at the same control
    /// weight, m.
    pub limit: Option<f64>,
}

/// Designs a lane at each control weight with the weights and the clamps of the recipe's first choices, and flies it.
///
/// # Errors
/// If logs or flights cannot be flown, or no lane can be designed at all.
pub fn sweep(
    recipe: &Recipe,
    closed_loop: &Loop,
    built: &Built,
    trajectories: &[Trajectory],
    seed: u64,
    flight_seed: u64,
) -> anyhow::Result<Vec<Design>> {
    let logs = dithered_logs(&recipe.lane, closed_loop, derived(seed, Purpose::Identification))?;
    let axes = (0..3).map(|axis| linearise(closed_loop, axis)).collect::<Result<Vec<_>, _>>()?;
    let loops = DELAYS.map(|delay| closed_loop.unguarded().delayed(delay));
    let baselines = loops
        .iter()
        .map(|closed_loop| closed_loop.errors(trajectories, None, 1.0, flight_seed))
        .collect::<Result<Vec<_>, _>>()?;
    let one = |control_weight: f64| LaneRecipe {
        control_weights: vec![control_weight],
        velocity_weights: recipe.lane.velocity_weights.iter().take(1).copied().collect(),
        noise_factors: recipe.lane.noise_factors.iter().take(1).copied().collect(),
        fast_limits: recipe.lane.fast_limits.iter().take(1).copied().collect(),
        authority_scales: recipe.lane.authority_scales.iter().take(1).copied().collect(),
        ..recipe.lane.clone()
    };
    let designs = CONTROL_WEIGHTS.par_iter().map(|&control_weight| {
        // A control weight at which there is no lane is a gap in the figure.
        let Some(lane) = lanes(&one(control_weight), &logs).ok().and_then(|lanes| lanes.into_iter().next()) else {
            return Ok(None);
        };
        let margins = lane.margins;
        let description = Description { feedback_lane: Some(lane), monitor: None, ..built.models.description.clone() };
        let bytes = built.learned.encode(&description)?;
        let model = Model::from_bytes(&bytes).map_err(ExportError::Refused)?;
        let mut reductions = [(0.0, 0.0); DELAYS.len()];
        for ((closed_loop, baseline), found) in loops.iter().zip(&baselines).zip(&mut reductions) {
            *found = reduction(baseline, &closed_loop.errors(trajectories, Some((&model, Lanes::BOTH)), 1.0, flight_seed)?);
        }
        let variances = axes.iter().map(|axis| gaussian::limit(axis, control_weight).map(|limit| limit.variance));
        let limit = variances.sum::<Option<f64>>().map(f64::sqrt);
        Ok::<_, anyhow::Error>(Some(Design { control_weight, margins, reductions, limit }))
    });
    Ok(designs.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
}
