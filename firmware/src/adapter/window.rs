//! What the window of the desired trajectory asks for, against what training saw.
//!
//! *in* the network lane's features, and the smallest and largest of each in training; *out* the share of the network's correction
//! that may act, before it acts; *never* a look at a single value: a step is inside of every box of values long before it is
//! reached; *source* the statistics of a trajectory are the same at every time, so what a window moved by from one offset to the
//! next is bounded by what training moved by from the present to the next.

use crate::{
    format::{Card, Feature, Floats, Relative, Source},
    guard::GuardSettings,
    math::{abs, clamp},
};

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

/// Share of the network's correction that features leave it, 0..=1: all of it up to the guard's margin round what training saw,
/// nothing from half as much again on.
pub(super) fn share<const D: usize>(features: &[Feature], values: &[f32], changes: &[f32; D], settings: &GuardSettings) -> f32 {
    let mut excess = 0.0f32;
    let mut last: Option<(&Feature, f32)> = None;
    for (feature, value) in features.iter().zip(values) {
        if !along(feature) {
            last = None;
            continue;
        }
        let change = changes.get(usize::from(feature.channel)).copied().unwrap_or(0.0);
        let within = |offsets: i32, moved: f32| {
            let allowed = (1.0 + 2.0 * settings.envelope_margin) * change * offsets as f32 + settings.envelope_floor;
            // Written so that NaN is an excess.
            if abs(moved) <= f32::MAX { abs(moved) / allowed } else { f32::MAX }
        };
        let same = last.filter(|(last, _)| {
            last.channel == feature.channel && last.relative == feature.relative && last.offset < feature.offset
        });
        // A window that is relative to its own channel leaves out the present, which is zero.
        let present = feature.relative == Relative::Desired(feature.channel);
        let offset = i32::from(feature.offset);
        let found = match same {
            Some((before, _)) if present && before.offset < 0 && offset > 0 => within(offset, *value),
            Some((before, moved)) => within(offset - i32::from(before.offset), value - moved),
            None if present && offset > 0 => within(offset, *value),
            None => 0.0,
        };
        excess = if found > excess { found } else { excess };
        if present && offset == -1 {
            let found = within(1, *value);
            excess = if found > excess { found } else { excess };
        }
        last = Some((feature, *value));
    }
    clamp((NOTHING_LEFT - excess) / (NOTHING_LEFT - 1.0), 0.0, 1.0)
}
