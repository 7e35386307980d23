//! Checks of a decoded card: every index exists, every number makes sense, every probe gives its bits.
//!
//! *in* a card, its blob, what was made of both; *out* nothing, or the first thing that is wrong; *never* an index, a number or a
//! probe unchecked; *source* the fields of [`Card`].

use crate::{
    feedback::{self, Lane},
    format::{
        Blob, Bounds, Card, FeedbackLayout, Floats, HISTORY, MAX_ERRORS, MAX_FEATURES, MAX_LAGS, MAX_TAPS, MAX_WIDTH,
        MonitorLayout, Refusal, Relative, Source, ranges,
    },
    network::{Network, Scratch},
};

/// Longest look into the past or the future of one feature, in reference ticks.
const MAX_OFFSET_TICKS: i32 = 10_000;

/// Indices, ranges and values of a card.
#[inline(never)]
pub(super) fn card<const C: usize, const O: usize, const A: usize>(card: &Card<'_, C, O, A>) -> Result<(), Refusal> {
    timing(card)?;
    signals(card)?;
    features(card)?;
    outputs(card)?;
    if let Some(network) = &card.network {
        if card.features.is_empty() {
            return Err(Refusal::Shape { what: "number of features", found: 0, limit: MAX_FEATURES as u32 });
        }
        for layer in &network.layers {
            for (what, width) in [("layer inputs", layer.inputs), ("layer outputs", layer.outputs)] {
                if width == 0 || usize::from(width) > MAX_WIDTH {
                    return Err(Refusal::Shape { what, found: width.into(), limit: MAX_WIDTH as u32 });
                }
            }
        }
    }
    card.feedback.as_ref().map_or(Ok(()), |lane| self::lane(card, lane))?;
    card.monitor.as_ref().map_or(Ok(()), |monitor| self::monitor(card, monitor))
}

fn timing<const C: usize, const O: usize, const A: usize>(card: &Card<'_, C, O, A>) -> Result<(), Refusal> {
    let timing = &card.timing;
    ranges::RATE.check(timing.reference_rate_hz)?;
    ranges::DIVISOR.check(timing.divisor.into())?;
    ranges::DELAY.check(timing.measurement_delay_ticks)?;
    ranges::FADE.demand(ranges::fade(timing.fade_ticks, timing.reference_rate_hz))
}

fn signals<const C: usize, const O: usize, const A: usize>(card: &Card<'_, C, O, A>) -> Result<(), Refusal> {
    for (index, channel) in card.signals.reference.iter().enumerate() {
        if !card.signals.desired.iter().any(|desired| desired.name == channel.name) {
            return Err(Refusal::Signal { signal: "reference", channel: index as u8 });
        }
    }
    Ok(())
}

fn features<const C: usize, const O: usize, const A: usize>(card: &Card<'_, C, O, A>) -> Result<(), Refusal> {
    let signals = &card.signals;
    let inside = |found: u8, count: usize, what| {
        if usize::from(found) < count { Ok(()) } else { Err(Refusal::Index { what, found }) }
    };
    for feature in &card.features {
        let (count, future) = match feature.source {
            Source::Desired => (signals.desired.len(), true),
            Source::Measured => (signals.measured.len(), false),
            Source::Reference => (signals.reference.len(), false),
        };
        inside(feature.channel, count, "feature channel")?;
        match feature.relative {
            Relative::Nothing => {}
            Relative::Desired(origin) => inside(origin, signals.desired.len(), "feature origin")?,
            Relative::Measured(origin) => inside(origin, signals.measured.len(), "feature origin")?,
        }
        let ticks = i32::from(feature.offset) * i32::from(card.timing.divisor);
        let newest = match feature.source {
            Source::Reference => -1,
            _ => 0,
        };
        let history = -(HISTORY as i16) + 2;
        let beyond = !future && (feature.offset > newest || feature.offset < history);
        if ticks.abs() > MAX_OFFSET_TICKS || beyond {
            return Err(Refusal::Value { what: "feature offset" });
        }
    }
    Ok(())
}

fn outputs<const C: usize, const O: usize, const A: usize>(card: &Card<'_, C, O, A>) -> Result<(), Refusal> {
    for (index, output) in card.outputs.iter().enumerate() {
        let found = output.channel;
        if usize::from(found) >= card.signals.reference.len() {
            return Err(Refusal::Index { what: "output channel", found });
        }
        if card.outputs.iter().take(index).any(|other| other.channel == found) {
            return Err(Refusal::Duplicate { what: "output channel", found });
        }
        if !ranges::output(output.limit, output.slew) {
            return Err(Refusal::Value { what: "output limit or slew" });
        }
    }
    Ok(())
}

