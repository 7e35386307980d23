//! How much of the feedback part may act, by what swings.
//!
//! *in* the error, and what the feedback part makes of it; *out* a share of 0..1; *never* a judgement on what is slow: a
//! payload or a wind leads to an error that the part is there for; *source* ours, as [`crate::guard`]'s of a stored feedback
//! lane.
//!
//! A good part damps what swings. In a loop that is later than what was learned it drives it, while the error is as small as
//! ever.

use crate::math::{clamp, finite_or_zero, sqrt};

/// What is slower than this, s, does not swing; what is compared is the root mean square over the other time, s.
const SLOW: f32 = 0.1;
const WINDOW: f32 = 0.35;
/// Ratio, with to without, from which on the share becomes smaller, and at which the least is left.
const GOOD: f32 = 0.7;
const BAD: f32 = 0.9;
const LEAST: f32 = 0.3;
/// Ratio from which on the part drives the swing: nothing of it may act.
const HARM: f32 = 1.0;
/// Growth of the share, 1/s, and fall.
const GROWTH: f32 = 0.1;
const FALL: f32 = 4.0;

/// Recent swinging parts: of the error, and of the error without the feedback part.
#[derive(Clone, Debug)]
pub(super) struct Swing {
    means: [f32; 2],
    energies: [f32; 2],
    share: f32,
}

impl Swing {
    /// Nothing seen yet: all may act.
    pub(super) fn new() -> Self {
        Self { means: [0.0; 2], energies: [0.0; 2], share: 1.0 }
    }

    /// At rest: what was well stays so.
    pub(super) fn start(&mut self) {
        *self = Self { share: self.share, ..Self::new() };
    }

    /// As [`Swing::start`], with a share that was well before.
    pub(super) fn recall(&mut self, share: f32) {
        *self = Self { share, ..Self::new() };
    }

    /// The share that may act.
    pub(super) fn share(&self) -> f32 {
        self.share
    }

    /// A tick of `pace` in a second; `fed` is what the loop makes of the feedback part, `floor` a swing that does not matter.
    pub(super) fn tell(&mut self, error: f32, fed: f32, floor: f32, pace: f32) {
        let slow = clamp(1.0 / (SLOW * pace), 0.0, 1.0);
        let recent = clamp(1.0 / (WINDOW * pace), 0.0, 1.0);
        let parts = [error, error - fed];
        for ((value, mean), energy) in parts.into_iter().zip(&mut self.means).zip(&mut self.energies) {
            *mean = finite_or_zero(*mean + (value - *mean) * slow);
            *energy = finite_or_zero(*energy + ((value - *mean) * (value - *mean) - *energy) * recent);
        }
        let [with, without] = self.energies;
        let floor = floor * floor;
        let ratio = sqrt((with + 0.25 * floor) / (without + floor));
        let least = if ratio < HARM { LEAST } else { 0.0 };
        let goal = if ratio < BAD { clamp((BAD - ratio) / (BAD - GOOD), LEAST, 1.0) } else { least };
        self.share = clamp(self.share + clamp(goal - self.share, -FALL / pace, GROWTH / pace), 0.0, 1.0);
    }
}
