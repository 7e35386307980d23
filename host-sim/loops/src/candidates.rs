//! Designs of feedback lanes: a grid of them for every axis, in sizes that suit the loop.
//!
//! *in* models of the axes; *out* lanes as a model stores them, not flown yet; *never* a size that the loop's own error and time
//! constant do not give; *source* the grid of `impromptu-training`, scaled.

use impromptu_firmware::model::Margins;
use impromptu_model_export::description::{AuthorityDescription, LaneAxisDescription, LaneDescription};
use impromptu_training::feedback_design::{DesignRefusal, DesignSettings, LaneDesign, design, smallest};
use rayon::prelude::*;

use crate::{layout::Layout, models::Models};

/// What the sizes of a loop are in those of the loop for which designs were found good: a Crazyflie's, which is 13 cm behind and
/// has a time constant of 0.7 s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Length, in the axis' unit for each metre.
    pub length: f64,
    /// Time, s a second.
    pub time: f64,
}

/// RMS error and lag of that loop, m and s.
const ERROR: f64 = 0.13;
/// See [`ERROR`].
const LAG_S: f64 = 0.7;
/// Memory of a lane and of the model on which it is judged, s of that loop.
const MEMORY_S: [f64; 2] = [0.25, 0.45];
/// Control weights, weights on velocity (s²) and clamps (m) tried.
const CONTROL_WEIGHTS: [f64; 3] = [3e-3, 6e-3, 1.2e-2];
/// See [`CONTROL_WEIGHTS`].
const VELOCITY_WEIGHTS: [f64; 2] = [0.05, 0.2];
/// See [`CONTROL_WEIGHTS`].
const FAST_LIMITS: [f64; 2] = [0.1, 0.15];
/// Clamp of the integral, m; error and desired acceleration at which half of the fast clamp is left, m and m/s².
const INTEGRAL_LIMIT: f64 = 0.3;
/// See [`INTEGRAL_LIMIT`].
const AUTHORITY: [f64; 2] = [0.1, 6.0];
/// Time in which the recent peak of these is forgotten, s.
const FORGOTTEN_S: f64 = 0.33;

impl Scale {
    /// Of a loop whose error and lag, s, are these.
    pub fn of(error: f64, lag_s: f64) -> Self {
        Self { length: (error / ERROR).max(1e-9), time: (lag_s / LAG_S).clamp(1e-4, 1e4) }
    }

    /// Settings of a design at this rate, Hz, with the memory of a loop as slow as `slowest`.
    pub fn settings(&self, rate_hz: f64, slowest: f64) -> DesignSettings {
        let Self { length, time } = *self;
        let ticks = |seconds: f64| (seconds * slowest * rate_hz).round();
        let lags = ticks(MEMORY_S[0]).clamp(6.0, 25.0) as usize;
        let usual = DesignSettings::default();
        let [position, velocity] = usual.least_noise;
        DesignSettings {
            tick: 1.0 / rate_hz,
            lags,
            margin_lags: (ticks(MEMORY_S[1]).clamp(10.0, 45.0) as usize).max(lags),
            integral_weight: usual.integral_weight / (time * time),
            noise_factor: 2.0,
            least_noise: [position * length, velocity * length / time],
            least_excitation: usual.least_excitation * length,
            least_precision: usual.least_precision * time * time * 0.01 * rate_hz,
            ..usual
        }
    }
}

/// An axis of which lanes are designed.
#[derive(Clone, Debug)]
pub struct DesignAxis<'a> {
    /// Its models.
    pub models: &'a Models,
    /// Its sizes.
    pub scale: Scale,
    /// Settings of its designs.
    pub settings: DesignSettings,
    /// Index into the layout's axes.
    pub place: usize,
}

/// One point of the grid, designed for every axis.
pub struct Candidate {
    /// Of each axis the lane and its margins, or why there is none.
    pub axes: Vec<Result<(LaneAxisDescription, Margins), DesignRefusal>>,
    /// The design in words.
    pub words: String,
}

