//! Several modules for several operating regions: which one acts, and how one hands over to the next.
//!
//! *in* one measured channel or feature at every reference tick, and what each module wants; *out* a share for each module, and
//! their mean; *never* a share that changes by more than one over the fade time in a tick, two changes of region closer together
//! in the channel than the hysteresis, nor another region for NaN; *source* Zhou 2017, section III-A: relative degrees are local,
//! "having multiple DNN modules for different operating regions may be required". The paper says neither when nor how to switch:
//! that is ours.
//!
//! Each module is an [`Adapter`](crate::adapter::Adapter) (or a network) of its own, trained on logs of its region and a fade's
//! width around it. All adapters are stepped at every tick, so that each has its history when its turn comes; their references
//! are mixed:
//!
//! ```
//! use impromptu_firmware::region::Selector;
//! // Below 1.0 the first module, from there on the second; changed over at 0.9 downwards and at 1.1 upwards, in 20 ticks.
//! let mut selector = Selector::new([f32::NEG_INFINITY, 1.0], 0.1, 20).unwrap();
//! # let (first, second) = ([0.3_f32], [0.5_f32]);
//! // let (first, second) = (low.step(tick, …), high.step(tick, …));
//! let reference = selector.step(1.05, &[first, second]);
//! # assert_eq!(reference, [0.5]);
//! ```

use crate::math::clamp;

/// Why regions are refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum RegionError {
    /// No region at all.
    Empty,
    /// A region does not start above the one before it.
    Order {
        /// The later one of the two.
        region: usize,
    },
    /// A hysteresis that is negative or NaN, or wider than half of a region.
    Hysteresis,
}

impl core::fmt::Display for RegionError {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Empty => formatter.write_str("there is no region; name at least one"),
            Self::Order { region } => {
                write!(formatter, "region {region} does not start above the one before it; sort the starts")
            }
            Self::Hysteresis => {
                formatter.write_str("the hysteresis must be zero or more and at most half of the narrowest region")
            }
        }
    }
}

impl core::error::Error for RegionError {}

/// Chooses among `N` modules.
#[derive(Clone, Debug, PartialEq)]
pub struct Selector<const N: usize> {
    starts: [f32; N],
    hysteresis: f32,
    /// Change of a share in a tick.
    step: f32,
    /// `None` until the first number.
    active: Option<usize>,
    shares: [f32; N],
    switches: u32,
}

impl<const N: usize> Selector<N> {
    /// Regions by the value from which each holds, rising; the first one holds below as well. A region is left when the channel
    /// is `hysteresis` (in its unit) beyond its border, and the modules then change over in `fade_ticks` reference ticks, 0 or 1
    /// for at once.
    ///
    /// # Errors
    /// If starts do not rise or the hysteresis does not fit into the regions.
    pub fn new(starts: [f32; N], hysteresis: f32, fade_ticks: u16) -> Result<Self, RegionError> {
        if N == 0 {
            return Err(RegionError::Empty);
        }
        // The first start is no border.
        let borders = || starts.iter().skip(1);
        for (region, (lower, upper)) in borders().zip(borders().skip(1)).enumerate() {
            let rising = lower < upper;
            if !rising {
                return Err(RegionError::Order { region: region + 2 });
            }
            if hysteresis > 0.5 * (upper - lower) {
                return Err(RegionError::Hysteresis);
            }
        }
        if let Some((region, _)) = starts.iter().enumerate().skip(1).find(|(_, start)| !start.is_finite()) {
            return Err(RegionError::Order { region });
        }
        if !(hysteresis >= 0.0 && hysteresis.is_finite()) {
            return Err(RegionError::Hysteresis);
        }
        let step = 1.0 / f32::from(fade_ticks.max(1));
        Ok(Self { starts, hysteresis, step, active: None, shares: [0.0; N], switches: 0 })
    }

    /// One reference tick: the regions' shares for the channel's value, then what the modules want, mixed.
    ///
    /// While one module acts alone, its numbers come out bit by bit, whatever the others say.
    pub fn step<const R: usize>(&mut self, channel: f32, wanted: &[[f32; R]; N]) -> [f32; R] {
        self.select(channel);
        self.mix(wanted)
    }

