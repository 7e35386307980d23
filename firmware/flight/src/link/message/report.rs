//! What reports carry.
//!
//! *in/out* the crate's values as plain numbers, SI units, world ENU; *never* a name that makes a frame too long, or a number
//! that the receiver refuses.

use impromptu_firmware::math::finite_or_zero;
use serde::{Deserialize, Serialize};

use crate::{
    link::VERSION,
    types::{MotorCommand, Reference, Tick},
};

/// Reasons for which a lane can trip, each with a count in [`LaneReport`].
pub const TRIP_REASONS: usize = 8;

/// Who answers. The names are at most [`Identity::NAME`] bytes each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity<'a> {
    /// [`VERSION`] of the vehicle.
    pub link_version: u8,
    /// Name and version of its software.
    pub software: &'a str,
    /// The model that flies; `None`: the baseline alone.
    #[serde(borrow)]
    pub model: Option<FlyingModel<'a>>,
}

impl<'a> Identity<'a> {
    /// Most bytes of a name.
    pub const NAME: usize = 96;

    /// An identity whose names are cut to what fits.
    pub fn new(software: &'a str, model: Option<FlyingModel<'a>>) -> Self {
        let model = model.map(|model| FlyingModel { name: cut(model.name), ..model });
        Self { link_version: VERSION, software: cut(software), model }
    }
}

/// The start of a name, which ends between two characters.
fn cut(name: &str) -> &str {
    (0..=Identity::NAME.min(name.len())).rev().find_map(|end| name.get(..end)).unwrap_or_default()
}

/// The model that flies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FlyingModel<'a> {
    /// Its name.
    pub name: &'a str,
    /// Check sum of its file ([`impromptu_firmware::model::file::checksum`]).
    pub checksum: u32,
    /// The flash slot that it is in; `None`: a part of the firmware.
    pub slot: Option<u8>,
}

/// What the motors got.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motors {
    /// Control tick.
    pub tick: u32,
    /// Fractions of the largest rotor speed, 0..=1.
    pub fractions: [f32; 4],
    /// The reference that the loop tracks: position, m, then velocity, m/s, world ENU.
    pub reference: [f32; 6],
}

impl Motors {
    /// The answer to a control tick.
    pub fn new(Tick(tick): Tick, command: &MotorCommand, reference: &Reference) -> Self {
        let Reference { position: p, velocity: v, .. } = reference;
        Self { tick, fractions: command.fractions(), reference: [p.x, p.y, p.z, v.x, v.y, v.z].map(finite_or_zero) }
    }

    /// The motor command.
    pub fn command(&self) -> MotorCommand {
        MotorCommand::saturated(self.fractions)
    }
}

/// How a lane is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LaneReport {
    /// How much of its correction acts: 0 none, 1 all.
    pub weight: f32,
    /// Trips since the start, by reason.
    pub trips: [u16; TRIP_REASONS],
}

/// How the link is, as the vehicle sees it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameReport {
    /// Commands that were delivered.
    pub received: u32,
    /// Frames that were refused, whatever the fault.
    pub damaged: u32,
    /// Frames that came twice, or after a younger one.
    pub reordered: u32,
    /// Frames that were missing when a younger one came.
    pub dropped: u32,
}

/// What became of what the vehicle was told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputReport {
    /// Control tick.
    pub tick: u32,
    /// States that were refused behind the line since the start: from the future, or such that no vehicle is in.
    pub refused: u32,
    /// How many setpoints lie ahead of the one that is flown; negative: the trajectory has ended.
    pub reach: i32,
    /// Whether the vehicle brakes, or rests where it has braked.
    pub braking: bool,
}

/// How the vehicle is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Telemetry {
    /// Control tick.
    pub tick: u32,
    /// Whether motors may turn.
    pub armed: bool,
    /// The network lane.
    pub network: LaneReport,
    /// The feedback lane.
    pub feedback: LaneReport,
    /// Inferences that were not ready when they were due.
    pub late_inferences: u32,
    /// Control ticks with a correction or a motor at its limit.
    pub saturations: u32,
    /// The link.
    pub frames: FrameReport,
    /// Tracking error, m, over the last second.
    pub tracking_error: f32,
    /// Largest cost of a control tick, in instructions or cycles as the board counts.
    pub control_max: u32,
    /// Largest cost of an inference, in the same unit.
    pub inference_max: u32,
    /// High-water mark of the stack, bytes.
    pub stack_bytes: u32,
    /// Largest delay from the control tick's interrupt to its task, in the same unit.
    pub entry_latency_max: u32,
    /// Control ticks that were late.
    pub deadline_misses: u32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn names_are_cut_between_characters(name in "\\PC{0,120}") {
            let identity = Identity::new(&name, None);
            prop_assert!(name.starts_with(identity.software));
            prop_assert!(identity.software == name || identity.software.len() + 4 > Identity::NAME);
        }
    }
}
