//! Network inputs as data: one function evaluates the list in training and in flight.
//!
//! *in* a list of [`Feature`]s and the signals; *out* one f32 for each; *never* a feature that training computes otherwise;
//! *source* Zhou 2017, Insight 2 (state-space and transfer-function features) and Insight 3 (difference learning).
//! The 12-input, 36-input and window sets of the literature are lists of these, not code.

pub use crate::format::{Feature, Relative, Source};

/// Signals as features read them; ticks are reference ticks.
pub trait Signals {
    /// Desired channel at a tick.
    fn desired(&self, tick: i32, channel: usize) -> f32;
    /// Measured channel, newest at or before a tick.
    fn measured(&self, tick: i32, channel: usize) -> f32;
    /// Reference channel that was applied at a tick.
    fn reference(&self, tick: i32, channel: usize) -> f32;

    /// A channel `offset` sub-rate ticks, of `divisor` reference ticks each, after the sub-rate tick at `tick`. Who is asked for
    /// one sub-rate tick only knows where that is in its histories, and need not divide for it.
    #[inline]
    fn at(&self, source: Source, tick: i32, offset: i16, divisor: i32, channel: usize) -> f32 {
        let at = tick.wrapping_add(i32::from(offset).wrapping_mul(divisor));
        match source {
            Source::Desired => self.desired(at, channel),
            Source::Measured => self.measured(at, channel),
            Source::Reference => self.reference(at, channel),
        }
    }
}

impl Feature {
    /// The value of this feature for the sub-rate tick that falls on reference tick `tick`.
    /// `divisor` is the number of reference ticks in a sub-rate tick.
    #[inline]
    pub fn evaluate(&self, signals: &impl Signals, tick: i32, divisor: i32) -> f32 {
        let value = signals.at(self.source, tick, self.offset, divisor, usize::from(self.channel));
        let (source, origin) = match self.relative {
            Relative::Nothing => return value,
            Relative::Desired(origin) => (Source::Desired, origin),
            Relative::Measured(origin) => (Source::Measured, origin),
        };
        value - signals.at(source, tick, 0, divisor, usize::from(origin))
    }
}

/// Evaluates every feature into `out` (as many as both have).
#[inline]
pub fn evaluate(features: &[Feature], signals: &impl Signals, tick: i32, divisor: i32, out: &mut [f32]) {
    for (feature, value) in features.iter().zip(out) {
        *value = feature.evaluate(signals, tick, divisor);
    }
}

/// Desired positions (or any channels) at each offset of a window, relative to now; the present itself is left out
/// of relative windows because it is always zero.
pub fn window(channels: &[u8], offsets: core::ops::RangeInclusive<i16>) -> impl Iterator<Item = Feature> {
    channels.iter().flat_map(move |&channel| {
        offsets.clone().filter(|&offset| offset != 0).map(move |offset| Feature {
            source: Source::Desired,
            channel,
            offset,
            relative: Relative::Desired(channel),
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    struct Ramp {
        shift: f32,
    }

    impl Signals for Ramp {
        fn desired(&self, tick: i32, channel: usize) -> f32 {
            self.shift + tick as f32 * (channel + 1) as f32
        }
        fn measured(&self, tick: i32, _: usize) -> f32 {
            self.shift + tick as f32 * 0.5
        }
        fn reference(&self, tick: i32, _: usize) -> f32 {
            -(tick as f32)
        }
    }

    #[test]
    fn offsets_count_sub_rate_ticks() {
        let feature = Feature { source: Source::Desired, channel: 1, offset: 3, relative: Relative::Nothing };
        assert_eq!(feature.evaluate(&Ramp { shift: 0.0 }, 100, 10), 260.0);
        let past = Feature { source: Source::Reference, channel: 0, offset: -2, relative: Relative::Nothing };
        assert_eq!(past.evaluate(&Ramp { shift: 0.0 }, 100, 10), -80.0);
    }

    proptest! {
        /// Difference learning: a shift of the whole trajectory does not change relative features (Insight 3).
        #[test]
        fn relative_features_are_translation_invariant(shift in -512i32..512, tick in 0i32..1000, offset in -4i16..9) {
            for relative in [Relative::Desired(0), Relative::Measured(0)] {
                let feature = Feature { source: Source::Desired, channel: 0, offset, relative };
                let here = feature.evaluate(&Ramp { shift: 0.0 }, tick, 10);
                let there = feature.evaluate(&Ramp { shift: shift as f32 }, tick, 10);
                prop_assert_eq!(here, there);
            }
        }
    }

    #[test]
    fn windows_leave_out_the_present() {
        let set: heapless::Vec<Feature, 64> = window(&[0, 1], -4..=8).collect();
        assert_eq!(set.len(), 24);
        assert!(set.iter().all(|feature| feature.offset != 0));
    }
}
