//! What a model file says of itself, as owned data: for people as text, for programs as JSON.
//!
//! *in* a checked [`Model`]; *out* everything of its card but bulk numbers, indices replaced by names; *never* a number that the
//! file does not hold or imply.

mod learned;
mod text;

use impromptu_files::text::{line, mend};
use impromptu_firmware::{
    features::{Feature, Relative, Source},
    model::{Arithmetic, Card, Channel, Interpolation, Margins, Model, OutputBounds, Reach, Section, file},
    network::Activation,
};
use serde::Serialize;

use crate::description::{Provenance, Signals};
pub use learned::{LearnedAxis, LearnedInspection, Weight};

/// Everything that `inspect` prints.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Inspection {
    /// Name of the model.
    pub name: String,
    /// Format version.
    pub format_version: u16,
    /// Sizes of the file and its parts.
    pub size: Size,
    /// CRC-32 of the file, hexadecimal.
    pub crc: String,
    /// Where it comes from.
    pub provenance: Provenance,
    /// Signals with units, frames and end rules.
    pub signals: Signals,
    /// Rates, delays, window.
    pub timing: Timing,
    /// Network inputs.
    pub features: Vec<InspectedFeature>,
    /// Corrected channels.
    pub outputs: Vec<InspectedOutput>,
    /// Network lane.
    pub network: Option<InspectedNetwork>,
    /// Feedback lane.
    pub feedback_lane: Option<InspectedLane>,
    /// By what the guard judges the lanes; without it there are no trips by evidence.
    pub monitor: Option<InspectedMonitor>,
    /// Probes of the network lane; all of them gave their bits, or the file would not have been loaded.
    pub network_probes: u8,
}

/// Sizes in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Size {
    /// Whole file.
    pub file: usize,
    /// Largest file that the firmware accepts.
    pub limit: usize,
    /// Card.
    pub card: usize,
    /// Bulk numbers.
    pub blob: usize,
}

/// Rates, delays, window.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Timing {
    /// Rate of the reference, Hz.
    pub reference_rate_hz: f32,
    /// Rate of the network lane, Hz.
    pub network_rate_hz: f32,
    /// Reference ticks in a sub-rate tick.
    pub divisor: u16,
    /// Held or ramped.
    pub interpolation: Interpolation,
    /// Age of the measured position, s.
    pub measurement_delay_s: f32,
    /// Fade time, s.
    pub fade_s: f32,
    /// Reference ticks of the past that are read.
    pub past_ticks: u32,
    /// Reference ticks of preview that are read.
    pub preview_ticks: u32,
}

/// One network input.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InspectedFeature {
    /// For example `desired position.x - desired position.x now`.
    pub quantity: String,
    /// Unit.
    pub unit: String,
    /// Sub-rate ticks, positive in the future.
    pub offset: i16,
    /// Smallest value in training.
    pub low: f32,
    /// Largest value in training.
    pub high: f32,
}

/// One corrected channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InspectedOutput {
    /// Reference channel.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Largest correction.
    pub limit: f32,
    /// Largest change in a second, unit/s.
    pub slew_per_second: f32,
    /// What the network lane can give inside of the training envelope.
    pub bounds: Option<InspectedBounds>,
}

/// Proven bounds of an output, in its unit; features within their ranges in training.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct InspectedBounds {
    /// Smallest correction of the network.
    pub low: f32,
    /// Largest.
    pub high: f32,
    /// Whether the network reaches the limit: `never`, `possibly` or `always`.
    pub reaches_limit: &'static str,
    /// Largest difference from the float network that the file was made from.
    pub difference: f32,
    /// Largest change when every input moves by at most its scale.
    pub lipschitz: f32,
}

/// Shape and cost of the network lane.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InspectedNetwork {
    /// `float`, `int8` or `int16`.
    pub arithmetic: &'static str,
    /// Inputs.
    pub inputs: usize,
    /// Outputs and activation of each dense layer.
    pub layers: Vec<(u16, Activation)>,
    /// Whether a linear map leads from the inputs straight to the outputs.
    pub skip: bool,
    /// Multiplications with a weight in one evaluation.
    pub multiply_adds: u32,
    /// Bytes of weights, biases and scales.
    pub bytes: u32,
}

/// The feedback lane.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InspectedLane {
    /// Lags of each error and of the past output.
    pub lags: u8,
    /// Multiplications in one reference tick.
    pub multiply_adds: u32,
    /// Worst margins over the axes.
    pub margins: Margins,
    /// Axes.
    pub axes: Vec<InspectedAxis>,
}