    /// Takes the channel's value of this reference tick. The first number decides at once; NaN changes nothing but the fade.
    pub fn select(&mut self, channel: f32) {
        if !channel.is_nan() {
            match self.active {
                None => {
                    let region = self.region_of(channel);
                    self.active = Some(region);
                    self.shares = core::array::from_fn(|index| if index == region { 1.0 } else { 0.0 });
                }
                Some(active) if self.left(active, channel) => {
                    self.active = Some(self.region_of(channel));
                    self.switches = self.switches.saturating_add(1);
                }
                Some(_) => {}
            }
        }
        self.fade();
    }

    /// What the modules want, mixed by their shares. All zero before the first number. While several have a share, what one of
    /// them wants and is no finite number leaves its share to the others.
    pub fn mix<const R: usize>(&self, wanted: &[[f32; R]; N]) -> [f32; R] {
        let (mut sum, mut left) = ([0.0; R], [0.0_f32; R]);
        for (share, wanted) in self.shares.iter().zip(wanted) {
            if *share == 1.0 {
                return *wanted;
            }
            if *share > 0.0 {
                for ((sum, left), wanted) in sum.iter_mut().zip(&mut left).zip(wanted) {
                    if wanted.is_finite() {
                        *sum += share * wanted;
                    } else {
                        *left += share;
                    }
                }
            }
        }
        for (sum, left) in sum.iter_mut().zip(left) {
            if left > 0.0 {
                *sum = if left < 0.999 { *sum / (1.0 - left) } else { 0.0 };
            }
        }
        sum
    }

    /// Each module's share, 0..=1; they add up to 1. A module without a share need not be evaluated.
    pub fn shares(&self) -> &[f32; N] {
        &self.shares
    }

    /// The region that acts or is being faded in.
    pub fn active(&self) -> Option<usize> {
        self.active
    }

    /// Changes of region since the start.
    pub fn switches(&self) -> u32 {
        self.switches
    }

    fn region_of(&self, channel: f32) -> usize {
        self.starts.iter().skip(1).take_while(|start| channel >= **start).count()
    }

    fn left(&self, active: usize, channel: f32) -> bool {
        let below = active > 0 && self.starts.get(active).is_some_and(|start| channel < start - self.hysteresis);
        let above = self.starts.get(active.saturating_add(1)).is_some_and(|next| channel >= next + self.hysteresis);
        below || above
    }

