//! What a model says of itself: decoded from the file's card, small enough for RAM. Numbers in bulk stay in the blob.
//!
//! *in* the postcard bytes of a [`Card`]; *out* names, shapes, limits and [`Section`]s of the blob; *never* bulk data;
//! *source* the field list in the project's architecture: all that is needed to refuse a model.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::{
    Feature, Refusal, Source, file,
    limits::{
        DEFAULT_AXES, DEFAULT_CHANNELS, DEFAULT_OUTPUTS, MAX_AXES, MAX_CHANNELS, MAX_ERRORS, MAX_FEATURES, MAX_INPUTS,
        MAX_LAYERS, MAX_OUTPUTS,
    },
};

/// A piece of the blob: byte offset from the blob's start and length in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Section {
    /// Byte offset from the blob's start.
    pub offset: u32,
    /// Length in bytes.
    pub length: u32,
}

/// What a channel is before the first and after the last sample of the desired trajectory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum EndRule {
    /// The nearest sample is held (positions, angles).
    #[default]
    Hold,
    /// Zero (velocities, accelerations): the trajectory stands still beyond its ends.
    Zero,
}

/// One channel of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Channel<'a> {
    /// Name, for example `position.x`.
    pub name: &'a str,
    /// SI unit, for example `m/s`.
    pub unit: &'a str,
    /// Frame, for example `world ENU`.
    pub frame: &'a str,
    /// What the channel is beyond the trajectory's ends.
    pub end: EndRule,
}

/// The signals between which the model maps. An application refuses a model whose tables differ from its own.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SignalTable<'a, const C: usize = DEFAULT_CHANNELS> {
    /// Channels of the desired trajectory.
    #[serde(borrow)]
    pub desired: Vec<Channel<'a>, C>,
    /// Channels of the measured state.
    #[serde(borrow)]
    pub measured: Vec<Channel<'a>, C>,
    /// Channels of the reference; each has the name of the desired channel that it starts from.
    #[serde(borrow)]
    pub reference: Vec<Channel<'a>, C>,
}

/// The signals of an application, in its own order: what a model's [`SignalTable`] must say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Channels<'a> {
    /// Channels of the desired trajectory.
    pub desired: &'a [Channel<'a>],
    /// Channels of the measured state.
    pub measured: &'a [Channel<'a>],
    /// Channels of the reference; each has the name of the desired channel that it starts from.
    pub reference: &'a [Channel<'a>],
}

impl<'a, const C: usize> From<&'a SignalTable<'a, C>> for Channels<'a> {
    fn from(SignalTable { desired, measured, reference }: &'a SignalTable<'a, C>) -> Self {
        Self { desired, measured, reference }
    }
}

impl<'a> From<&Channels<'a>> for Channels<'a> {
    fn from(channels: &Channels<'a>) -> Self {
        *channels
    }
}

/// Where a model comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Provenance<'a> {
    /// Vehicle or plant.
    pub vehicle: &'a str,
    /// Gains of the baseline loop.
    pub gains: &'a str,
    /// Condition in which the logs were flown.
    pub condition: &'a str,
    /// Program and version that wrote the file.
    pub software: &'a str,
    /// Seed of the training run.
    pub seed: u64,
    /// CRC-32 of the training rows.
    pub data_crc: u32,
    /// Remarks: gates that were overridden, settings chosen.
    pub remarks: &'a str,
}

/// Between sub-rate ticks the correction is held or ramped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Interpolation {
    /// The value of the last sub-rate tick.
    Hold,
    /// A ramp from this sub-rate tick's value to the next one's, which is evaluated a sub-rate period ahead. The desired
    /// trajectory is known there; of measured channels and past references the newest stands in, so a model that reads them is
    /// better held.
    Linear,
}

/// Rates and delays.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// Rate of the reference, Hz.
    pub reference_rate_hz: f32,
    /// Reference ticks in a sub-rate tick of the network lane.
    pub divisor: u16,
    /// Held or ramped.
    pub interpolation: Interpolation,
    /// Age of the measured position when the loop receives it, in reference ticks (need not be whole).
    pub measurement_delay_ticks: f32,
    /// Time in which a lane is faded in or out, in reference ticks.
    pub fade_ticks: u16,
}

/// A corrected reference channel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// Reference channel.
    pub channel: u8,
    /// Largest absolute correction, in the channel's unit.
    pub limit: f32,
    /// Largest change of the correction in a reference tick, in the channel's unit.
    pub slew: f32,
}

/// Number format of the dense layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Arithmetic {
    /// f32 weights and activations.
    Float,
    /// int8 weights with a scale for each row, activations of at most 16 bits, 32-bit accumulators.
    Int8,
    /// The same with int16 weights.
    Int16,
}

