//! What an adapter reads: the application's channels, matched by name with the model's, and their past at the sub-rate.
//!
//! *in* signal tables, previews and histories; *out* what features ask for; *never* a model between other channels than the
//! application's; *source* the signal tables of [`crate::format`].

use crate::{
    features::{Signals, Source},
    format::{Card, Channels, EndRule, HISTORY, Refusal},
    preview::Preview,
};

/// Values at sub-rate ticks; what is older or newer than stored gives the nearest.
pub(super) type History<const C: usize> = Preview<C, HISTORY>;

/// What the features of one inference see, all of which are asked for at one sub-rate tick.
pub(super) struct View<'a, const D: usize, const M: usize, const R: usize, const N: usize> {
    pub(super) desired: &'a Preview<D, N>,
    /// The desired channels at that tick, which every relative feature of a window asks for,
    pub(super) origin: [f32; D],
    pub(super) measured: &'a History<M>,
    pub(super) references: &'a History<R>,
    /// and its number, by which the histories are addressed.
    pub(super) sub_tick: i32,
}

impl<const D: usize, const M: usize, const R: usize, const N: usize> Signals for View<'_, D, M, R, N> {
    #[inline]
    fn desired(&self, tick: i32, channel: usize) -> f32 {
        self.desired.channel(tick, channel)
    }
    #[inline]
    fn measured(&self, _: i32, channel: usize) -> f32 {
        self.measured.channel(self.sub_tick, channel)
    }
    #[inline]
    fn reference(&self, _: i32, channel: usize) -> f32 {
        self.references.channel(self.sub_tick, channel)
    }
    #[inline(always)]
    fn at(&self, source: Source, tick: i32, offset: i16, divisor: i32, channel: usize) -> f32 {
        let sub_tick = self.sub_tick.wrapping_add(i32::from(offset));
        match source {
            Source::Desired if offset == 0 => self.origin.get(channel).copied().unwrap_or(0.0),
            Source::Desired => self.desired.channel(tick.wrapping_add(i32::from(offset).wrapping_mul(divisor)), channel),
            Source::Measured => self.measured.channel(sub_tick, channel),
            Source::Reference => self.references.channel(sub_tick, channel),
        }
    }
}

/// A measured channel against a desired one at the time of the measurement, which is `delay` reference ticks old.
#[inline]
pub(super) fn matched_error<const D: usize, const N: usize>(
    tick: i32,
    delay: f32,
    preview: &Preview<D, N>,
    measured: &[f32],
    (measured_channel, desired_channel): (u8, u8),
) -> f32 {
    let then = matched_desired(tick, delay, preview, desired_channel);
    measured.get(usize::from(measured_channel)).copied().unwrap_or(then) - then
}

/// A desired channel at the time of a measurement that is `delay` reference ticks old.
#[inline]
pub(super) fn matched_desired<const D: usize, const N: usize>(
    tick: i32,
    delay: f32,
    preview: &Preview<D, N>,
    desired_channel: u8,
) -> f32 {
    let whole = delay as i32;
    let channel = usize::from(desired_channel);
    let newer = preview.channel(tick.wrapping_sub(whole), channel);
    let older = preview.channel(tick.wrapping_sub(whole.saturating_add(1)), channel);
    newer + (older - newer) * (delay - whole as f32)
}

/// Desired channel of the same name for each reference channel.
pub(super) fn base_channels<const R: usize>(table: &Channels<'_>) -> [usize; R] {
    core::array::from_fn(|r| {
        let name = table.reference.get(r).map(|channel| channel.name);
        table.desired.iter().position(|desired| Some(desired.name) == name).unwrap_or(0)
    })
}

/// Measured channel of the same name for each reference channel; none for one that is zero at rest.
pub(super) fn measured_channels<const R: usize>(table: &Channels<'_>) -> [Option<u8>; R] {
    core::array::from_fn(|r| {
        let reference = table.reference.get(r).filter(|channel| channel.end == EndRule::Hold)?;
        let found = table.measured.iter().position(|measured| measured.name == reference.name)?;
        u8::try_from(found).ok()
    })
}

/// Refuses a model whose channels are not the application's, or do not fit into arrays of `limits` channels. Array elements
/// behind the table's channels are not used.
pub(super) fn same_signals<const C: usize, const O: usize, const A: usize>(
    card: &Card<'_, C, O, A>,
    table: &Channels<'_>,
    limits: [usize; 3],
) -> Result<(), Refusal> {
    let pairs = [
        ("desired", &card.signals.desired, table.desired),
        ("measured", &card.signals.measured, table.measured),
        ("reference", &card.signals.reference, table.reference),
    ];
    for ((signal, model, application), limit) in pairs.into_iter().zip(limits) {
        let differs = model.iter().zip(application).position(|(a, b)| a != b);
        let length =
            (model.len() != application.len() || model.len() > limit).then_some(model.len().min(application.len()).min(limit));
        if let Some(channel) = differs.or(length) {
            return Err(Refusal::Signal { signal, channel: channel as u8 });
        }
    }
    Ok(())
}

/// Refuses an application whose channels do not fit into arrays of `limits` channels, or whose reference has a channel without a
/// desired one of the same name.
pub(super) fn whole_signals(table: &Channels<'_>, limits: [usize; 3]) -> Result<(), Refusal> {
    let counts = [("desired", table.desired.len()), ("measured", table.measured.len()), ("reference", table.reference.len())];
    for ((signal, count), limit) in counts.into_iter().zip(limits) {
        if count > limit {
            return Err(Refusal::Signal { signal, channel: limit as u8 });
        }
    }
    let desired = |name| table.desired.iter().any(|desired| desired.name == name);
    match table.reference.iter().position(|channel| !desired(channel.name)) {
        Some(channel) => Err(Refusal::Signal { signal: "reference", channel: channel as u8 }),
        None => Ok(()),
    }
}
