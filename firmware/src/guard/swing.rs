//! Whether the loop swings, and the feedback lane does nothing against it.
//!
//! *in* at every monitor tick, of each axis: the error, what of it the lane leads to, and what the loop's nominal response to the
//! desired trajectory leads to; *out* the share of the lane that may act, and whether it leaves the loop astray; *never* a
//! judgement on what is slow: a payload or a steady wind leads to an error that the lane is there for; *source* ours: settings
//! and times were measured in flights with 0 to 90 ms more delay than the model knows.
//!
//! A lane that damps takes away most of the swinging part of the error. In a loop with more delay than the model knows, what it
//! asks for comes too late, and the swinging part is nearly as large as without the lane, or larger: that shows while it is no
//! larger than the error of a good flight. What there would be without the lane rests on the loop's response, which is then late
//! too: so it is taken from two loops, the nominal one and one that is [`LATER`] monitor ticks later, whichever leaves less.
//!
//! The lane's share shrinks first, which alone may calm the loop, whoever drives it; a lane that does is handed over, until the
//! loop has settled.

use super::{GuardSettings, watch::ewma_gain};
use crate::math::{clamp, finite_or_zero};

/// Recent share of the network lane from which on, and at which, it is relied on.
const RELIED: [f32; 2] = [0.7, 0.9];

/// Monitor ticks by which the response may be later than the model knows.
pub(super) const LATER: usize = 2;

/// Numbers of one axis, or energies of all: of the error, of the error without the feedback lane, of what the loop makes of that
/// lane's part of the correction, of the error that the nominal response to the desired trajectory alone leads to, and of the
/// error without the feedback lane in a loop that is [`LATER`].
pub(super) type Parts = [f32; 5];

/// Place of the last one but one.
const NOMINAL: usize = 3;

/// Recent swinging parts.
#[derive(Clone, Debug)]
pub(super) struct Swing<const A: usize> {
    /// Recent means of each axis: what is slower than a swing.
    means: [Parts; A],
    /// Recent mean squares of what is left, all axes added.
    energies: Parts,
    /// Recent share of the network lane.
    reliance: f32,
    /// Share of the feedback lane that may act.
    share: f32,
    /// What swings is more than it may be,
    swinging: bool,
    /// and the feedback lane does nothing against it, or is its cause.
    astray: bool,
    /// It is no more than it may be where the network acts in full.
    settled: bool,
    /// The feedback lane acts.
    active: bool,
}

impl<const A: usize> Swing<A> {
    /// Nothing seen yet: all zeros.
    pub(super) const NONE: Self = Self {
        means: [[0.0; 5]; A],
        energies: [0.0; 5],
        reliance: 0.0,
        share: 0.0,
        swinging: false,
        astray: false,
        settled: false,
        active: false,
    };

    /// Share of the feedback lane that may act, 0..=1.
    pub(super) fn share(&self) -> f32 {
        self.share
    }

    /// Whether what swings is more than it may be after what is desired, whoever is to blame.
    pub(super) fn swinging(&self) -> bool {
        self.swinging
    }

    /// Whether what swings is no more than it may be where the network acts in full.
    pub(super) fn settled(&self) -> bool {
        self.settled
    }

    /// Whether the feedback lane leaves the loop astray.
    pub(super) fn astray(&self) -> bool {
        self.astray
    }

    /// A reference tick of this length, s, in which the network lane has this share, 0..=1, and the feedback lane acts or not.
    pub(super) fn rely(&mut self, network: f32, active: bool, settings: &GuardSettings, seconds: f32) {
        self.active = active;
        self.reliance += (network - self.reliance) * ewma_gain(seconds / settings.relied_s);
        // Where less of it acts now, nothing is known of what it leaves.
        if network < self.reliance {
            self.reliance = network;
        }
    }

    /// Adds to `swung` the squares of what swings of an axis in a monitor tick of this length, s.
    // Axis by axis, as the numbers of all would be the control task's deepest stack.
    pub(super) fn add(&mut self, axis: usize, parts: &Parts, settings: &GuardSettings, seconds: f32, swung: &mut Parts) {
        let slow = ewma_gain(seconds / settings.swing_s);
        let Some(means) = self.means.get_mut(axis) else { return };
        for ((mean, value), square) in means.iter_mut().zip(parts).zip(swung) {
            *mean = finite_or_zero(*mean + (value - *mean) * slow);
            *square += (value - *mean) * (value - *mean);
        }
    }

    /// Ends a monitor tick of this length, s, in which this swung, all axes added.
    #[inline(never)]
    pub(super) fn observe(&mut self, swung: &Parts, validated_rms: f32, settings: &GuardSettings, seconds: f32) {
        let recent = ewma_gain(seconds / settings.astray_s);
        for (part, (energy, &now)) in self.energies.iter_mut().zip(swung).enumerate() {
            // Slower down than up: the loop may be later than nominal.
            let gain = if part == NOMINAL && now < *energy { 0.5 * recent } else { recent };
            *energy = finite_or_zero(*energy + (now - *energy) * gain);
        }
        self.judge(validated_rms, settings, seconds);
    }

