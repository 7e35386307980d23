//! Which channels a model of a loop maps between.
//!
//! *in* a description; *out* signals of the model, and the channels of each axis in them; *never* more channels than the format
//! holds; *source* the signal table of the model format.

use impromptu_firmware::model::{EndRule, MAX_CHANNELS};
use impromptu_model_export::description::{ChannelDescription, Signals};

use crate::description::LoopDescription;

/// Channels of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AxisChannels {
    /// Desired position, velocity and acceleration.
    pub desired: [Option<u8>; 3],
    /// Measured position and velocity.
    pub measured: [Option<u8>; 2],
    /// References of position, velocity and acceleration.
    pub reference: [Option<u8>; 3],
}

/// Writes values into channels; what an axis has no channel for is left out.
pub fn write(into: &mut [f32; MAX_CHANNELS], channels: &[Option<u8>], values: &[f64]) {
    for (channel, value) in channels.iter().zip(values) {
        if let Some(channel) = channel {
            into[usize::from(*channel)] = *value as f32;
        }
    }
}

/// Signals of a loop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Tables of the model.
    pub signals: Signals,
    /// Channels of each axis in them.
    pub axes: Vec<AxisChannels>,
}

/// A loop of more channels than the format holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the loop has {found} channels of one kind, a model holds {MAX_CHANNELS}: leave velocity or feed-forward of some axes out"
)]
pub struct TooManyChannels {
    /// Channels.
    pub found: usize,
}

impl Layout {
    /// Of a described loop: of each axis its position, its velocity where that is measured or part of the reference, its
    /// acceleration where that is fed forward.
    ///
    /// # Errors
    /// If there are more channels than a model holds.
    pub fn of(described: &LoopDescription) -> Result<Self, TooManyChannels> {
        let mut signals = Signals::default();
        let mut axes = Vec::new();
        for axis in &described.axes {
            let channel = |table: &mut Vec<ChannelDescription>, derivative: usize, wanted: bool| {
                let (name, unit, end) = match derivative {
                    0 => (axis.name.clone(), axis.unit.clone(), EndRule::Hold),
                    1 => (format!("{}.velocity", axis.name), format!("{}/s", axis.unit), EndRule::Zero),
                    _ => (format!("{}.acceleration", axis.name), format!("{}/s^2", axis.unit), EndRule::Zero),
                };
                wanted.then(|| {
                    table.push(ChannelDescription { name, unit, frame: axis.frame.clone(), end });
                    (table.len() - 1) as u8
                })
            };
            let (told, seen) = (axis.accepts, axis.velocity.is_some());
            let velocity = told.velocity() || seen;
            let wanted = [true, velocity, told.feed_forward()];
            let desired = [0, 1, 2].map(|derivative| channel(&mut signals.desired, derivative, wanted[derivative]));
            let measured = [0, 1].map(|derivative| channel(&mut signals.measured, derivative, [true, seen][derivative]));
            let accepted = [true, told.velocity(), told.feed_forward()];
            let reference = [0, 1, 2].map(|derivative| channel(&mut signals.reference, derivative, accepted[derivative]));
            axes.push(AxisChannels { desired, measured, reference });
        }
        let found = signals.desired.len().max(signals.measured.len()).max(signals.reference.len());
        if found > MAX_CHANNELS { Err(TooManyChannels { found }) } else { Ok(Self { signals, axes }) }
    }
}