fn lane<const C: usize, const O: usize, const A: usize>(
    card: &Card<'_, C, O, A>,
    lane: &FeedbackLayout<A>,
) -> Result<(), Refusal> {
    if lane.lags == 0 || usize::from(lane.lags) > MAX_LAGS {
        return Err(Refusal::Shape { what: "lane lags", found: lane.lags.into(), limit: MAX_LAGS as u32 });
    }
    let margins = &lane.margins;
    if ![margins.delay_ms, margins.gain, margins.modulus].iter().all(|margin| margin.is_finite()) {
        return Err(Refusal::NotFinite { what: "lane margins" });
    }
    let authority = &lane.authority;
    if let Some(&found) = authority.channels.iter().find(|&&channel| usize::from(channel) >= card.signals.desired.len()) {
        return Err(Refusal::Index { what: "lane authority channel", found });
    }
    if !(ranges::AUTHORITY.holds(authority.scale)
        && ranges::AUTHORITY.holds(authority.error_scale)
        && ranges::decay(authority.decay, card.timing.reference_rate_hz))
    {
        return Err(Refusal::Value { what: "lane authority" });
    }
    for (index, axis) in lane.axes.iter().enumerate() {
        let found = axis.output;
        if usize::from(found) >= card.outputs.len() {
            return Err(Refusal::Index { what: "lane output", found });
        }
        if lane.axes.iter().take(index).any(|other| other.output == found) {
            return Err(Refusal::Duplicate { what: "lane output", found });
        }
        if axis.errors.is_empty() {
            return Err(Refusal::Shape { what: "lane errors", found: 0, limit: MAX_ERRORS as u32 });
        }
        for &(measured, desired) in &axis.errors {
            if usize::from(measured) >= card.signals.measured.len() {
                return Err(Refusal::Index { what: "lane measured channel", found: measured });
            }
            if usize::from(desired) >= card.signals.desired.len() {
                return Err(Refusal::Index { what: "lane desired channel", found: desired });
            }
        }
        let limits = [axis.fast_limit, axis.integral_limit];
        if !(ranges::LANE_INTEGRAL.holds(axis.integral) && limits.iter().all(|limit| ranges::LANE_LIMIT.holds(*limit))) {
            return Err(Refusal::Value { what: "lane integral or limit" });
        }
    }
    Ok(())
}

fn monitor<const C: usize, const O: usize, const A: usize>(
    card: &Card<'_, C, O, A>,
    monitor: &MonitorLayout<A>,
) -> Result<(), Refusal> {
    if monitor.taps == 0 || usize::from(monitor.taps) > MAX_TAPS {
        return Err(Refusal::Shape { what: "monitor taps", found: monitor.taps.into(), limit: MAX_TAPS as u32 });
    }
    ranges::MONITOR_DIVISOR.check(monitor.divisor.into())?;
    ranges::VALIDATED_RMS.check(monitor.validated_rms)?;
    for axis in &monitor.axes {
        let (measured, desired) = axis.error;
        if usize::from(measured) >= card.signals.measured.len() {
            return Err(Refusal::Index { what: "monitor measured channel", found: measured });
        }
        if usize::from(desired) >= card.signals.desired.len() {
            return Err(Refusal::Index { what: "monitor desired channel", found: desired });
        }
        for (index, &found) in axis.inputs.iter().enumerate() {
            if usize::from(found) >= card.outputs.len() {
                return Err(Refusal::Index { what: "monitor input", found });
            }
            if axis.inputs.iter().take(index).any(|other| *other == found) {
                return Err(Refusal::Duplicate { what: "monitor input", found });
            }
        }
    }
    Ok(())
}

/// Smallest and largest value of each feature.
type Envelope<'a> = (Floats<'a>, Floats<'a>);

/// Re-runs the network's probes, of which there must be one: the bits must be the file's, and within its bounds.
#[inline(never)]
pub(super) fn network_probes<'a, const C: usize, const O: usize, const A: usize>(
    card: &Card<'a, C, O, A>,
    blob: &Blob<'a>,
    network: Option<(&Network<'a>, &Envelope<'a>, &Bounds<'a>)>,
    scratch: &mut Scratch,
) -> Result<(), Refusal> {
    let (inputs, outputs) = (card.features.len(), card.outputs.len());
    let count = usize::from(card.probes.count);
    let stored = blob.floats(card.probes.network, count * (inputs + outputs), "network probes")?;
    let (probe_inputs, probe_outputs) = stored.split_at(count * inputs);
    let Some((network, envelope, bounds)) = network else { return Ok(()) };
    if count == 0 {
        return Err(Refusal::NoProbes);
    }
    let mut y = [0.0; O];
    for probe in 0..count {
        // Read where they are: an array of them would lie on the stack below the model that is checked.
        let (x, _) = probe_inputs.split_at(probe * inputs).1.split_at(inputs);
        network.evaluate_each(x.iter(), &mut y, scratch);
        let same =
            (0..outputs).all(|o| y.get(o).is_some_and(|y| y.to_bits() == probe_outputs.get(probe * outputs + o).to_bits()));
        if !same {
            return Err(Refusal::Probe { index: probe as u8 });
        }
        bounds.check(x, &y, envelope)?;
    }
    Ok(())
}

/// Re-runs the lane's probe: the bits must be the file's.
#[inline(never)]
pub(super) fn lane_probe<const C: usize, const O: usize, const A: usize>(
    card: &Card<'_, C, O, A>,
    blob: &Blob<'_>,
    lane: &Lane<'_, A>,
) -> Result<(), Refusal> {
    let expected = blob.floats(card.probes.feedback, lane.axes().len(), "lane probe")?;
    let found = feedback::probe(lane, 1.0 / card.timing.reference_rate_hz);
    let same = expected.iter().zip(found).all(|(expected, found)| expected.to_bits() == found.to_bits());
    if same { Ok(()) } else { Err(Refusal::Probe { index: u8::MAX }) }
}
