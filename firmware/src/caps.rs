//! Bounds of the correction that the application sets, whatever a model says.
//!
//! *in* the largest correction of each reference channel and its largest rate of change, and of weighted sums of channels; *out*
//! the correction within them; *never* a bound taken from data: a model's own limits only make it smaller; *source* the vehicle
//! or machine before which the add-on stands.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::{
    format::{DEFAULT_AXES, Refusal},
    math::{abs, clamp},
};

/// Bound of one reference channel's correction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(deny_unknown_fields)]
pub struct Cap {
    /// Largest absolute correction, in the channel's unit. 0: the channel is not corrected.
    pub limit: f32,
    /// Largest rate of change of the correction, in the channel's unit a second.
    pub rate: f32,
}

/// Bound of two channels together: of `first.1` times the correction of channel `first.0`, plus the same of the second.
///
/// A position loop turns corrections of its position and velocity references into an acceleration, kp·Δp + kd·Δv, and no vehicle
/// follows one beyond its thrust. A correction beyond the bound is scaled down, both parts alike.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(deny_unknown_fields)]
pub struct SumCap {
    /// Reference channel and its weight.
    pub first: (u8, f32),
    /// Reference channel and its weight.
    pub second: (u8, f32),
    /// Largest absolute sum, in the unit that the weights lead to.
    pub limit: f32,
}

impl SumCap {
    /// Share of a correction that this bound lets pass.
    fn share(&self, values: &[f32]) -> f32 {
        let part = |(channel, weight): (u8, f32)| values.get(usize::from(channel)).copied().unwrap_or(0.0) * weight;
        let sum = abs(part(self.first) + part(self.second));
        // Written so that NaN lets nothing pass.
        if sum <= self.limit {
            1.0
        } else if sum > self.limit {
            self.limit / sum
        } else {
            0.0
        }
    }
}

/// Bounds of the correction, given when a model is put before a loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Caps<'a> {
    /// Of each reference channel, in the order of the application's signals.
    pub channels: &'a [Cap],
    /// Of channels together; none is allowed.
    pub sums: &'a [SumCap],
}

/// The bounds as the adapter keeps them.
#[derive(Clone, Debug)]
pub(crate) struct Bounds<const R: usize, const A: usize = DEFAULT_AXES> {
    /// Largest absolute correction of each channel, and largest change of it in a reference tick.
    channels: [(f32, f32); R],
    sums: Vec<SumCap, A>,
}

impl<const R: usize, const A: usize> Bounds<R, A> {
    /// Nothing is corrected: all zeros.
    pub(crate) const EMPTY: Self = Self { channels: [(0.0, 0.0); R], sums: Vec::new() };

    /// Whether these are bounds of a loop with so many reference channels.
    ///
    /// # Errors
    /// If there are more or fewer channels, too many sums, or a number is negative, infinite or NaN.
    pub(crate) fn check(caps: &Caps<'_>, reference: usize) -> Result<(), Refusal> {
        let sane = |value: f32| (0.0..f32::MAX).contains(&value);
        let bad = |what| Err(Refusal::Cap { what });
        if caps.channels.len() != reference {
            return bad("number of channels");
        }
        if !caps.channels.iter().all(|cap| sane(cap.limit) && sane(cap.rate)) {
            return bad("limit or rate of a channel");
        }
        if caps.sums.len() > A {
            return bad("number of sums");
        }
        for sum in caps.sums {
            let parts = [sum.first, sum.second];
            if !sane(sum.limit) || !parts.iter().all(|(channel, weight)| usize::from(*channel) < reference && weight.is_finite())
            {
                return bad("channel, weight or limit of a sum");
            }
        }
        Ok(())
    }

    /// Takes checked bounds of a loop with this many reference ticks in a second.
    pub(crate) fn load(&mut self, caps: &Caps<'_>, rate_hz: f32) {
        for (index, place) in self.channels.iter_mut().enumerate() {
            let Cap { limit, rate } = caps.channels.get(index).copied().unwrap_or(Cap { limit: 0.0, rate: 0.0 });
            *place = (limit, if rate_hz > 0.0 { rate / rate_hz } else { 0.0 });
        }
        self.sums.clear();
        for sum in caps.sums {
            let _ = self.sums.push(*sum);
        }
    }

