//! How lanes come and go: bumpless transfer by a weight that is ramped.
//!
//! *in* which lanes are wanted, allowed and present; *out* the next weight of each; *never* a change of weight above the fade's
//! step, or, of a lane that tripped, the handover's; *source* bumpless transfer of Åström and Hägglund 2006.

use crate::math::clamp;

/// How fast lanes come and go.
pub(super) struct Fade {
    /// Change of weight in a reference tick,
    step: f32,
    /// and of a lane that tripped.
    handover: f32,
}

impl Fade {
    /// Over so many reference ticks, and of a lane that trips at least by this step.
    pub(super) fn new(ticks: u16, handover: f32) -> Self {
        let step = if ticks == 0 { 1.0 } else { 1.0 / f32::from(ticks) };
        Self { step, handover: step.max(handover) }
    }

    /// The next weight of a lane that is wanted, which the guard allows, and which has a correction, or not.
    pub(super) fn next(&self, weight: f32, wanted: bool, allowed: bool, present: bool) -> f32 {
        let change = if allowed && present {
            self.step
        } else if wanted && !allowed {
            -self.handover
        } else {
            -self.step
        };
        clamp(weight + change, 0.0, 1.0)
    }
}
