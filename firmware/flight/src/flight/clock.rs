//! Reference ticks of control ticks.
//!
//! *in* control ticks, which wrap; *out* the reference tick that each belongs to; *never* a jump where they wrap; *source* serial
//! number arithmetic (RFC 1982).

use core::num::NonZeroU32;

/// Reference ticks of control ticks, which wrap: after 99 days at 500 Hz the next reference tick is still the next one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    /// Control tick seen last,
    control: u32,
    /// control ticks since its reference tick,
    pub(super) phase: u32,
    /// and the number of that one.
    pub(super) reference: i32,
    running: bool,
}

impl Clock {
    /// Nothing seen yet: all zeros.
    pub(super) const EMPTY: Self = Self { control: 0, phase: 0, reference: 0, running: false };

    /// The clock at a control tick. The first one that is seen is as many ticks after reference tick 0 as its number says.
    pub(super) fn at(&self, tick: u32, divisor: NonZeroU32) -> Self {
        if !self.running {
            return Self { control: tick, phase: tick % divisor, reference: (tick / divisor) as i32, running: true };
        }
        let ahead = tick.wrapping_sub(self.control) as i32;
        let divisor = i32::try_from(divisor.get()).unwrap_or(i32::MAX);
        let since = (self.phase as i32).wrapping_add(ahead);
        Self {
            control: tick,
            phase: since.rem_euclid(divisor) as u32,
            reference: self.reference.wrapping_add(since.div_euclid(divisor)),
            running: true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn reference_ticks_go_on_where_control_ticks_wrap(first in any::<u32>(), divisor in 1u32..10, ticks in 1u32..100) {
            let divisor = NonZeroU32::new(divisor).unwrap();
            let mut clock = Clock::EMPTY.at(first, divisor);
            let mut whole = u64::from(first);
            for _ in 0..ticks {
                whole += 1;
                clock = clock.at(whole as u32, divisor);
                let divisor = u64::from(divisor.get());
                prop_assert_eq!(u64::from(clock.phase), whole % divisor);
                prop_assert_eq!(clock.reference, (whole / divisor) as i32);
            }
        }
    }
}
