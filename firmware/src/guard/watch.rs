//! One lane's latch: trips at a cause, stays off while it lasts and for the hold time after it.
//!
//! *in* the cause that is present at a reference tick, if any; *out* whether the lane is off; *never* a second trip before the
//! first has ended; *source* a latch with a hold time.

use super::{GuardSettings, Trip};
use crate::math::clamp;

/// State of one lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Watch {
    tripped: bool,
    /// Reference ticks that must pass without a cause.
    remaining: u32,
    /// Trips since it was armed that the lane itself is to blame for.
    strikes: u16,
    locked: bool,
}

impl Watch {
    /// Free to act.
    pub(super) const ARMED: Self = Self { tripped: false, remaining: 0, strikes: 0, locked: false };

    pub(super) fn tripped(&self) -> bool {
        self.tripped
    }

    /// Clears what the lane itself was to blame for; a running hold time goes on.
    pub(super) fn unlock(&mut self) {
        (self.strikes, self.locked) = (0, false);
    }

    /// One reference tick with the cause that is present, if any; returns it if it trips the lane now.
    pub(super) fn tick(&mut self, cause: Option<Trip>, hold: u32, settings: &GuardSettings) -> Option<Trip> {
        let Some(trip) = cause else {
            self.remaining = self.remaining.saturating_sub(1);
            self.tripped &= self.remaining > 0 || self.locked;
            return None;
        };
        self.remaining = hold.max(1);
        if self.tripped {
            return None;
        }
        self.tripped = true;
        let most = match trip {
            Trip::Counterfactual => settings.counterfactual_trips,
            Trip::Oscillation => settings.oscillation_trips,
            _ => return Some(trip),
        };
        self.strikes = self.strikes.saturating_add(1);
        self.locked = self.strikes >= most;
        Some(trip)
    }
}

/// Gain of an exponentially weighted moving average (EWMA) in a tick, within 0..=1; NaN counts as 1.
pub(super) fn ewma_gain(share: f32) -> f32 {
    if share >= 0.0 { clamp(share, 0.0, 1.0) } else { 1.0 }
}
