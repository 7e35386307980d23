//! What goes into a learner and comes out of it.
//!
//! *in/out* plain numbers in the unit of the axis and seconds; *never* anything that acts; *source* ours.

use super::response::Response;
use crate::math::clamp;

/// Ticks before (-) and after now at which the desired trajectory is looked at, of a loop with a lag of 50 ticks.
pub(super) const OFFSETS: [i16; 12] = [-30, -20, -12, -6, 6, 12, 20, 30, 40, 50, 65, 80];
/// Weights of the preview part.
pub(super) const PREVIEW: usize = OFFSETS.len() + 1;
/// Ticks before now at which the error is looked at, of the same loop.
pub(super) const LAGS: [u8; 6] = [0, 3, 8, 16, 30, 50];
/// Weights of the feedback part.
pub(super) const FEEDBACK: usize = 2 * LAGS.len();

/// Lag, ticks, of the loop of which these are.
const LAG: f32 = 50.0;

/// Of offsets and lags: at most 1.
pub(super) fn scale(response: &Response) -> f32 {
    clamp(response.lag() / LAG, 0.05, 1.0)
}

/// Ticks before (-) and after now at which the trajectory of a loop with this response is looked at.
pub fn offsets(response: &Response) -> [i16; OFFSETS.len()] {
    // Away from 0: no offset is the present.
    OFFSETS.map(|ticks| (libm::ceilf(f32::from(ticks.abs()) * scale(response)) as i16) * ticks.signum())
}

/// Ticks before now at which the error of a loop with this response is looked at.
pub fn lags(response: &Response) -> [u8; LAGS.len()] {
    LAGS.map(|ticks| libm::ceilf(f32::from(ticks) * scale(response)) as u8)
}

/// Which parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parts {
    /// The preview part.
    pub preview: bool,
    /// The feedback part.
    pub feedback: bool,
}

impl Parts {
    /// Both.
    pub const BOTH: Self = Self { preview: true, feedback: true };
    /// None.
    pub const NONE: Self = Self { preview: false, feedback: false };
    /// The preview part alone.
    pub const PREVIEW: Self = Self { preview: true, feedback: false };
}

/// How the correction is bounded, in the unit of the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// By what errors are judged, about what a correction is at its largest in a calm motion: an error of a fiftieth of it does
    /// not matter.
    pub scale: f32,
    /// All of it.
    pub correction: f32,
    /// What the feedback part has of it.
    pub feedback: f32,
    /// Its change in a second.
    pub rate: f32,
}

impl Limits {
    /// Whether every one is a positive number.
    pub(super) fn are_sane(&self) -> bool {
        [self.scale, self.correction, self.feedback, self.rate].iter().all(|limit| *limit > 0.0 && *limit < 1e12)
    }
}

/// What was measured: the value and its rate of change, unit of the axis and a second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Value.
    pub value: f32,
    /// Rate of change; `None`: that of the error through a low pass of first order ([`super::SMOOTHING`]).
    pub rate: Option<f32>,
}

impl Measured {
    /// Whether every number is one.
    pub(super) fn is_finite(&self) -> bool {
        self.value.is_finite() && self.rate.is_none_or(f32::is_finite)
    }
}

/// What was learned of one axis: weights of the preview part, whose last one is the constant, and of the feedback part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Learned {
    /// Preview part.
    pub preview: [f32; PREVIEW],
    /// Feedback part.
    pub feedback: [f32; FEEDBACK],
}
