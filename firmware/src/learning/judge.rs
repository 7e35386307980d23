//! How much of what is learned may act.
//!
//! *in* the error with the correction, and what the response of the loop says that it would be without; *out* a share of 0..1;
//! *never* a share that jumps up; *source* ours.
//!
//! What was learned of one motion can be wrong for another one, and a loop can become another one. Either way the error grows
//! beyond what it would be without the correction, which the response tells well enough also where it is wrong by a factor of
//! two: of a good correction a tenth of the error is left.

use crate::math::{clamp, sqrt};

/// What is compared is the root mean square over this time, s.
const WINDOW: f32 = 2.0;
/// Ratio, with to without, from which on the share becomes smaller, and at which nothing but [`LEAST`] is left.
const GOOD: f32 = 1.0;
/// See [`GOOD`].
const BAD: f32 = 1.3;
/// What is left of the share, so that it is seen when the correction is good again.
const LEAST: f32 = 0.1;
/// Growth of the share, 1/s; it falls four times as fast.
const GROWTH: f32 = 0.3;
/// Harm is a ratio above this for so long, s: what was learned is then forgotten.
const HARM: f32 = 1.5;
/// See [`HARM`].
const PATIENCE: f32 = 1.0;

/// Compares the error with a correction to the one without.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Judge {
    /// Mean squares.
    with: f32,
    without: f32,
    share: f32,
    /// Ticks of harm.
    harmful: f32,
}

impl Judge {
    /// At rest: what was well stays so.
    pub(super) fn start(&mut self) {
        *self = Self { share: self.share, ..Self::default() };
    }

    /// As [`Judge::start`], with a share that was well before.
    pub(super) fn recall(&mut self, share: f32) {
        *self = Self { share, ..Self::default() };
    }

    /// The share that acts.
    pub(super) fn share(&self) -> f32 {
        self.share
    }

    /// A tick; `floor` is an error that does not matter, `pace` the ticks of a second. `true`: what was learned does harm.
    pub(super) fn tell(&mut self, with: f32, without: f32, floor: f32, pace: f32) -> bool {
        let part = 1.0 / (WINDOW * pace).max(1.0);
        self.with += (with * with - self.with) * part;
        self.without += (without * without - self.without) * part;
        let floor = floor * floor;
        let ratio = sqrt((self.with + 0.25 * floor) / (self.without + floor));
        // Written so that NaN is as bad as can be.
        let goal = if ratio < BAD { clamp((BAD - ratio) / (BAD - GOOD), LEAST, 1.0) } else { LEAST };
        self.share = clamp(self.share + clamp(goal - self.share, -4.0 * GROWTH / pace, GROWTH / pace), 0.0, 1.0);
        self.harmful = if ratio < HARM { 0.0 } else { self.harmful + 1.0 };
        let harm = self.harmful > PATIENCE * pace;
        if harm {
            *self = Self::default();
        }
        harm
    }
}
