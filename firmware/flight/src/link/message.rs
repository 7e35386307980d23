//! What is said over the link.
//!
//! *in/out* values of the crate, as the two enums below list them; *never* a message whose meaning rests on an earlier one's
//! arrival, but for the upload of a model, which says where each piece belongs.

mod command;
mod learning;
mod report;

use serde::{Deserialize, Serialize};

use super::outcome::{Outcome, Reason};
use impromptu_firmware::adapter::Lanes;

use crate::settings::Settings;

pub use command::{Inertial, ModelChunk, Position, TimedSetpoint};
pub use learning::{LearnOrder, LearnedPiece, LearningReport};
pub use report::{FlyingModel, FrameReport, Identity, InputReport, LaneReport, Motors, TRIP_REASONS, Telemetry};

/// A message of either direction.
pub trait Message: Serialize {
    /// Whether it may be delivered.
    ///
    /// # Errors
    /// What is wrong with it.
    fn check(&self) -> Result<(), Reason>;

    /// Whether a conversation starts with it, so that sequence numbers count from here.
    fn opens(&self) -> bool;
}

/// Which way messages go.
pub trait Direction {
    /// The messages, which borrow bytes and names from the frame.
    type Message<'a>: Message + Deserialize<'a>;
}

/// To the vehicle.
#[derive(Clone, Copy, Debug)]
pub enum Commands {}

impl Direction for Commands {
    type Message<'a> = Command<'a>;
}

/// From the vehicle.
#[derive(Clone, Copy, Debug)]
pub enum Reports {}

impl Direction for Reports {
    type Message<'a> = Report<'a>;
}

/// A message to the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Command<'a> {
    /// Asks for [`Report::Identity`]; the receiver counts sequence numbers from here.
    Hello,
    /// Attitude and rates, at every control tick.
    Inertial(Inertial),
    /// Position and velocity, at every reference tick.
    Position(Position),
    /// One sample of the desired trajectory.
    Setpoint(TimedSetpoint),
    /// Settings of the flight stack.
    Settings(Settings),
    /// Which lanes of the add-on act.
    Lanes(Lanes),
    /// Motors on.
    Arm,
    /// Motors off.
    Disarm,
    /// A model file follows.
    ModelBegin {
        /// Length of the file in bytes.
        length: u32,
        /// CRC-32/ISO-HDLC of the whole file.
        checksum: u32,
    },
    /// A piece of the model file.
    #[serde(borrow)]
    ModelChunk(ModelChunk<'a>),
    /// The file is complete: check it, and fly it from now on.
    ModelCommit,
    /// The first setpoint of another trajectory, which replaces what is stored from its tick on; the next ones follow as
    /// [`Command::Setpoint`]. The vehicle goes from one to the other without a jump.
    Replan(TimedSetpoint),
    /// Come to rest from where the trajectory is now, and stay there until a [`Command::Replan`].
    Brake,
    /// What the vehicle that learns shall do.
    Learn(LearnOrder),
    /// Asks for what was learned, from this byte of it on: a disarmed vehicle answers with [`Report::Learned`].
    Learned {
        /// Bytes from the start.
        offset: u32,
    },
}

/// A message from the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Report<'a> {
    /// The answer to [`Command::Hello`]; the receiver counts sequence numbers from here.
    #[serde(borrow)]
    Identity(Identity<'a>),
    /// What the motors got, at every control tick.
    Motors(Motors),
    /// How the vehicle is.
    Telemetry(Telemetry),
    /// What became of a command.
    Acknowledge {
        /// Sequence number of the command's frame.
        sequence: u8,
        /// What became of it.
        outcome: Outcome,
    },
    /// What became of what it was told; with each telemetry.
    Inputs(InputReport),
    /// How far a vehicle that learns is; with each telemetry.
    Learning(LearningReport),
    /// A piece of what was learned.
    #[serde(borrow)]
    Learned(LearnedPiece<'a>),
}