/// Non-linearity behind a dense layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Activation {
    /// The identity.
    Linear,
    /// max(0, x).
    Relu,
    /// Hyperbolic tangent.
    Tanh,
}

/// One dense layer; the meaning of the sections follows from [`Arithmetic`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LayerLayout {
    /// Inputs.
    pub inputs: u16,
    /// Outputs.
    pub outputs: u16,
    /// Activation.
    pub activation: Activation,
    /// Integers only: largest magnitude of an input's code, 1..=32,767. The largest for which no accumulator can overflow is
    /// best.
    pub input_limit: u16,
    /// Biases, weights and requantisation of all rows: the stream in [`crate::network::kernel`].
    pub rows: Section,
}

/// The network: normalise, dense layers plus a linear skip from the normalised inputs, denormalise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NetworkLayout {
    /// Number format.
    pub arithmetic: Arithmetic,
    /// f32 pairs: mean and reciprocal scale of each input, all means first.
    pub input_normalisation: Section,
    /// Integers only: factor from a normalised input to its code.
    pub input_code: f32,
    /// Dense layers; empty for a purely linear model.
    pub layers: Vec<LayerLayout, MAX_LAYERS>,
    /// Skip from normalised inputs to normalised outputs, packed as a float layer without bias (zeros); empty: none.
    pub skip: Section,
    /// f32: scale of each output, then mean of each output.
    pub output_normalisation: Section,
}

/// One axis of the feedback lane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FeedbackAxis {
    /// Index into [`Card::outputs`].
    pub output: u8,
    /// Errors that the axis reads: (measured channel, desired channel).
    pub errors: Vec<(u8, u8), MAX_ERRORS>,
    /// f32: for each error its lags (newest first), then the lags of the axis' own past output (newest first).
    pub coefficients: Section,
    /// Factor of the integral of the first error, 1/s: value = integral coefficient × ∫ e dt.
    pub integral: f32,
    /// Clamp of the fast part, in the output's unit.
    pub fast_limit: f32,
    /// Clamp of the integral part, in the output's unit.
    pub integral_limit: f32,
}

/// Margins of the add-on's own loop, computed at design time on a model of longer memory than the one designed on. All finite: a
/// margin that nothing limits is `f32::MAX`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Margins {
    /// Further delay that the loop bears, ms: on the lane's way as designed and, where training had a vehicle to fly, of the
    /// whole loop, whichever is shorter.
    pub delay_ms: f32,
    /// Factor on the loop's gain that it bears.
    pub gain: f32,
    /// Smallest distance of the loop's frequency response from -1.
    pub modulus: f32,
}

/// How much of the fast clamps the lane may use, and how fast it integrates: 1 / (1 + v²), where v is the recent peak of
/// Σ channel² / scale² + Σ error² / error_scale² (of each axis the first error), which decays by `decay` each tick. The lane is
/// linear round calm flight: where much is desired of the loop, or where it has left the desired trajectory by more than a linear
/// loop would, it must not pull as hard. A vehicle whose motors saturate would else be pulled into a tumble.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Authority<const A: usize = DEFAULT_AXES> {
    /// Desired channels, for example the accelerations; none: full authority always.
    pub channels: Vec<u8, A>,
    /// Magnitude of the channels at which half of the clamp is left, in their unit.
    pub scale: f32,
    /// Magnitude of the errors at which half of the clamp is left, in the errors' unit.
    pub error_scale: f32,
    /// Factor on the recent peak in a reference tick, 0..1.
    pub decay: f32,
}

/// The feedback lane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FeedbackLayout<const A: usize = DEFAULT_AXES> {
    /// Lags of every error and of the past output.
    pub lags: u8,
    /// Axes.
    pub axes: Vec<FeedbackAxis, A>,
    /// Authority over the fast clamps.
    pub authority: Authority<A>,
    /// Worst margins over the axes.
    pub margins: Margins,
}

/// One axis of the monitor: how an error of the loop follows the corrections.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MonitorAxis {
    /// (measured channel, desired channel)
    pub error: (u8, u8),
    /// Indices into [`Card::outputs`]: the corrections that move the measured channel.
    pub inputs: Vec<u8, MAX_INPUTS>,
    /// f32: of each input the mean of the measured channel over each monitor tick, newest first, after a correction of 1 that
    /// lasts one monitor tick; in the measured channel's unit.
    pub taps: Section,
}

/// What the guard needs to tell whether the add-on does good: the error without it is the error less the loop's response to the
/// correction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MonitorLayout<const A: usize = DEFAULT_AXES> {
    /// Reference ticks in a monitor tick.
    pub divisor: u16,
    /// Monitor ticks that a response lasts.
    pub taps: u8,
    /// RMS over all axes of the error that validation flights showed with the add-on, in the errors' unit.
    pub validated_rms: f32,
    /// Axes; their errors have one unit.
    pub axes: Vec<MonitorAxis, A>,
}