/// One axis of the feedback lane.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InspectedAxis {
    /// Corrected reference channel.
    pub output: String,
    /// Its unit.
    pub unit: String,
    /// Measured minus desired channels; the desired one is taken at the time of the measurement.
    pub errors: Vec<String>,
    /// Factor of the integral, 1/s.
    pub integral: f32,
    /// Clamp of the fast part.
    pub fast_limit: f32,
    /// Clamp of the integral part.
    pub integral_limit: f32,
}

/// By what the guard judges the lanes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InspectedMonitor {
    /// Time between two judgements, s.
    pub period_s: f32,
    /// Time that a response to a correction lasts, s.
    pub memory_s: f32,
    /// RMS of the error that validation flights showed with the add-on, in its unit.
    pub validated_rms: f32,
    /// Unit of the errors.
    pub unit: String,
    /// Axes.
    pub axes: Vec<InspectedMonitorAxis>,
}

/// One axis of the monitor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InspectedMonitorAxis {
    /// Measured minus desired channel; the desired one is taken at the time of the measurement.
    pub error: String,
    /// Corrected reference channels that move it, each with what a lasting correction of 1 comes to.
    pub inputs: Vec<(String, f32)>,
}

impl Inspection {
    /// What `model`, loaded from `bytes`, says.
    pub fn new<const C: usize, const O: usize, const A: usize>(model: &Model<'_, C, O, A>, bytes: &[u8]) -> Self {
        let card = model.card();
        let timing = &card.timing;
        let (past_ticks, preview_ticks) = card.preview_span();
        let (low, high) = model.envelope();
        let features = card.features.iter().zip(low.iter().zip(high.iter()));
        let (card_bytes, blob_bytes) = file::split(bytes).map_or((0, 0), |(card, blob)| (card.len(), blob.len()));
        let rate = timing.reference_rate_hz;
        let bounds = model.bounds().iter().map(Some).chain(std::iter::repeat(None));
        let outputs = card.outputs.iter().zip(bounds).map(|(output, bounds)| {
            let (name, unit) = channel(&card.signals.reference, output.channel);
            InspectedOutput {
                name,
                unit,
                limit: output.limit,
                slew_per_second: output.slew * rate,
                bounds: bounds.map(|bounds| inspected_bounds(bounds, output.limit)),
            }
        });
        Self {
            name: text(card.name),
            format_version: file::version(bytes),
            size: Size { file: bytes.len(), limit: file::MAX_FILE, card: card_bytes, blob: blob_bytes },
            crc: format!("{:08x}", model.checksum()),
            provenance: Provenance {
                vehicle: text(card.provenance.vehicle),
                gains: text(card.provenance.gains),
                condition: text(card.provenance.condition),
                software: text(card.provenance.software),
                seed: card.provenance.seed,
                data_crc: card.provenance.data_crc,
                remarks: text(card.provenance.remarks),
            },
            signals: signals(card),
            timing: Timing {
                reference_rate_hz: rate,
                network_rate_hz: rate / f32::from(timing.divisor),
                divisor: timing.divisor,
                interpolation: timing.interpolation,
                measurement_delay_s: timing.measurement_delay_ticks / rate,
                fade_s: f32::from(timing.fade_ticks) / rate,
                past_ticks,
                preview_ticks,
            },
            features: features.map(|(feature, (low, high))| inspected_feature(card, feature, low, high)).collect(),
            outputs: outputs.collect(),
            network: network(model),
            feedback_lane: feedback_lane(model),
            monitor: monitor(model),
            network_probes: card.probes.count,
        }
    }
}

/// A text of the file, such that it can be printed.
fn text(text: &str) -> String {
    line(text).into_owned()
}

/// The signals, with harmless texts.
fn signals<const C: usize, const O: usize, const A: usize>(card: &Card<'_, C, O, A>) -> Signals {
    let mut signals = Signals::from(&card.signals);
    for channel in signals.desired.iter_mut().chain(&mut signals.measured).chain(&mut signals.reference) {
        [&mut channel.name, &mut channel.unit, &mut channel.frame].into_iter().for_each(mend);
    }
    signals
}

