//! What a tick teaches.
//!
//! *in* a measurement, and what the loop would make of the features; *out* one row of least squares a tick; *never* a row
//! before the filters know enough; *source* ours: the rows are those of the table of a learner.

use super::{AHEAD, BEHIND, EACH, LATER, Learner, PACE, SMOOTHING};
use crate::{
    learning::{
        ring::Ring,
        values::{FEEDBACK, LAGS, Measured, PREVIEW, Parts},
    },
    math::{clamp, finite_or_zero, sqrt},
};

/// Of the derivative beside the value, ticks.
const DERIVATIVE: f32 = 30.0;
/// Noise of a row of each part, in scales of the axis.
const PREVIEW_SIGMA: f32 = 0.015;
const FEEDBACK_SIGMA: f32 = 0.007;
/// Control weight, and weight of the margin rows.
const EFFORT: f32 = 0.001;
const MARGIN: f32 = 10.0;
/// A motion that is faster than what was learned from leaves more that no weights explain. Its root mean square over this time,
/// s, is noise too.
const NOISE_WINDOW: f32 = 2.0;
/// What is excited is forgotten with this time constant, s; of a slow loop with a longer one. What makes a loop another one, as a
/// battery, does not wait for a fast one.
const MEMORY: f32 = 30.0;
/// In motion is where a feature is larger than this, in scales of the axis.
const MOTION: f32 = 0.01;
/// How much noisier a row at rest counts: all of them say the same of the constant, and what pushes the machine there lasts for
/// many of them. Else a minute of hover in gusts would make the constant surer than it is, and the next motion bear the
/// difference.
const AT_REST: f32 = 16.0;
/// Ticks without rows after the start, when the filters know too little yet.
const PREVIEW_AFTER: f32 = 60.0;
const FEEDBACK_AFTER: f32 = 150.0;

impl Learner {
    /// Error and its rate of change, against what was desired when it was measured.
    pub(super) fn error(&mut self, desired: &impl Fn(i32) -> f32, measured: Measured) -> [f32; 2] {
        let past = |offset: i32| desired(offset.max(-BEHIND));
        let (whole, part) = (self.delay as i32, self.delay - self.delay as i32 as f32);
        let when = |value: &dyn Fn(i32) -> f32| (1.0 - part) * value(-whole) + part * value(-whole - 1);
        let slope = |offset: i32| 0.5 * self.rate_hz * (past(offset + 1) - past(offset - 1));
        let error = measured.value - when(&past);
        let rate = match measured.rate {
            Some(rate) => rate - when(&slope),
            None => {
                let [before, rate] = self.derived;
                let fresh = (error - before) * self.rate_hz;
                finite_or_zero(rate + (fresh - rate) / (1.0 + SMOOTHING / self.response.turn()))
            }
        };
        self.derived = [finite_or_zero(error), rate];
        [error, rate]
    }

    /// Learns from the row whose turn it is.
    pub(super) fn learn(&mut self, learn: Parts, missing: f32) {
        let forgotten = EACH as f32 / (MEMORY * self.pace.max(self.rate_hz));
        let sigma = FEEDBACK_SIGMA * self.limits.scale;
        let since = |ticks: f32| self.ticks as f32 > ticks * self.scale;
        let teaches = learn.feedback && since(FEEDBACK_AFTER);
        match self.ticks % EACH {
            0 if learn.preview && since(PREVIEW_AFTER) => {
                let row = self.window(|offset| self.filtered.past((AHEAD - offset) as usize), self.response.gain());
                let surprise = missing - self.preview.dot(&row);
                let most = self.limits.correction * self.limits.correction;
                self.noise += (clamp(surprise * surprise, 0.0, most) - self.noise) * EACH as f32
                    / (NOISE_WINDOW * self.pace.max(self.rate_hz));
                let noise = PREVIEW_SIGMA * self.limits.scale + sqrt(self.noise.max(0.0));
                let (_, features) = row.split_last().unwrap_or((&0.0, &[]));
                let moves = features.iter().any(|feature| feature.abs() > MOTION * self.limits.scale);
                self.preview.learn(&row, missing, if moves { noise } else { AT_REST * noise }, forgotten);
                if moves {
                    self.learned_s += EACH as f32 / self.rate_hz;
                }
            }
            1 if teaches => {
                self.feedback.learn(&self.past(&self.answered, 0), -self.free[0].past(0), sigma, forgotten);
            }
            2 if teaches => {
                let later = clamp(libm::ceilf(LATER * self.pace / PACE), 1.0, LATER) as usize;
                let [now, before] = [0, later].map(|ticks| self.past(&self.answered, ticks));
                let change = core::array::from_fn(|index| now[index] - before[index]);
                self.feedback.learn(&change, 0.0, sigma / sqrt(MARGIN), forgotten);
            }
            3 if teaches => {
                self.feedback.learn(&self.past(&self.free, 0), 0.0, sigma / sqrt(EFFORT), forgotten);
            }
            _ => {}
        }
    }

    /// Features of the preview part.
    pub(super) fn window(&self, signal: impl Fn(i32) -> f32, one: f32) -> [f32; PREVIEW] {
        let present = signal(0);
        core::array::from_fn(|index| self.offsets.get(index).map_or(one, |offset| signal((*offset).into()) - present))
    }

    /// Features of the feedback part, of so many ticks before.
    pub(super) fn past<const N: usize>(&self, rings: &[Ring<N>; 2], before: usize) -> [f32; FEEDBACK] {
        let derivative = DERIVATIVE * self.scale / self.rate_hz;
        let [value, rate] = rings;
        core::array::from_fn(|index| match self.lags.get(index) {
            Some(lag) => value.past(usize::from(*lag) + before),
            None => derivative * rate.past(self.lags.get(index - LAGS.len()).map_or(0, |lag| usize::from(*lag)) + before),
        })
    }
}
