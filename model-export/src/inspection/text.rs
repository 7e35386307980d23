//! An inspection for people.

use std::fmt;

use comfy_table::{Table, presets};
use impromptu_firmware::{model::Interpolation, network::Activation, preview::EndRule};

use super::{InspectedFeature, InspectedLane, InspectedMonitor, InspectedNetwork, Inspection, Timing};
use crate::description::ChannelDescription;

/// Width of the labels.
const LABEL: usize = 14;

fn table<const N: usize>(header: [&str; N], rows: impl IntoIterator<Item = [String; N]>) -> String {
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_header(header).add_rows(rows);
    table.trim_fmt() + "\n"
}

fn line(f: &mut fmt::Formatter<'_>, label: &str, value: impl fmt::Display) -> fmt::Result {
    writeln!(f, "{label:<LABEL$} {value}")
}

impl fmt::Display for Inspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (size, from) = (&self.size, &self.provenance);
        line(f, "model", &self.name)?;
        line(
            f,
            "file",
            format_args!(
                "format {}, {} of {} bytes ({} card, {} numbers), CRC {}",
                self.format_version, size.file, size.limit, size.card, size.blob, self.crc
            ),
        )?;
        for (label, value) in
            [("vehicle", &from.vehicle), ("gains", &from.gains), ("condition", &from.condition), ("software", &from.software)]
        {
            line(f, label, value)?;
        }
        line(f, "training", format_args!("seed {}, CRC of the rows {:08x}", from.seed, from.data_crc))?;
        if !from.remarks.is_empty() {
            line(f, "remarks", &from.remarks)?;
        }
        timing(f, &self.timing)?;
        match &self.network {
            Some(network) => line(f, "network lane", network)?,
            None => line(f, "network lane", "none")?,
        }
        match &self.lane {
            Some(lane) => line(f, "feedback lane", lane)?,
            None => line(f, "feedback lane", "none")?,
        }
        match &self.monitor {
            Some(monitor) => line(f, "monitor", monitor)?,
            None => line(f, "monitor", "none: the guard cannot judge the lanes by evidence")?,
        }
        line(
            f,
            "probes",
            format_args!(
                "{} of the network lane, {} of the feedback lane: same bits on this machine",
                if self.network.is_some() { self.network_probes } else { 0 },
                self.lane.as_ref().map_or(0, |lane| lane.axes.len())
            ),
        )?;
        writeln!(f, "\nOutputs\n{}", self.outputs_table())?;
        if self.network.is_some() {
            writeln!(f, "Network lane with features within their ranges in training: proven bounds\n{}", self.bounds_table())?;
        }
        if let Some(lane) = &self.lane {
            writeln!(f, "Feedback lane\n{}", axes_table(lane))?;
        }
        if let Some(monitor) = &self.monitor {
            writeln!(f, "Monitor: a lasting correction of 1 comes to\n{}", monitor_table(monitor))?;
        }
        if !self.features.is_empty() {
            writeln!(f, "Features: offsets in network ticks, range in training\n{}", features_table(&self.features))?;
        }
        write!(f, "Signals\n{}", self.signals_table())
    }
}

fn timing(f: &mut fmt::Formatter<'_>, timing: &Timing) -> fmt::Result {
    let between = match timing.interpolation {
        Interpolation::Hold => "held",
        Interpolation::Linear => "ramped",
    };
    line(
        f,
        "rates",
        format_args!(
            "reference {} Hz, network {} Hz (every {} ticks, {between} in between)",
            timing.reference_rate_hz, timing.network_rate_hz, timing.divisor
        ),
    )?;
    let second = |ticks: u32| ticks as f32 / timing.reference_rate_hz;
    line(
        f,
        "window",
        format_args!(
            "{} ticks ({} s) of the past, {} ticks ({} s) of preview",
            timing.past_ticks,
            second(timing.past_ticks),
            timing.preview_ticks,
            second(timing.preview_ticks)
        ),
    )?;
    line(f, "delays", format_args!("measurements are {} s old, lanes fade in {} s", timing.measurement_delay_s, timing.fade_s))
}

impl fmt::Display for InspectedNetwork {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.inputs)?;
        for (outputs, activation) in &self.layers {
            let name = match activation {
                Activation::Linear => "",
                Activation::Relu => " relu",
                Activation::Tanh => " tanh",
            };
            write!(f, "-{outputs}{name}")?;
        }
        let skip = match (self.skip, self.layers.is_empty()) {
            (true, true) => " linear map",
            (true, false) => " and linear skip",
            (false, _) => "",
        };
        write!(f, "{skip}, {}, {} bytes, {} multiply-adds", self.arithmetic, self.bytes, self.multiply_adds)
    }
}

