//! What the window of the desired trajectory asks for, against what training saw.
//!
//! *in* the network lane's features, and the smallest and largest of each in training; *out* the share of the network's
//! correction that may act, before it acts; *never* a look at a single value: a step is inside of every box of values long
//! before it is reached; *source* the statistics of a trajectory are the same at every time, so what a window moved by from one
//! offset to the next is bounded by what training moved by from the present to the next.

use crate::{
    format::{Card, Feature, Floats, Relative, Source},
    guard::GuardSettings,
    math::{abs, clamp},
    preview::Preview,
};

/// Sub-rate ticks over which a window may move by the guard's floor in addition.
const CLOSE: f32 = 5.0;
/// From this many times what is allowed on, nothing of the network's correction is left.
const NOTHING_LEFT: f32 = 1.5;

/// A channel jumps that moves from one reference tick to the next by this many times what a window may move by in the mean.
const JUMP: f32 = 3.0;

/// Ticks that are looked at in a sub-rate tick at most, beside those that are new. A lane that begins has faded in when all of
/// its window has been seen; after a new plan what is near is seen first.
const CATCH_UP: i32 = 8;

/// Where the desired trajectory jumps from one reference tick to the next. Between two offsets of a window that is a motion like
/// others, only a fast one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Jumps {
    /// Channels that features look along, a bit for each.
    channels: u32,
    /// The newest tick at which one jumps,
    newest: Option<i32>,
    /// and the last one that was looked at.
    seen: Option<i32>,
}

impl Jumps {
    /// Nothing seen yet: all zeros.
    pub(super) const NONE: Self = Self { channels: 0, newest: None, seen: None };

    /// Nothing seen yet of the channels that these features look along.
    pub(super) fn of(features: &[Feature]) -> Self {
        let channels = features.iter().filter(|feature| along(feature)).map(|feature| 1u32 << (feature.channel & 31));
        Self { channels: channels.fold(0, |all, channel| all | channel), ..Self::NONE }
    }

    /// Nothing seen yet.
    pub(super) fn clear(&mut self) {
        (self.newest, self.seen) = (None, None);
    }

    /// What is desired at this tick and later has been replaced.
    pub(super) fn forget(&mut self, from: i32) {
        let before = |tick: &i32| tick.wrapping_sub(from) < 0;
        self.newest = self.newest.filter(before);
        self.seen = self.seen.map(|seen| if before(&seen) { seen } else { from.wrapping_sub(1) });
    }

    /// Whether there is a jump at one of the ticks `first..=last`; `paces` as for [`share`], for sub-rate ticks of `divisor`
    /// reference ticks.
    #[inline(never)]
    pub(super) fn within<const D: usize, const N: usize>(
        &mut self,
        (first, last): (i32, i32),
        preview: &Preview<D, N>,
        paces: &[f32; D],
        divisor: i32,
    ) -> bool {
        let seen = self.seen.filter(|seen| seen.wrapping_sub(first) >= 0 && last.wrapping_sub(*seen) >= 0);
        let from = seen.unwrap_or(first);
        let ticks = last.wrapping_sub(from).min(divisor.saturating_add(CATCH_UP)).max(0);
        // Channel by channel, as two whole samples would be the control task's deepest stack.
        let mut jump = 0;
        for (channel, pace) in paces.iter().enumerate().filter(|(channel, _)| self.channels >> (channel & 31) & 1 == 1) {
            let mut before = preview.channel(from, channel);
            for step in 1..=ticks {
                let now = preview.channel(from.wrapping_add(step), channel);
                let moved = abs(now - before) * pace * divisor as f32;
                if moved > JUMP || moved.is_nan() {
                    jump = jump.max(step);
                }
                before = now;
            }
        }
        if jump > 0 {
            self.newest = Some(from.wrapping_add(jump));
        }
        self.seen = Some(from.wrapping_add(ticks));
        self.newest.is_some_and(|newest| newest.wrapping_sub(first) >= 0 && last.wrapping_sub(newest) >= 0)
    }
}

/// Features that look along the desired trajectory from an origin.
fn along(feature: &Feature) -> bool {
    feature.source == Source::Desired && feature.relative != Relative::Nothing
}

/// For each desired channel the reciprocal of what it may move by in a sub-rate tick: what training moved by, the guard's margin
/// beyond it, and its floor.
#[inline(never)]
pub(super) fn paces<const D: usize, const C: usize, const O: usize, const A: usize>(
    card: &Card<'_, C, O, A>,
    (low, high): &(Floats<'_>, Floats<'_>),
    settings: &GuardSettings,
) -> [f32; D] {
    let mut changes = [0.0f32; D];
    for (feature, (low, high)) in card.features.iter().zip(low.iter().zip(high.iter())) {
        let Some(change) = changes.get_mut(usize::from(feature.channel)).filter(|_| along(feature)) else { continue };
        let offset = f32::from(feature.offset.unsigned_abs());
        if offset > 0.0 {
            *change = change.max(abs(low).max(abs(high)) / offset);
        }
    }
    changes.map(|change| pace(change, settings))
}

/// The reciprocal of what a channel may move by that moved by `change` in training.
fn pace(change: f32, settings: &GuardSettings) -> f32 {
    let allowed = (1.0 + settings.window_margin) * change + settings.envelope_floor / CLOSE;
    // Written so that NaN allows nothing.
    if allowed > 1.0 / f32::MAX { 1.0 / allowed } else { f32::MAX }
}

