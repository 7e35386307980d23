//! What a network does not say of itself: signals, features, rates, limits, feedback lane, monitor, provenance.
//!
//! Stored as JSON beside the float network, so that other tools can read and write both.

use impromptu_firmware::{
    features::Feature,
    model::{self, Channel, Interpolation, Output},
    preview::EndRule,
};
use serde::{Deserialize, Serialize};

/// One channel of a signal.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChannelDescription {
    /// Name, for example `position.x`.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Frame.
    pub frame: String,
    /// What the channel is beyond the trajectory's ends.
    pub end: EndRule,
}

/// The signals between which the model maps.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Signals {
    /// Channels of the desired trajectory.
    pub desired: Vec<ChannelDescription>,
    /// Channels of the measured state.
    pub measured: Vec<ChannelDescription>,
    /// Channels of the reference.
    pub reference: Vec<ChannelDescription>,
}

impl From<&model::SignalTable<'_>> for Signals {
    fn from(table: &model::SignalTable<'_>) -> Self {
        (&model::Channels::from(table)).into()
    }
}

impl From<&model::Channels<'_>> for Signals {
    fn from(table: &model::Channels<'_>) -> Self {
        let owned = |channels: &[Channel<'_>]| {
            channels
                .iter()
                .map(|channel| ChannelDescription {
                    name: channel.name.into(),
                    unit: channel.unit.into(),
                    frame: channel.frame.into(),
                    end: channel.end,
                })
                .collect()
        };
        Self { desired: owned(table.desired), measured: owned(table.measured), reference: owned(table.reference) }
    }
}

/// Where a model comes from.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// Vehicle or plant.
    pub vehicle: String,
    /// Gains of the baseline loop.
    pub gains: String,
    /// Condition in which the logs were flown.
    pub condition: String,
    /// Program and version that wrote it.
    pub software: String,
    /// Seed of the training run.
    pub seed: u64,
    /// CRC-32 of the training rows.
    pub data_crc: u32,
    /// Remarks: gates that were overridden, settings chosen, why there is no feedback lane.
    pub remarks: String,
}

/// Rates and delays.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Timing {
    /// Rate of the reference, Hz.
    pub reference_rate_hz: f32,
    /// Reference ticks in a sub-rate tick.
    pub divisor: u16,
    /// Held or ramped.
    pub interpolation: Interpolation,
    /// Age of the measured position when the loop receives it, s.
    pub measurement_delay_s: f32,
    /// Time in which a lane is faded in or out, s.
    pub fade_s: f32,
}

/// One axis of the feedback lane, in real coefficients.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LaneAxisDescription {
    /// Index into [`Description::outputs`].
    pub output: u8,
    /// Errors that the axis reads: (measured channel, desired channel).
    pub errors: Vec<(u8, u8)>,
    /// For each error its lags, newest first.
    pub error_coefficients: Vec<Vec<f32>>,
    /// Lags of the axis' own past output, newest first.
    pub output_coefficients: Vec<f32>,
    /// Factor of the integral of the first error, 1/s.
    pub integral: f32,
    /// Clamp of the fast part, in the output's unit.
    pub fast_limit: f32,
    /// Clamp of the integral part, in the output's unit.
    pub integral_limit: f32,
}

/// Authority of the lane over its fast clamps: see [`model::Authority`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AuthorityDescription {
    /// Desired channels; none: full authority always.
    pub channels: Vec<u8>,
    /// Magnitude of the channels at which half of the clamp is left, in their unit.
    pub scale: f32,
    /// Magnitude of the errors at which half of the clamp is left, in the errors' unit.
    pub error_scale: f32,
    /// Factor on the recent peak in a reference tick, 0..1.
    pub decay: f32,
}

impl Default for AuthorityDescription {
    /// Full authority always.
    fn default() -> Self {
        Self { channels: Vec::new(), scale: 1.0, error_scale: f32::MAX, decay: 0.0 }
    }
}

/// The feedback lane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LaneDescription {
    /// Axes.
    pub axes: Vec<LaneAxisDescription>,
    /// Authority over the fast clamps.
    #[serde(default)]
    pub authority: AuthorityDescription,
    /// Worst margins over the axes.
    pub margins: model::Margins,
}

/// One axis of the monitor: how an error of the loop follows the corrections.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MonitorAxisDescription {
    /// (measured channel, desired channel)
    pub error: (u8, u8),
    /// Indices into [`Description::outputs`]: the corrections that move the measured channel.
    pub inputs: Vec<u8>,
    /// For each input the mean of the measured channel over each monitor tick, newest first, after a correction of 1 that lasts
    /// one monitor tick.
    pub taps: Vec<Vec<f32>>,
}

/// The loop's response to corrections, from which the guard tells whether the add-on does good: see [`model::MonitorLayout`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MonitorDescription {
    /// Reference ticks in a monitor tick.
    pub divisor: u16,
    /// RMS over all axes of the error that validation flights showed with the add-on, in the errors' unit. Older files call
    /// it `promise`.
    #[serde(alias = "promise")]
    pub validated_rms: f32,
    /// Axes; their errors have one unit.
    pub axes: Vec<MonitorAxisDescription>,
}

/// Everything about a model but the network's tensors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// Name of the model.
    pub name: String,
    /// Where it comes from.
    pub provenance: Provenance,
    /// Signals with units and frames.
    pub signals: Signals,
    /// Rates and delays.
    pub timing: Timing,
    /// Network inputs, in the order of the network's input tensors.
    pub features: Vec<Feature>,
    /// Corrected channels, in the order of the network's output tensors.
    pub outputs: Vec<Output>,
    /// Smallest and largest value of each feature in training.
    pub envelope: Vec<(f32, f32)>,
    /// Feedback lane, if there is one. Older files call it `lane`.
    #[serde(alias = "lane")]
    pub feedback_lane: Option<LaneDescription>,
    /// The loop's response, if it is known: without it the guard cannot judge by evidence.
    #[serde(default)]
    pub monitor: Option<MonitorDescription>,
}

impl Description {
    /// Reads a description.
    ///
    /// # Errors
    /// With line, column and field of what is wrong.
    pub fn from_json(text: &str) -> Result<Self, serde_json::Error> {
        serde_json::from_str(text)
    }

    /// The description as JSON text.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}