    fn judge(&mut self, validated_rms: f32, settings: &GuardSettings, seconds: f32) {
        let square = |value: f32| value * value;
        let [with, nominally, response, nominal, later] = self.energies;
        let without = if later < nominally { later } else { nominally };
        let relied = clamp((self.reliance - RELIED[0]) / (RELIED[1] - RELIED[0]), 0.0, 1.0);
        let factor = settings.astray_factor + (settings.astray_share - settings.astray_factor) * relied;
        let floor = square(settings.astray_floor * validated_rms);
        let allowed = square(factor) * nominal + floor;
        let excess = with - square(settings.astray_left) * without;
        // A lane that has hardly any part in what swings does not drive it.
        let caused = response > square(settings.astray_cause) * with;
        self.swinging = with > allowed;
        self.settled = with <= square(settings.astray_share) * nominal + floor;
        self.astray = caused && excess > square(settings.astray_trip) * allowed;
        let onset = square(settings.swing_onset);
        let most = clamp((allowed - excess) / ((1.0 - onset) * allowed), 0.0, 1.0);
        // A lane that comes back begins anew.
        let grown = if self.active { self.share + seconds / settings.swing_recovery_s } else { 0.0 };
        let grown = clamp(grown, settings.swing_start, 1.0);
        self.share = if grown < most { grown } else { most };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const RMS: f32 = 0.006;
    const TICK: f32 = 0.05;

    /// After ten seconds of these parts of one axis.
    fn after(parts: impl Fn(f32) -> Parts, network: f32) -> Swing<1> {
        let (mut swing, settings) = (Swing::NONE, GuardSettings::default());
        for tick in 0..200 {
            swing.rely(network, true, &settings, TICK);
            let mut swung = [0.0; 5];
            swing.add(0, &parts(tick as f32 * TICK), &settings, TICK, &mut swung);
            swing.observe(&swung, RMS, &settings, TICK);
        }
        swing
    }

    /// An error that swings 1.7 times a second, of which the lane would leave this share.
    fn swings(amplitude: f32, left: f32) -> impl Fn(f32) -> Parts {
        move |t| {
            let with = amplitude * libm::sinf(10.7 * t);
            [with, with / left, with - with / left, 0.0, with / left]
        }
    }

    #[test]
    fn a_lane_that_leaves_as_much_as_there_was_is_handed_over() {
        // Its response is as large as what it should take away, but comes too late.
        let late = |amplitude| {
            after(
                move |t| {
                    let with = amplitude * libm::sinf(10.7 * t);
                    [with, 1.1 * with, amplitude * libm::cosf(10.7 * t), 0.0, 1.1 * with]
                },
                1.0,
            )
        };
        assert!(late(0.04).astray() && late(0.04).share() == 0.0);
        let small = late(0.001);
        assert!(!small.astray() && small.share() == 1.0, "{small:?}");
        let between = late(0.016);
        assert!(!between.astray() && between.share() > 0.0 && between.share() < 1.0, "{between:?}");
    }

    #[test]
    fn a_lane_that_damps_may_act_however_much_swings() {
        for amplitude in [0.001, 0.02, 0.2] {
            let swing = after(swings(amplitude, 0.5), 1.0);
            assert!(!swing.astray() && swing.share() == 1.0, "{amplitude}: {swing:?}");
        }
    }

    #[test]
    fn what_is_slow_is_no_swing() {
        let payload = |t: f32| [0.1 * t.min(1.0), 0.1 * t.min(1.0), 0.05, 0.0, 0.1 * t.min(1.0)];
        let swing = after(payload, 1.0);
        assert!(!swing.astray() && !swing.swinging() && swing.share() == 1.0, "{swing:?}");
    }

    #[test]
    fn what_the_desired_trajectory_leads_to_is_allowed_and_less_of_it_where_the_network_acts() {
        let follows = |t: f32| {
            let with = 0.05 * libm::sinf(10.7 * t);
            [with, with, with, 1.5 * with, with]
        };
        assert!(after(follows, 0.0).share() == 1.0 && !after(follows, 0.0).astray());
        assert!(after(follows, 1.0).share() == 0.0);
    }

    #[test]
    fn a_lane_that_damps_only_if_the_loop_is_not_late_does_not_damp() {
        let believed = |t: f32| {
            let with = 0.04 * libm::sinf(10.7 * t);
            [with, 2.0 * with, with, 0.0, 0.5 * with]
        };
        assert!(after(believed, 1.0).astray() && after(believed, 1.0).share() == 0.0);
    }

    #[test]
    fn in_a_loop_that_swings_by_itself_nothing_of_the_lane_acts_and_it_trips_not() {
        let by_itself = |t: f32| {
            let with = 0.04 * libm::sinf(10.7 * t);
            [with, with, 0.1 * with, 0.0, with]
        };
        let swing = after(by_itself, 1.0);
        assert!(swing.share() == 0.0 && !swing.astray() && !swing.settled(), "{swing:?}");
    }

    #[test]
    fn a_lane_that_comes_back_begins_with_less() {
        let (mut swing, settings) = (after(|_| [0.0; 5], 1.0), GuardSettings::default());
        assert_eq!(swing.share(), 1.0);
        swing.rely(1.0, false, &settings, TICK);
        swing.observe(&[0.0; 5], RMS, &settings, TICK);
        assert_eq!(swing.share(), settings.swing_start);
    }

    proptest! {
        #[test]
        fn it_is_a_share_whatever_comes_in(
            values in prop::collection::vec(any::<Parts>(), 1..20), rms in any::<f32>(), network in any::<f32>()
        ) {
            let (mut swing, settings) = (Swing::<4>::NONE, GuardSettings::default());
            for parts in values {
                swing.rely(network, true, &settings, TICK);
                let mut swung = [0.0; 5];
                (0..4).for_each(|axis| swing.add(axis, &parts, &settings, TICK, &mut swung));
                swing.observe(&swung, rms, &settings, TICK);
                prop_assert!((0.0..=1.0).contains(&swing.share()), "{}", swing.share());
            }
        }
    }
}