    /// Largest absolute correction of a channel, and largest change of it in a reference tick.
    #[inline]
    pub(crate) fn channel(&self, channel: usize) -> (f32, f32) {
        self.channels.get(channel).copied().unwrap_or((0.0, 0.0))
    }

    /// Bounds the sums of a correction that is within its limits, on its way from the `last` one, which is within all of them.
    /// Never a larger change of a channel than was asked for: the way from one correction that is allowed to another one is
    /// allowed as a whole.
    pub(crate) fn bound_sums(&self, last: &[f32; R], values: &mut [f32; R], slews: &[f32; R]) {
        for sum in &self.sums {
            let share = sum.share(values);
            if share >= 1.0 {
                continue;
            }
            let channels = [sum.first.0, sum.second.0].map(usize::from);
            let mut way = 1.0f32;
            for channel in channels {
                let (Some(last), Some(value), Some(slew)) = (last.get(channel), values.get_mut(channel), slews.get(channel))
                else {
                    continue;
                };
                *value = clamp(*value * share, -f32::MAX, f32::MAX);
                let change = abs(*value - *last);
                if change > *slew {
                    way = way.min(*slew / change);
                }
            }
            for channel in channels {
                if let (Some(last), Some(value)) = (last.get(channel), values.get_mut(channel)) {
                    *value = *last + (*value - *last) * way;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const CAP: Cap = Cap { limit: 0.5, rate: 5.0 };
    const SUM: SumCap = SumCap { first: (0, 6.5), second: (1, 4.0), limit: 3.0 };

    #[test]
    fn bounds_that_say_nothing_are_refused() {
        let whole = Caps { channels: &[CAP, CAP], sums: &[SUM] };
        assert_eq!(Bounds::<2>::check(&whole, 2), Ok(()));
        let refused = [
            Caps { channels: &[], ..whole },
            Caps { channels: &[CAP], ..whole },
            Caps { channels: &[CAP, Cap { limit: f32::NAN, ..CAP }], ..whole },
            Caps { channels: &[CAP, Cap { rate: f32::INFINITY, ..CAP }], ..whole },
            Caps { channels: &[CAP, Cap { limit: -1.0, ..CAP }], ..whole },
            Caps { sums: &[SumCap { limit: f32::NAN, ..SUM }], ..whole },
            Caps { sums: &[SumCap { first: (2, 1.0), ..SUM }], ..whole },
            Caps { sums: &[SUM; DEFAULT_AXES + 1], ..whole },
        ];
        for caps in refused {
            assert!(matches!(Bounds::<2>::check(&caps, 2), Err(Refusal::Cap { .. })), "{caps:?}");
        }
    }

    proptest! {
        /// From one allowed correction to the next: within the sum's bound, no channel faster than its slew.
        #[test]
        fn a_sum_keeps_its_bound_and_no_channel_goes_faster(
            targets in prop::collection::vec((-0.5f32..0.5, -0.5f32..0.5), 1..40), slew in 0.01f32..0.2
        ) {
            let mut bounds = Bounds::<2>::EMPTY;
            bounds.load(&Caps { channels: &[CAP, CAP], sums: &[SUM] }, 100.0);
            let mut last = [0.0f32; 2];
            for (x, v) in targets {
                let mut values = [x, v];
                for (value, last) in values.iter_mut().zip(last) {
                    *value = value.clamp(last - slew, last + slew);
                }
                bounds.bound_sums(&last, &mut values, &[slew; 2]);
                let sum = 6.5 * values[0] + 4.0 * values[1];
                prop_assert!(sum.abs() <= 3.0 * 1.000_01, "{sum}");
                for (value, last) in values.iter().zip(last) {
                    prop_assert!((value - last).abs() <= slew * 1.000_01);
                }
                last = values;
            }
        }
    }
}
