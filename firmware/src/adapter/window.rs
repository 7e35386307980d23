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
};

/// Sub-rate ticks over which a window may move by the guard's floor in addition.
const CLOSE: f32 = 5.0;
/// From this many times what is allowed on, nothing of the network's correction is left.
const NOTHING_LEFT: f32 = 1.5;

/// Features that look along the desired trajectory from an origin.
fn along(feature: &Feature) -> bool {
    feature.source == Source::Desired && feature.relative != Relative::Nothing
}

/// Largest change in a sub-rate tick of each desired channel in training.
pub(super) fn changes<const D: usize>(card: &Card<'_>, (low, high): &(Floats<'_>, Floats<'_>)) -> [f32; D] {
    let mut changes = [0.0f32; D];
    for (feature, (low, high)) in card.features.iter().zip(low.iter().zip(high.iter())) {
        let Some(change) = changes.get_mut(usize::from(feature.channel)).filter(|_| along(feature)) else { continue };
        let offset = f32::from(feature.offset.unsigned_abs());
        if offset > 0.0 {
            *change = change.max(abs(low).max(abs(high)) / offset);
        }
    }
    changes
}

/// A window as it is read, offset by offset.
#[derive(Clone, Copy)]
struct Place<'f> {
    feature: &'f Feature,
    offset: i32,
    value: f32,
}

/// Share of the network's correction that features leave it, 0..=1: all of it up to the guard's margin beyond what training saw,
/// nothing from half as much again on. What counts is how far the window moves in a sub-rate tick.
pub(super) fn share<const D: usize>(features: &[Feature], values: &[f32], changes: &[f32; D], settings: &GuardSettings) -> f32 {
    let mut excess = 0.0f32;
    let mut last: Option<Place<'_>> = None;
    for (feature, value) in features.iter().zip(values) {
        if !along(feature) {
            last = None;
            continue;
        }
        let change = changes.get(usize::from(feature.channel)).copied().unwrap_or(0.0);
        let allowed = (1.0 + settings.window_margin) * change + settings.envelope_floor / CLOSE;
        let offset = i32::from(feature.offset);
        let mut go = |before: Option<Place<'_>>, offset: i32, value: f32| {
            let rate = before.map(|before| (value - before.value) / (offset - before.offset) as f32);
            let moved = abs(rate.unwrap_or(0.0));
            // Written so that NaN is an excess.
            let found = if moved <= f32::MAX { moved / allowed } else { f32::MAX };
            excess = if found > excess { found } else { excess };
            Place { feature, offset, value }
        };
        let mut before = last.filter(|last| {
            last.feature.channel == feature.channel && last.feature.relative == feature.relative && last.offset < offset
        });
        // A window that is relative to its own channel leaves out the present, which is zero.
        let present = feature.relative == Relative::Desired(feature.channel) && offset > 0;
        if present && before.is_none_or(|before| before.offset < 0) {
            before = Some(go(before, 0, 0.0));
        }
        last = Some(go(before, offset, *value));
    }
    clamp((NOTHING_LEFT - excess) / (NOTHING_LEFT - 1.0), 0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const CHANGES: [f32; 1] = [0.1];

    fn found(value: impl Fn(f32) -> f32) -> f32 {
        let features: heapless::Vec<Feature, 32> = crate::features::window(&[0], -4..=8).collect();
        let values: heapless::Vec<f32, 32> =
            features.iter().map(|feature| value(f32::from(feature.offset)) - value(0.0)).collect();
        share(&features, &values, &CHANGES, &GuardSettings::default())
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
            let share = share(&features, &values, &[change], &GuardSettings::default());
            prop_assert!((0.0..=1.0).contains(&share), "{share}");
        }
    }
}
