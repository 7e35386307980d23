//! The feedback lane's limit cycle.
//!
//! *in* what the lane asks for on each of its axes, at every reference tick; *out* whether it swings to and fro between its
//! clamps; *never* more than one turn of an axis in a tick. A lane whose loop is unstable swings between its
//! clamps several times a second, long before the error shows it: the vehicle is too slow to follow. At its clamps it damps
//! nothing any more, and the next manoeuvre goes astray.
//!
//! A turn is a way back of nearly the whole range between the clamps: what a lane does within a part of it, or where its
//! authority is low, is none. Noise brings turns about too, but not as many, and not with the power of a lane that is hardly ever
//! between its clamps.

use super::{GuardSettings, watch::ewma_gain};
use crate::format::FeedbackLayout;

/// One axis.
#[derive(Clone, Copy, Debug)]
struct Swing {
    /// Farthest value since the last turn, in clamps,
    extreme: f32,
    /// and whether it is the highest one.
    rising: bool,
    /// Recent mean, in clamps.
    mean: f32,
}

/// Recent swings of the feedback lane, all axes together.
#[derive(Clone, Debug)]
pub(super) struct Oscillation<const A: usize> {
    axes: [Swing; A],
    /// Recent turns.
    turns: f32,
    /// Mean square of the way from the mean, in squares of the clamps.
    power: f32,
}

impl<const A: usize> Oscillation<A> {
    /// Nothing seen yet: all zeros.
    pub(super) const NONE: Self = Self { axes: [Swing { extreme: 0.0, rising: false, mean: 0.0 }; A], turns: 0.0, power: 0.0 };

    /// Whether the lane swings.
    pub(super) fn present(&self, settings: &GuardSettings) -> bool {
        self.turns > settings.oscillation_turns && self.power > settings.oscillation_power
    }

    /// Takes what the lane asks for at a reference tick.
    pub(super) fn observe(&mut self, lane: &FeedbackLayout<A>, wanted: &[f32; A], settings: &GuardSettings, rate_hz: f32) {
        let recent = ewma_gain(1.0 / (settings.oscillation_s * rate_hz));
        let (mut turns, mut power) = (0.0, 0.0);
        for ((axis, swing), wanted) in lane.axes.iter().zip(&mut self.axes).zip(wanted) {
            if axis.fast_limit <= 0.0 {
                continue;
            }
            let value = wanted / axis.fast_limit;
            // A mean over half the time follows what is slower than an oscillation.
            swing.mean += (value - swing.mean) * ewma_gain(2.0 * recent);
            power += (value - swing.mean) * (value - swing.mean);
            let back = if swing.rising { swing.extreme - value } else { value - swing.extreme };
            if back >= settings.oscillation_swing {
                (swing.extreme, swing.rising) = (value, !swing.rising);
                turns += 1.0;
            } else if back < 0.0 {
                swing.extreme = value;
            }
        }
        self.turns += turns - self.turns * recent;
        self.power += (power - self.power) * recent;
    }
}
