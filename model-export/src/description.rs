//! What a network does not say of itself: signals, features, rates, limits, feedback lane, monitor, provenance.
//!
//! Stored as JSON beside the float network, so that other tools can read and write both.

use impromptu_firmware::{
    features::Feature,
    model::{self, Channel, Interpolation, Output},
    preview::EndRule,
};
use serde::{Deserialize, Serialize};

use crate::float_network::FloatNetwork;

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

impl<const C: usize> From<&model::SignalTable<'_, C>> for Signals {
    fn from(table: &model::SignalTable<'_, C>) -> Self {
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

/// Which network and rows a description belongs to: CRC-32 of their numbers, whatever else a file says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tie {
    /// Of the network: widths, activations and every tensor.
    pub network_crc32: u32,
    /// Of the calibration rows.
    pub rows_crc32: u32,
}

impl Tie {
    /// Of a network and its rows.
    pub fn of(network: &FloatNetwork, rows: &[Vec<f32>]) -> Self {
        Self { network_crc32: network_crc32(network), rows_crc32: rows_crc32(rows) }
    }

    /// What of a network and rows is not what the description belongs to; rows that nobody calibrates on are not asked for.
    pub fn differs(self, network: &FloatNetwork, rows: &[Vec<f32>]) -> Option<&'static str> {
        if self.network_crc32 != network_crc32(network) {
            Some("network's numbers")
        } else if !rows.is_empty() && self.rows_crc32 != rows_crc32(rows) {
            Some("calibration rows")
        } else {
            None
        }
    }
}

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

fn network_crc32(network: &FloatNetwork) -> u32 {
    let mut digest = CRC.digest();
    let mut add = |values: &[f32]| {
        // The lengths too, so that a number cannot wander from one tensor to the next.
        digest.update(&(values.len() as u64).to_le_bytes());
        values.iter().for_each(|value| digest.update(&value.to_le_bytes()));
    };
    add(&network.input_mean);
    add(&network.input_scale);
    for layer in &network.layers {
        add(&layer.weights);
        add(&layer.bias);
        add(&[f32::from(layer.activation as u8)]);
    }
    add(network.skip.as_deref().unwrap_or_default());
    add(&network.output_mean);
    add(&network.output_scale);
    digest.finalize()
}

fn rows_crc32(rows: &[Vec<f32>]) -> u32 {
    let mut digest = CRC.digest();
    for value in rows.iter().flatten() {
        digest.update(&value.to_le_bytes());
    }
    digest.finalize()
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
    /// The network and rows that this is the description of. Descriptions of other tools and older ones do not say so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tie: Option<Tie>,
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
