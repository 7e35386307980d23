//! The two lanes, on or off.

use serde::{Deserialize, Serialize};

use crate::math::clamp;

/// Which lanes act.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Lanes {
    /// The network lane.
    pub network: bool,
    /// The feedback lane.
    pub feedback: bool,
}

impl Lanes {
    /// Both lanes.
    pub const BOTH: Self = Self { network: true, feedback: true };
    /// No lane: the loop gets the desired reference, to the bit.
    pub const NONE: Self = Self { network: false, feedback: false };
}

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

    /// The next weight of a lane that is wanted, which the guard allows, and which has something to say, or not.
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