/// Inputs with the exact outputs expected, re-run by every machine that loads the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Probes {
    /// Number of probes.
    pub count: u8,
    /// f32: `count` × features, then `count` × outputs of the network lane.
    pub network: Section,
    /// f32: the lane's output on each axis at the end of [`crate::feedback::PROBE_TICKS`] ticks of the standard error sequence.
    pub feedback: Section,
}

/// Everything about a model but its bulk numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Card<'a, const C: usize = DEFAULT_CHANNELS, const O: usize = DEFAULT_OUTPUTS, const A: usize = DEFAULT_AXES> {
    /// Name of the model.
    pub name: &'a str,
    /// Where it comes from.
    #[serde(borrow)]
    pub provenance: Provenance<'a>,
    /// Signals with units and frames.
    #[serde(borrow)]
    pub signals: SignalTable<'a, C>,
    /// Rates and delays.
    pub timing: Timing,
    /// Network inputs.
    pub features: Vec<Feature, MAX_FEATURES>,
    /// Corrected channels.
    pub outputs: Vec<Output, O>,
    /// Network lane.
    pub network: Option<NetworkLayout>,
    /// Feedback lane.
    pub feedback: Option<FeedbackLayout<A>>,
    /// The loop's response, by which the guard judges the lanes.
    pub monitor: Option<MonitorLayout<A>>,
    /// f32: smallest, then largest value of each feature in training.
    pub envelope: Section,
    /// f32: low, high, difference, lipschitz ([`super::OutputBounds`]) of each output; empty without a network.
    pub bounds: Section,
    /// Probes.
    pub probes: Probes,
}

/// A card of any size that a file can have.
pub type LargestCard<'a> = Card<'a, MAX_CHANNELS, MAX_OUTPUTS, MAX_AXES>;

impl<const C: usize, const O: usize, const A: usize> Card<'_, C, O, A> {
    /// Of no model.
    pub(crate) const fn empty() -> Self {
        let section = Section { offset: 0, length: 0 };
        Self {
            name: "",
            provenance: Provenance { vehicle: "", gains: "", condition: "", software: "", seed: 0, data_crc: 0, remarks: "" },
            signals: SignalTable { desired: Vec::new(), measured: Vec::new(), reference: Vec::new() },
            timing: Timing {
                reference_rate_hz: 0.0,
                divisor: 0,
                interpolation: Interpolation::Hold,
                measurement_delay_ticks: 0.0,
                fade_ticks: 0,
            },
            features: Vec::new(),
            outputs: Vec::new(),
            network: None,
            feedback: None,
            monitor: None,
            envelope: section,
            bounds: section,
            probes: Probes { count: 0, network: section, feedback: section },
        }
    }

    /// The oldest format version in which a model may have what this one has.
    pub fn version(&self) -> u16 {
        if self.beyond_version_2().is_none() { file::OLDEST_VERSION } else { file::VERSION }
    }

    /// What is more than a model of version 2 may have.
    pub(crate) fn beyond_version_2(&self) -> Option<Refusal> {
        let (signals, feedback) = (&self.signals, self.feedback.as_ref());
        let counts = [
            ("number of desired channels", signals.desired.len(), DEFAULT_CHANNELS),
            ("number of measured channels", signals.measured.len(), DEFAULT_CHANNELS),
            ("number of reference channels", signals.reference.len(), DEFAULT_CHANNELS),
            ("number of outputs", self.outputs.len(), DEFAULT_OUTPUTS),
            ("number of axes of the feedback lane", feedback.map_or(0, |lane| lane.axes.len()), DEFAULT_AXES),
            ("number of lane authority channels", feedback.map_or(0, |lane| lane.authority.channels.len()), DEFAULT_AXES),
            ("number of axes of the monitor", self.monitor.as_ref().map_or(0, |monitor| monitor.axes.len()), DEFAULT_AXES),
        ];
        let (what, found, limit) = counts.into_iter().find(|(_, found, limit)| found > limit)?;
        Some(Refusal::Shape { what, found: found as u32, limit: limit as u32 })
    }

    /// Reference ticks of the past and of the future that the features and the lane read.
    pub fn preview_span(&self) -> (u32, u32) {
        let divisor = u32::from(self.timing.divisor);
        let ahead = match self.timing.interpolation {
            Interpolation::Hold => 0,
            Interpolation::Linear => divisor,
        };
        let (mut past, mut future) = (self.timing.measurement_delay_ticks as u32 + 1, ahead);
        for feature in &self.features {
            let span = u32::from(feature.offset.unsigned_abs()) * divisor;
            if feature.source != Source::Desired {
                // Read from the adapter's own histories.
            } else if feature.offset < 0 {
                past = past.max(span);
            } else {
                future = future.max(span + ahead);
            }
        }
        (past, future)
    }
}
