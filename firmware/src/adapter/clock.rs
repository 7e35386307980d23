//! Which sub-rate tick it is, whatever the number of the reference tick.
//!
//! *in* reference ticks, which may wrap, begin anywhere and have gaps; *out* the phase in the sub-rate tick, and sub-rate ticks
//! counted from the first; *never* another phase because ticks began at another number: the first one that is seen has phase 0;
//! *source* serial number arithmetic (RFC 1982).

/// Counts sub-rate ticks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    /// The reference tick seen last,
    last: i32,
    /// reference ticks since its sub-rate tick,
    phase: i32,
    /// and the number of that one.
    sub_tick: i32,
    running: bool,
}

impl Clock {
    /// Nothing seen yet: all zeros.
    pub(super) const EMPTY: Self = Self { last: 0, phase: 0, sub_tick: 0, running: false };

    /// Goes to a reference tick. Returns whether a sub-rate tick began after the last one seen and before this one, and was
    /// missed.
    pub(super) fn advance(&mut self, tick: i32, divisor: i32) -> bool {
        if !self.running {
            *self = Self { last: tick, phase: 0, sub_tick: 0, running: true };
            return false;
        }
        let since = self.phase.wrapping_add(tick.wrapping_sub(self.last));
        let begun = since.div_euclid(divisor.max(1));
        self.phase = since.rem_euclid(divisor.max(1));
        self.sub_tick = self.sub_tick.wrapping_add(begun);
        self.last = tick;
        begun > i32::from(self.phase == 0) || begun < 0
    }

    /// The reference tick seen last.
    pub(super) fn last(&self) -> Option<i32> {
        self.running.then_some(self.last)
    }

    /// Reference ticks since the sub-rate tick.
    pub(super) fn phase(&self) -> i32 {
        self.phase
    }

    /// Number of the sub-rate tick, from 0.
    pub(super) fn sub_tick(&self) -> i32 {
        self.sub_tick
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_first_tick_may_have_any_number(
            first in any::<i32>(), divisor in 1i32..20, steps in prop::collection::vec(-3i32..40, 0..50)
        ) {
            let (mut here, mut there, mut at) = (Clock::EMPTY, Clock::EMPTY, 0i32);
            for step in steps {
                prop_assert_eq!(here.advance(at, divisor), there.advance(first.wrapping_add(at), divisor));
                prop_assert_eq!((here.phase(), here.sub_tick()), (there.phase(), there.sub_tick()));
                prop_assert_eq!((here.phase(), here.sub_tick()), (at.rem_euclid(divisor), at.div_euclid(divisor)));
                at += step;
            }
        }

        #[test]
        fn a_sub_rate_tick_is_missed_exactly_if_it_was_jumped_over(divisor in 1i32..20, at in 0i32..100, gap in 1i32..100) {
            let mut clock = Clock::EMPTY;
            clock.advance(0, divisor);
            clock.advance(at, divisor);
            let jumped = (at + 1..at + gap).any(|tick| tick % divisor == 0);
            prop_assert_eq!(clock.advance(at + gap, divisor), jumped);
        }
    }
}