/// Name and unit of a channel; the indices of a loaded model are checked.
fn channel(channels: &[Channel<'_>], index: u8) -> (String, String) {
    channels.get(usize::from(index)).map_or_else(Default::default, |channel| (text(channel.name), text(channel.unit)))
}

fn inspected_feature<const C: usize, const O: usize, const A: usize>(
    card: &Card<'_, C, O, A>,
    feature: &Feature,
    low: f32,
    high: f32,
) -> InspectedFeature {
    let signals = &card.signals;
    let (signal, (name, unit)) = match feature.source {
        Source::Desired => ("desired", channel(&signals.desired, feature.channel)),
        Source::Measured => ("measured", channel(&signals.measured, feature.channel)),
        Source::Reference => ("reference", channel(&signals.reference, feature.channel)),
    };
    let origin = match feature.relative {
        Relative::Nothing => String::new(),
        Relative::Desired(origin) => format!(" - desired {} now", channel(&signals.desired, origin).0),
        Relative::Measured(origin) => format!(" - measured {} now", channel(&signals.measured, origin).0),
    };
    InspectedFeature { quantity: format!("{signal} {name}{origin}"), unit, offset: feature.offset, low, high }
}

fn inspected_bounds(bounds: OutputBounds, limit: f32) -> InspectedBounds {
    InspectedBounds {
        low: bounds.low,
        high: bounds.high,
        reaches_limit: match bounds.reach(limit) {
            Reach::Within => "never",
            Reach::Partly => "possibly",
            Reach::Beyond => "always",
        },
        difference: bounds.difference,
        lipschitz: bounds.lipschitz,
    }
}

fn network<const C: usize, const O: usize, const A: usize>(model: &Model<'_, C, O, A>) -> Option<InspectedNetwork> {
    let layout = model.card().network.as_ref()?;
    let layers = layout.layers.iter().map(|layer| layer.rows);
    let sections = layers.chain([layout.input_normalisation, layout.skip, layout.output_normalisation]);
    Some(InspectedNetwork {
        arithmetic: match layout.arithmetic {
            Arithmetic::Float => "float",
            Arithmetic::Int8 => "int8",
            Arithmetic::Int16 => "int16",
        },
        inputs: model.card().features.len(),
        layers: layout.layers.iter().map(|layer| (layer.outputs, layer.activation)).collect(),
        skip: layout.skip.length > 0,
        multiply_adds: model.network()?.multiply_adds(),
        bytes: sections.map(|section: Section| section.length).sum(),
    })
}

fn error<const C: usize, const O: usize, const A: usize>(card: &Card<'_, C, O, A>, (measured, desired): (u8, u8)) -> String {
    let (measured, desired) = (channel(&card.signals.measured, measured).0, channel(&card.signals.desired, desired).0);
    format!("measured {measured} - desired {desired}")
}

fn monitor<const C: usize, const O: usize, const A: usize>(model: &Model<'_, C, O, A>) -> Option<InspectedMonitor> {
    let card = model.card();
    let monitor = model.monitor()?;
    let period_s = f32::from(monitor.divisor()) / card.timing.reference_rate_hz;
    let axes = monitor.axes().iter().map(|(axis, response)| {
        let inputs = axis.inputs.iter().enumerate().map(|(place, &input)| {
            let reference = card.outputs.get(usize::from(input)).map_or(0, |output| output.channel);
            let taps = response.split_at(place * monitor.taps()).1.split_at(monitor.taps()).0;
            (channel(&card.signals.reference, reference).0, taps.iter().sum())
        });
        InspectedMonitorAxis { error: error(card, axis.error), inputs: inputs.collect() }
    });
    let first = monitor.axes().first().map_or(0, |(axis, _)| axis.error.0);
    Some(InspectedMonitor {
        period_s,
        memory_s: period_s * monitor.taps() as f32,
        validated_rms: monitor.validated_rms(),
        unit: channel(&card.signals.measured, first).1,
        axes: axes.collect(),
    })
}

fn feedback_lane<const C: usize, const O: usize, const A: usize>(model: &Model<'_, C, O, A>) -> Option<InspectedLane> {
    let card = model.card();
    let layout = card.feedback.as_ref()?;
    let axes = layout.axes.iter().map(|axis| {
        let index = card.outputs.get(usize::from(axis.output)).map_or(0, |output| output.channel);
        let (output, unit) = channel(&card.signals.reference, index);
        InspectedAxis {
            output,
            unit,
            errors: axis.errors.iter().map(|channels| error(card, *channels)).collect(),
            integral: axis.integral,
            fast_limit: axis.fast_limit,
            integral_limit: axis.integral_limit,
        }
    });
    Some(InspectedLane {
        lags: layout.lags,
        multiply_adds: model.feedback()?.multiply_adds(),
        margins: layout.margins,
        axes: axes.collect(),
    })
}
