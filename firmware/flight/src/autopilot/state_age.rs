//! How old the vehicle's knowledge of itself is.
//!
//! *in* the sender's ticks of what arrived, and control ticks; *out* when the add-on, and when the motors have to go off; *never*
//! an older state for a newer one.

use crate::settings::Rates;

/// How long the vehicle goes on with what it knows, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timeouts {
    /// Attitude and rates that are older turn the add-on off: it would learn of its own effect too late.
    pub lanes_inertial_s: f32,
    /// The same for position and velocity.
    pub lanes_position_s: f32,
    /// Attitude and rates that are older turn the motors off: the vehicle has turned by half a radian by then.
    pub motors_inertial_s: f32,
    /// The same for position and velocity, without which the attitude is still held.
    pub motors_position_s: f32,
}

impl Default for Timeouts {
    fn default() -> Self {
        Self { lanes_inertial_s: 0.02, lanes_position_s: 0.1, motors_inertial_s: 0.25, motors_position_s: 0.5 }
    }
}

/// One part of the state.
#[derive(Clone, Copy, Debug)]
struct Source {
    /// The sender's tick of the newest.
    stamp: Option<u32>,
    /// Control ticks since it came.
    age: u32,
    lanes: u32,
    motors: u32,
}

impl Source {
    fn new(control_hz: f32, lanes_s: f32, motors_s: f32) -> Self {
        // Saturates; NaN counts as 0.
        Self { stamp: None, age: u32::MAX, lanes: (lanes_s * control_hz) as u32, motors: (motors_s * control_hz) as u32 }
    }

    /// Whether this is newer than the newest.
    fn on_stamp(&mut self, stamp: u32) -> bool {
        // A sender that was silent for long may have started again.
        let fresh = self.age > self.motors;
        let newer = fresh || self.stamp.is_none_or(|newest| stamp.wrapping_sub(newest).wrapping_sub(1) < u32::MAX / 2);
        if newer {
            (self.stamp, self.age) = (Some(stamp), 0);
        }
        newer
    }
}

/// Ages of both parts of the state.
#[derive(Clone, Copy, Debug)]
pub(super) struct StateAge {
    inertial: Source,
    position: Source,
}

impl StateAge {
    /// Before there are settings: all zeros, so that a static with it takes no flash.
    pub(super) const NONE: Self = {
        let source = Source { stamp: None, age: 0, lanes: 0, motors: 0 };
        Self { inertial: source, position: source }
    };

    pub(super) fn new(rates: &Rates) -> Self {
        let timeouts = Timeouts::default();
        let rate = rates.control_hz;
        Self {
            inertial: Source::new(rate, timeouts.lanes_inertial_s, timeouts.motors_inertial_s),
            position: Source::new(rate, timeouts.lanes_position_s, timeouts.motors_position_s),
        }
    }

    /// Attitude and rates came; whether they are newer.
    pub(super) fn inertial(&mut self, stamp: u32) -> bool {
        self.inertial.on_stamp(stamp)
    }

    /// Position and velocity came; whether they are newer.
    pub(super) fn position(&mut self, stamp: u32) -> bool {
        self.position.on_stamp(stamp)
    }

    /// Whether a new attitude came since the last control tick.
    pub(super) fn informed(&self) -> bool {
        self.inertial.age == 0
    }

    /// What came so far is not new any more: the next tick waits for an attitude of its own.
    pub(super) fn seen(&mut self) {
        self.inertial.age = self.inertial.age.max(1);
    }

    /// A control tick passes.
    pub(super) fn tick(&mut self) {
        for source in [&mut self.inertial, &mut self.position] {
            source.age = source.age.saturating_add(1);
        }
    }

    /// Whether the state is too old for the add-on.
    pub(super) fn lanes_off(&self) -> bool {
        self.inertial.age > self.inertial.lanes || self.position.age > self.position.lanes
    }

    /// Whether the state is too old to fly on.
    pub(super) fn motors_off(&self) -> bool {
        self.inertial.age > self.inertial.motors || self.position.age > self.position.motors
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_newer_stamps_count_also_when_they_wrap_or_start_again() {
        let mut source = Source::new(500.0, 0.02, 0.25);
        assert!(source.on_stamp(u32::MAX));
        assert!(!source.on_stamp(u32::MAX) && !source.on_stamp(u32::MAX - 3));
        assert!(source.on_stamp(0) && source.on_stamp(7) && !source.on_stamp(6));
        source.age = 126;
        assert!(source.on_stamp(3), "a sender that starts again");
    }
}
