//! One lane's latch: trips at a cause, stays off while it lasts and for the hold time after it.
//!
//! *in* the cause that is present at a reference tick, if any; *out* whether the lane is off; *never* a second trip before the
//! first has ended; *source* a latch with a hold time.

use super::{GuardSettings, Trip};
use crate::math::clamp;

/// State of one lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Watch {
    /// What tripped it, while it is tripped: one more than the trip's index, so that nothing is 0 as the rest of a guard that
    /// has seen nothing.
    cause: u8,
    /// Reference ticks that must pass without a cause.
    remaining: u32,
    /// Trips since it was armed that the lane itself is to blame for.
    strikes: u16,
    /// It stays off until it is armed again.
    locked: bool,
}

impl Watch {
    /// Free to act.
    pub(super) const ARMED: Self = Self { cause: 0, remaining: 0, strikes: 0, locked: false };

    pub(super) fn tripped(&self) -> bool {
        self.cause != 0
    }

    /// Whether it is tripped, and this is why.
    pub(super) fn tripped_by(&self, trip: Trip) -> bool {
        self.cause == code(trip)
    }

    /// Clears what the lane itself was to blame for; a running hold time goes on.
    pub(super) fn unlock(&mut self) {
        (self.strikes, self.locked) = (0, false);
    }

    /// One reference tick with the cause that is present, if any; returns it if it trips the lane now.
    pub(super) fn tick(&mut self, cause: Option<Trip>, hold: u32, settings: &GuardSettings) -> Option<Trip> {
        let Some(trip) = cause else {
            self.remaining = self.remaining.saturating_sub(1);
            if self.remaining == 0 && !self.locked {
                self.cause = 0;
            }
            return None;
        };
        self.remaining = hold.max(1);
        if self.tripped() {
            return None;
        }
        self.cause = code(trip);
        let most = match trip {
            Trip::Saturated => settings.saturated_trips,
            Trip::Counterfactual => settings.counterfactual_trips,
            Trip::Oscillation => settings.oscillation_trips,
            Trip::Astray => settings.astray_trips,
            _ => return Some(trip),
        };
        self.strikes = self.strikes.saturating_add(1);
        self.locked |= self.strikes >= most;
        Some(trip)
    }
}

/// What stands for a trip in a [`Watch`].
fn code(trip: Trip) -> u8 {
    trip.index() as u8 + 1
}

/// Gain of an exponentially weighted moving average (EWMA) in a tick, within 0..=1; NaN counts as 1.
pub(super) fn ewma_gain(share: f32) -> f32 {
    if share >= 0.0 { clamp(share, 0.0, 1.0) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Trips of a lane at a cause that comes and goes for ever.
    fn trips(trip: Trip) -> usize {
        let (mut watch, settings) = (Watch::ARMED, GuardSettings::default());
        (0..1000).filter(|tick| watch.tick((tick % 10 == 0).then_some(trip), 3, &settings).is_some()).count()
    }

    #[test]
    fn what_the_lane_itself_is_to_blame_for_locks_it_out_and_what_comes_from_outside_does_not() {
        let settings = GuardSettings::default();
        for (trip, most) in [
            (Trip::Saturated, settings.saturated_trips),
            (Trip::Counterfactual, settings.counterfactual_trips),
            (Trip::Oscillation, settings.oscillation_trips),
            (Trip::Astray, settings.astray_trips),
        ] {
            assert_eq!(trips(trip), usize::from(most), "{trip:?}");
        }
        for trip in [Trip::NotFinite, Trip::Stale, Trip::Envelope, Trip::Late] {
            assert_eq!(trips(trip), 100, "{trip:?}");
        }
    }

    #[test]
    fn a_lane_is_tripped_by_its_first_cause_until_it_comes_back() {
        let (mut watch, settings) = (Watch::ARMED, GuardSettings::default());
        watch.tick(Some(Trip::Astray), 3, &settings);
        assert_eq!(watch.tick(Some(Trip::Stale), 3, &settings), None);
        assert!(watch.tripped_by(Trip::Astray) && !watch.tripped_by(Trip::Stale));
        for _ in 0..3 {
            watch.tick(None, 3, &settings);
        }
        assert!(!watch.tripped() && !watch.tripped_by(Trip::Astray));
    }
}