/// Authority of a lane over axes of these sizes.
pub fn authority(layout: &Layout, axes: &[DesignAxis<'_>], rate_hz: f64) -> AuthorityDescription {
    let largest = axes.iter().map(|axis| axis.scale.length).fold(0.0, f64::max);
    let fastest = axes.iter().map(|axis| axis.scale.length / axis.scale.time.powi(2)).fold(0.0, f64::max);
    let slowest = axes.iter().map(|axis| axis.scale.time).fold(0.0, f64::max);
    let channels: Vec<u8> = axes.iter().filter_map(|axis| layout.axes[axis.place].desired[2]).collect();
    AuthorityDescription {
        channels,
        scale: (AUTHORITY[1] * fastest) as f32,
        error_scale: (AUTHORITY[0] * largest) as f32,
        decay: (-1.0 / (FORGOTTEN_S * slowest * rate_hz)).exp() as f32,
    }
}

fn stored(
    layout: &Layout,
    axis: &DesignAxis<'_>,
    output: u8,
    designed: &LaneDesign,
    fast_limit: f64,
) -> (LaneAxisDescription, Margins) {
    let channels = &layout.axes[axis.place];
    let coefficients: Vec<f32> = designed.gain.stored_coefficients().iter().map(|value| *value as f32).collect();
    let lags = designed.gain.lags();
    let mut errors = Vec::new();
    let mut error_coefficients = Vec::new();
    for (derivative, these) in coefficients.chunks(lags).take(2).enumerate() {
        if let (Some(measured), Some(desired)) = (channels.measured[derivative], channels.desired[derivative]) {
            errors.push((measured, desired));
            error_coefficients.push(these.to_vec());
        }
    }
    let lane = LaneAxisDescription {
        output,
        errors,
        error_coefficients,
        output_coefficients: coefficients[2 * lags..].to_vec(),
        integral: designed.gain.integral_coefficient as f32,
        fast_limit: (fast_limit * axis.scale.length) as f32,
        integral_limit: (INTEGRAL_LIMIT * axis.scale.length) as f32,
    };
    (lane, designed.margins())
}

/// All designs of the grid.
pub fn candidates(layout: &Layout, axes: &[DesignAxis<'_>]) -> Vec<Candidate> {
    let grid: Vec<(f64, f64)> =
        CONTROL_WEIGHTS.iter().flat_map(|control| VELOCITY_WEIGHTS.iter().map(move |velocity| (*control, *velocity))).collect();
    let designs: Vec<Vec<Result<LaneDesign, DesignRefusal>>> = grid
        .par_iter()
        .map(|&(control_weight, velocity)| {
            let settings = |axis: &DesignAxis<'_>| DesignSettings {
                control_weight,
                velocity_weight: velocity * axis.scale.time * axis.scale.time,
                ..axis.settings.clone()
            };
            axes.iter().map(|axis| design(&axis.models.data, &settings(axis))).collect()
        })
        .collect();
    let mut candidates = Vec::new();
    for ((control, velocity), designs) in grid.iter().zip(&designs) {
        for fast_limit in FAST_LIMITS {
            let axes = axes.iter().zip(designs).zip(0u8..).map(|((axis, designed), output)| match designed {
                Ok(designed) => Ok(stored(layout, axis, output, designed, fast_limit)),
                Err(refusal) => Err(refusal.clone()),
            });
            candidates.push(Candidate {
                axes: axes.collect(),
                words: format!("control weight {control}, e_v {velocity}, fast clamp {fast_limit}"),
            });
        }
    }
    candidates
}

/// A lane of these axes, with the smallest of their margins.
pub fn lane_of(axes: &[(&LaneAxisDescription, Margins)], authority: AuthorityDescription) -> LaneDescription {
    LaneDescription {
        axes: axes.iter().map(|(lane, _)| (*lane).clone()).collect(),
        authority,
        margins: smallest(axes.iter().map(|(_, margins)| *margins)),
    }
}