impl fmt::Display for InspectedMonitor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { axes, period_s, memory_s, validated_rms, unit } = self;
        write!(f, "{} axes, every {period_s} s, response of {memory_s} s, promised error {validated_rms} {unit}", axes.len())
    }
}

/// A margin that nothing limits.
fn margin(value: f32, unit: &str) -> String {
    if value == f32::MAX { "unlimited".into() } else { format!("{value:.2}{unit}") }
}

impl fmt::Display for InspectedLane {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { axes, lags, multiply_adds, margins } = self;
        write!(f, "{} axes, {lags} lags, {multiply_adds} multiply-adds, ", axes.len())?;
        let (delay, gain) = (margin(margins.delay_ms, " ms"), margin(margins.gain, ""));
        write!(f, "margins: delay {delay}, gain {gain}, modulus {:.2}", margins.modulus)
    }
}

impl Inspection {
    fn outputs_table(&self) -> String {
        let rows = self.outputs.iter().map(|output| {
            [output.name.clone(), output.unit.clone(), output.limit.to_string(), format!("{} /s", output.slew_per_second)]
        });
        table(["reference", "unit", "limit", "slew"], rows)
    }

    fn bounds_table(&self) -> String {
        let rows = self.outputs.iter().filter_map(|output| {
            let bounds = output.bounds?;
            Some([
                output.name.clone(),
                output.unit.clone(),
                format!("{:.4} to {:.4}", bounds.low, bounds.high),
                bounds.reaches_limit.into(),
                format!("{:.3e}", bounds.difference),
                format!("{:.4}", bounds.lipschitz),
            ])
        });
        table(["reference", "unit", "range", "reaches its limit", "off the float network", "slope"], rows)
    }

    fn signals_table(&self) -> String {
        let Self { signals, .. } = self;
        let kinds = [("desired", &signals.desired), ("measured", &signals.measured), ("reference", &signals.reference)];
        let row = |kind: &str, index: usize, channel: &ChannelDescription| {
            let end = match channel.end {
                EndRule::Hold => "hold",
                EndRule::Zero => "zero",
            };
            [format!("{kind} {index}"), channel.name.clone(), channel.unit.clone(), channel.frame.clone(), end.to_owned()]
        };
        let rows = kinds.into_iter().flat_map(|(kind, channels)| {
            channels.iter().enumerate().map(move |(index, channel)| row(kind, index, channel)).collect::<Vec<_>>()
        });
        table(["signal", "channel", "unit", "frame", "beyond the ends"], rows)
    }
}

fn axes_table(lane: &InspectedLane) -> String {
    let rows = lane.axes.iter().map(|axis| {
        [
            axis.output.clone(),
            axis.unit.clone(),
            axis.errors.join("; "),
            axis.fast_limit.to_string(),
            format!("{} /s", axis.integral),
            axis.integral_limit.to_string(),
        ]
    });
    table(["reference", "unit", "errors", "clamp", "integral", "its clamp"], rows)
}

fn monitor_table(monitor: &InspectedMonitor) -> String {
    let rows = monitor
        .axes
        .iter()
        .flat_map(|axis| axis.inputs.iter().map(|(input, gain)| [axis.error.clone(), input.clone(), format!("{gain:.3}")]));
    table(["error", "correction of", "response"], rows)
}

/// One row for each run of features that differ in their offset only.
fn features_table(features: &[InspectedFeature]) -> String {
    let runs = features.chunk_by(|a, b| a.quantity == b.quantity && a.unit == b.unit);
    let rows = runs.map(|run| {
        let low = run.iter().fold(f32::INFINITY, |low, feature| low.min(feature.low));
        let high = run.iter().fold(f32::NEG_INFINITY, |high, feature| high.max(feature.high));
        let unit = run.first().map_or("", |feature| &feature.unit);
        [
            run.first().map_or("", |feature| &feature.quantity).to_owned(),
            unit.to_owned(),
            offsets(run),
            format!("{low:.4} to {high:.4}"),
        ]
    });
    table(["feature", "unit", "offsets", "range"], rows)
}

/// `-4..-1, 1..8`
fn offsets(run: &[InspectedFeature]) -> String {
    let consecutive = run.chunk_by(|a, b| i32::from(a.offset) + 1 == i32::from(b.offset));
    let spans = consecutive.map(|span| match span {
        [one] => one.offset.to_string(),
        [first, .., last] => format!("{}..{}", first.offset, last.offset),
        [] => String::new(),
    });
    spans.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_are_grouped() {
        let feature = |offset| InspectedFeature { quantity: String::new(), unit: String::new(), offset, low: 0.0, high: 1.0 };
        let run: Vec<_> = [-4, -3, -1, 1, 2, 3, 8].map(feature).into();
        assert_eq!(offsets(&run), "-4..-3, -1, 1..3, 8");
    }
}