/// Share of the network's correction that features leave it, 0..=1: all of it up to what `paces` allow, nothing from half as much
/// again on. What counts is how far the window moves in a sub-rate tick.
#[inline(never)]
pub(super) fn share<const D: usize>(features: &[Feature], values: &[f32], paces: &[f32; D]) -> f32 {
    // Bits of the largest excess. Those of numbers without a sign are in the order of the numbers, and NaN is the largest.
    let mut excess = 0u32;
    let mut rest = features.iter().zip(values);
    let mut next = rest.next();
    while let Some((first, value)) = next {
        if !along(first) {
            next = rest.next();
            continue;
        }
        // A window: what follows of the same channel and origin, offset by offset.
        next = None;
        let own = first.relative == Relative::Desired(first.channel);
        let mut last = (i32::from(first.offset), *value);
        let mut moved = if own && first.offset > 0 { across((0, 0.0), last, own) } else { 0 };
        for (feature, value) in rest.by_ref() {
            let same = feature.channel == first.channel && feature.source == first.source && feature.relative == first.relative;
            let steps = i32::from(feature.offset) - last.0;
            if !same || steps <= 0 {
                next = Some((feature, value));
                break;
            }
            let place = (i32::from(feature.offset), *value);
            // In a window no sub-rate tick is left out but the present.
            let found = if steps == 1 { abs(*value - last.1).to_bits() } else { across(last, place, own) };
            moved = moved.max(found);
            last = place;
        }
        let pace = paces.get(usize::from(first.channel)).copied().unwrap_or(f32::MAX);
        excess = excess.max(abs(f32::from_bits(moved) * pace).to_bits());
    }
    // NaN is an excess.
    let excess = if excess <= f32::MAX.to_bits() { f32::from_bits(excess) } else { f32::MAX };
    clamp((NOTHING_LEFT - excess) / (NOTHING_LEFT - 1.0), 0.0, 1.0)
}

/// Bits of how far a window moves in a sub-rate tick from one of its places to the next one, between which some are left out. A
/// window that is relative to its `own` channel leaves out the present, which is zero.
#[inline(never)]
fn across(from: (i32, f32), to: (i32, f32), own: bool) -> u32 {
    let rate = |from: (i32, f32), to: (i32, f32)| abs((to.1 - from.1) / (to.0 - from.0) as f32).to_bits();
    let present = (0, 0.0);
    if own && from.0 < 0 && to.0 > 0 { rate(from, present).max(rate(present, to)) } else { rate(from, to) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::EndRule;
    use proptest::prelude::*;

    fn found(value: impl Fn(f32) -> f32) -> f32 {
        let features: heapless::Vec<Feature, 32> = crate::features::window(&[0], -4..=8).collect();
        let values: heapless::Vec<f32, 32> =
            features.iter().map(|feature| value(f32::from(feature.offset)) - value(0.0)).collect();
        share(&features, &values, &[pace(0.1, &GuardSettings::default())])
    }

    /// Ticks at which a jump is within 20 ticks of a trajectory of 200, read as it is pushed 10 ticks ahead.
    fn jumping(value: impl Fn(i32) -> f32) -> heapless::Vec<i32, 256> {
        let features: heapless::Vec<Feature, 32> = crate::features::window(&[0], -4..=8).collect();
        let (mut preview, mut jumps) = (Preview::<1, 64>::new([EndRule::Hold], 0), Jumps::of(&features));
        let mut found = heapless::Vec::new();
        for tick in 0..200 {
            while preview.reach(tick) < 10 {
                preview.push([value(preview.next_tick())]);
            }
            if jumps.within((tick - 10, tick + 10), &preview, &[pace(0.1, &GuardSettings::default())], 2) {
                found.push(tick).unwrap();
            }
        }
        found
    }

    #[test]
    fn a_jump_is_seen_while_it_is_in_the_window_and_a_motion_as_fast_is_none() {
        // Three times the mean pace of 0.057 a reference tick.
        let step = |size: f32| jumping(|tick| if tick < 100 { 0.0 } else { size });
        assert_eq!((step(0.2).first(), step(0.2).last()), (Some(&90), Some(&110)));
        assert!(step(0.15).is_empty() && jumping(|tick| 0.05 * tick as f32).is_empty());
        assert_eq!(jumping(|tick| if tick < 100 { 0.0 } else { f32::NAN }).first(), Some(&90));
    }

    #[test]
    fn what_was_replaced_is_looked_at_again() {
        let mut jumps = Jumps { channels: 1, newest: Some(50), seen: Some(80) };
        jumps.forget(60);
        assert_eq!((jumps.newest, jumps.seen), (Some(50), Some(59)));
        jumps.forget(40);
        assert_eq!((jumps.newest, jumps.seen), (None, Some(39)));
    }

    #[test]
    fn a_step_leaves_nothing_of_the_network_before_it_comes() {
        for at in [-4.0, -1.0, 0.0, 1.0, 3.0, 8.0] {
            assert_eq!(found(|offset| if offset < at { 0.0 } else { 1.5 }), if at == -4.0 { 1.0 } else { 0.0 }, "{at}");
        }
        assert_eq!(found(|_| f32::NAN), 0.0);
    }

    #[test]
    fn what_training_saw_leaves_all_and_half_as_much_again_nothing() {
        // A tenth more, and the floor, are allowed: 0.114 in a sub-rate tick.
        for (speed, expected) in [(0.1, 1.0), (0.113, 1.0), (0.1425, 0.5), (0.172, 0.0)] {
            assert!((found(|offset| speed * offset) - expected).abs() < 1e-4, "{speed}");
        }
    }

    proptest! {
        #[test]
        fn it_is_a_share_whatever_comes_in(values in prop::collection::vec(any::<f32>(), 12), change in any::<f32>()) {
            let features: heapless::Vec<Feature, 32> = crate::features::window(&[0], -4..=8).collect();
            let share = share(&features, &values, &[pace(change, &GuardSettings::default())]);
            prop_assert!((0.0..=1.0).contains(&share), "{share}");
        }
    }
}
