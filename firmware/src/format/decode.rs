//! A card, field by field, where it shall stay.
//!
//! *in* the postcard bytes of a [`Card`]; *out* the card, and the bytes behind it; *never* another card than `postcard` makes of
//! these bytes; *source* the fields of [`Card`] in their order.
//!
//! Serde returns what it decodes, and each level of it has a copy on the stack: 16 KB for a card of 3.

use heapless::Vec;
use serde::Deserialize;

use super::{Arithmetic, Authority, Card, FeedbackLayout, Margins, MonitorLayout, NetworkLayout, Refusal, Section};

/// Where a section is of which nothing has been read yet.
const NOWHERE: Section = Section { offset: 0, length: 0 };

/// Decodes into `card`.
///
/// # Errors
/// If the bytes are no card ([`Refusal::Card`]), or a list of it is longer than this build holds.
pub(crate) fn card<'a, const C: usize, const O: usize, const A: usize>(
    mut bytes: &'a [u8],
    card: &mut Card<'a, C, O, A>,
) -> Result<&'a [u8], Refusal> {
    let rest = &mut bytes;
    let Card { name, provenance, signals, timing, features, outputs, network, feedback, monitor, envelope, bounds, probes } =
        card;
    take(rest, name)?;
    take(rest, provenance)?;
    list(rest, &mut signals.desired, "number of desired channels")?;
    list(rest, &mut signals.measured, "number of measured channels")?;
    list(rest, &mut signals.reference, "number of reference channels")?;
    take(rest, timing)?;
    list(rest, features, "number of features")?;
    list(rest, outputs, "number of outputs")?;
    network_lane(rest, network)?;
    feedback_lane(rest, feedback)?;
    response(rest, monitor)?;
    take(rest, envelope)?;
    take(rest, bounds)?;
    take(rest, probes)?;
    Ok(bytes)
}

fn network_lane(rest: &mut &[u8], place: &mut Option<NetworkLayout>) -> Result<(), Refusal> {
    let Some(layout) = option(rest, place, || NetworkLayout {
        arithmetic: Arithmetic::Float,
        input_normalisation: NOWHERE,
        input_code: 0.0,
        layers: Vec::new(),
        skip: NOWHERE,
        output_normalisation: NOWHERE,
    })?
    else {
        return Ok(());
    };
    take(rest, &mut layout.arithmetic)?;
    take(rest, &mut layout.input_normalisation)?;
    take(rest, &mut layout.input_code)?;
    list(rest, &mut layout.layers, "number of layers")?;
    take(rest, &mut layout.skip)?;
    take(rest, &mut layout.output_normalisation)
}

fn feedback_lane<const A: usize>(rest: &mut &[u8], place: &mut Option<FeedbackLayout<A>>) -> Result<(), Refusal> {
    let Some(layout) = option(rest, place, || FeedbackLayout {
        lags: 0,
        axes: Vec::new(),
        authority: Authority { channels: Vec::new(), scale: 0.0, error_scale: 0.0, decay: 0.0 },
        margins: Margins { delay_ms: 0.0, gain: 0.0, modulus: 0.0 },
    })?
    else {
        return Ok(());
    };
    take(rest, &mut layout.lags)?;
    list(rest, &mut layout.axes, "number of axes of the feedback lane")?;
    take(rest, &mut layout.authority)?;
    take(rest, &mut layout.margins)
}

fn response<const A: usize>(rest: &mut &[u8], place: &mut Option<MonitorLayout<A>>) -> Result<(), Refusal> {
    let Some(layout) = option(rest, place, || MonitorLayout { divisor: 0, taps: 0, validated_rms: 0.0, axes: Vec::new() })?
    else {
        return Ok(());
    };
    take(rest, &mut layout.divisor)?;
    take(rest, &mut layout.taps)?;
    take(rest, &mut layout.validated_rms)?;
    list(rest, &mut layout.axes, "number of axes of the monitor")
}

/// Reads whether there is something, and makes room for it.
#[inline(never)]
fn option<'p, T>(rest: &mut &[u8], place: &'p mut Option<T>, empty: impl FnOnce() -> T) -> Result<Option<&'p mut T>, Refusal> {
    let mut present = false;
    take(rest, &mut present)?;
    if !present {
        *place = None;
        return Ok(None);
    }
    Ok(Some(place.insert(empty())))
}

#[inline(never)]
fn take<'a, T: Deserialize<'a>>(bytes: &mut &'a [u8], place: &mut T) -> Result<(), Refusal> {
    let (value, rest) = postcard::take_from_bytes(bytes).map_err(|_| Refusal::Card)?;
    (*place, *bytes) = (value, rest);
    Ok(())
}

/// A list that is too long is read to its end, so that a damaged length is not taken for one.
fn list<'a, T: Deserialize<'a>, const N: usize>(
    bytes: &mut &'a [u8],
    items: &mut Vec<T, N>,
    what: &'static str,
) -> Result<(), Refusal> {
    items.clear();
    let mut count = 0_u32;
    take(bytes, &mut count)?;
    for _ in 0..count {
        let (item, rest) = postcard::take_from_bytes(bytes).map_err(|_| Refusal::Card)?;
        let _ = items.push(item);
        *bytes = rest;
    }
    if count as usize > N { Err(Refusal::Shape { what, found: count, limit: N as u32 }) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::file;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn damaged_and_whole_cards_are_what_postcard_says(
            which in 0usize..2, changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..3),
            keep in any::<prop::sample::Index>(), cut in any::<bool>()
        ) {
            let models: [&[u8]; 2] =
                [include_bytes!("../../tests/models/int8-lane.model"), include_bytes!("../../tests/models/float-skip.model")];
            let mut bytes = file::split(models[which]).unwrap().0.to_vec();
            for (index, byte) in changes {
                let at = index.index(bytes.len());
                bytes[at] = byte;
            }
            if cut {
                bytes.truncate(keep.index(bytes.len()));
            }
            let mut found: Card<'_> = Card::empty();
            let rest = card(&bytes, &mut found);
            match postcard::take_from_bytes::<Card<'_>>(&bytes) {
                // By text: a number that is none is not equal to itself.
                Ok((expected, behind)) => prop_assert_eq!((format!("{found:?}"), rest), (format!("{expected:?}"), Ok(behind))),
                Err(_) => prop_assert!(rest.is_err()),
            }
        }
    }
}