    /// The active module gains, the others lose in proportion.
    fn fade(&mut self) {
        let Some(active) = self.active else { return };
        let Some(share) = self.shares.get(active).copied() else { return };
        let gained = clamp(share + self.step, 0.0, 1.0);
        // The last step ends at one exactly, not within rounding of it.
        let gained = if gained > 1.0 - 1e-6 { 1.0 } else { gained };
        let kept = if share < 1.0 { (1.0 - gained) / (1.0 - share) } else { 0.0 };
        for (index, share) in self.shares.iter_mut().enumerate() {
            *share = if index == active { gained } else { *share * kept };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn what_is_no_number_leaves_its_share_to_the_other() {
        let mut selector = two(0.0, 4);
        selector.select(0.0);
        selector.select(1.0);
        let [first, second] = *selector.shares();
        assert!(first > 0.0 && second > 0.0);
        for wrong in [f32::NAN, f32::INFINITY] {
            let [mixed, plain] = selector.mix(&[[wrong, 1.0], [2.0, 3.0]]);
            assert!((mixed - 2.0).abs() < 1e-6 && (1.0..3.0).contains(&plain), "{mixed} {plain}");
            assert_eq!(selector.mix(&[[wrong], [wrong]]), [0.0]);
        }
    }

    fn two(hysteresis: f32, fade_ticks: u16) -> Selector<2> {
        Selector::new([0.0, 1.0], hysteresis, fade_ticks).unwrap()
    }

    #[test]
    fn regions_that_do_not_rise_and_a_hysteresis_wider_than_them_are_refused() {
        assert_eq!(Selector::<0>::new([], 0.0, 1), Err(RegionError::Empty));
        assert_eq!(Selector::new([0.0, 1.0, 1.0], 0.0, 1), Err(RegionError::Order { region: 2 }));
        assert_eq!(Selector::new([0.0, f32::NAN], 0.0, 1), Err(RegionError::Order { region: 1 }));
        assert_eq!(Selector::new([0.0, 1.0, 2.0], 0.6, 1), Err(RegionError::Hysteresis));
        assert_eq!(Selector::new([0.0, 1.0], f32::NAN, 1), Err(RegionError::Hysteresis));
        assert!(Selector::new([f32::NEG_INFINITY, 1.0, 2.0], 0.5, 0).is_ok());
    }

    #[test]
    fn a_change_over_takes_the_stated_ticks_within_one_and_ends_at_one_exactly() {
        for ticks in [1, 3, 7, 49, 1000] {
            let mut selector = two(0.1, ticks);
            selector.select(0.0);
            assert_eq!(selector.shares(), &[1.0, 0.0]);
            for _ in 1..ticks {
                selector.select(2.0);
                assert!(selector.shares()[1] < 1.0);
            }
            // Rounding of many small steps may leave a last one.
            selector.select(2.0);
            assert!(selector.shares()[1] > 1.0 - 1e-4);
            selector.select(2.0);
            assert_eq!(selector.shares(), &[0.0, 1.0]);
        }
    }

    #[test]
    fn nothing_is_wanted_before_the_first_number_and_nan_keeps_the_region() {
        let mut selector = two(0.1, 4);
        assert_eq!(selector.step(f32::NAN, &[[5.0], [6.0]]), [0.0]);
        assert_eq!(selector.step(3.0, &[[5.0], [6.0]]), [6.0]);
        for _ in 0..9 {
            assert_eq!(selector.step(f32::NAN, &[[5.0], [6.0]]), [6.0]);
        }
        assert_eq!((selector.active(), selector.switches()), (Some(1), 0));
    }

    proptest! {
        #[test]
        fn no_step_is_larger_than_the_fade_allows_and_shares_add_up_to_one(
            channel in proptest::collection::vec(-1.0..4.0f32, 1..200), fade in 0..40u16, hysteresis in 0.0..0.5f32,
            wanted in proptest::array::uniform3(-9.0..9.0f32)
        ) {
            let mut selector = Selector::new([f32::NEG_INFINITY, 1.0, 2.0], hysteresis, fade).unwrap();
            let modules = wanted.map(|value| [value]);
            let spread = wanted.iter().fold(f32::MIN, |a, b| a.max(*b)) - wanted.iter().fold(f32::MAX, |a, b| a.min(*b));
            let mut last = None;
            for value in channel {
                let [mixed] = selector.step(value, &modules);
                prop_assert!((selector.shares().iter().sum::<f32>() - 1.0).abs() < 1e-5);
                prop_assert!(selector.shares().iter().all(|share| (0.0..=1.0).contains(share)));
                let bound = spread / f32::from(fade.max(1)) + 1e-4;
                prop_assert!(last.is_none_or(|last: f32| (mixed - last).abs() <= bound));
                last = Some(mixed);
            }
        }

        #[test]
        fn the_channel_travels_at_least_the_hysteresis_between_two_changes(
            channel in proptest::collection::vec(0.5..2.5f32, 1..300), hysteresis in 0.01..0.5f32
        ) {
            let mut selector = Selector::new([f32::NEG_INFINITY, 1.0, 2.0], hysteresis, 10).unwrap();
            let (mut changed_at, mut switches) = (None, 0);
            for value in channel {
                selector.select(value);
                if selector.switches() > switches {
                    switches = selector.switches();
                    prop_assert!(changed_at.is_none_or(|last: f32| (value - last).abs() >= hysteresis * 0.999));
                    changed_at = Some(value);
                }
            }
        }

        #[test]
        fn noise_below_the_hysteresis_never_changes_the_region(noise in proptest::collection::vec(-0.099..0.099f32, 1..200)) {
            let mut selector = two(0.1, 5);
            for value in &noise {
                selector.select(1.0 + value);
            }
            prop_assert_eq!(selector.switches(), 0);
        }

        #[test]
        fn far_inside_a_region_its_module_comes_out_bit_by_bit(
            wanted in proptest::array::uniform4(-1e3..1e3f32),
            channel in proptest::collection::vec(1.5..9.0f32, 1..50), start in -3.0..3.0f32
        ) {
            let mut selector = two(0.1, 8);
            selector.select(start);
            let other = [f32::NAN, f32::INFINITY];
            for (tick, value) in channel.iter().enumerate() {
                selector.select(*value);
                if tick > 8 {
                    let mixed = selector.mix(&[[other[0], other[1], 0.0, 1.0], wanted]);
                    prop_assert_eq!(mixed.map(f32::to_bits), wanted.map(f32::to_bits));
                }
            }
        }
    }
}
