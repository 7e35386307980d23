//! What becomes of a command.
//!
//! *in* a decision of the vehicle; *out* a code of a few bytes, which the host turns into a sentence; *never* a refusal without
//! its reason.

use core::fmt;

use serde::{Deserialize, Serialize};

use super::CHUNK;
use impromptu_firmware::{learning::Problem, model::Refusal};

use crate::{
    settings::Setting,
    types::{ACCELERATION_LIMIT, POSITION_LIMIT, RATE_LIMIT, VELOCITY_LIMIT, YAW_LIMIT},
};

/// What became of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Outcome {
    /// It was carried out.
    Done,
    /// It changed nothing.
    Refused(Reason),
}

/// Why a message is refused. `Display` also says what to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Reason {
    /// The frame is whole, but holds no message that this build knows.
    Undecodable,
    /// A number is NaN or infinite.
    NotFinite,
    /// The quaternion's length is not 1.
    Attitude,
    /// A motor fraction is outside of 0..=1.
    Fractions,
    /// Not while armed.
    Armed,
    /// Not while disarmed.
    NotArmed,
    /// The vehicle does not know where it is, or what it knows is too old.
    NoState,
    /// The flight stack cannot run with these settings.
    Settings,
    /// Not the next setpoint.
    Setpoint {
        /// Reference tick that is expected.
        expected: i32,
    },
    /// There is no model, or no upload was begun.
    NoModel,
    /// Too many bytes.
    Length {
        /// Most that fit.
        limit: u32,
    },
    /// Not the next piece of the model file.
    Offset {
        /// Offset that is expected.
        expected: u32,
    },
    /// The bytes that arrived are not those announced.
    Checksum {
        /// Check sum of what arrived.
        computed: u32,
    },
    /// The flash could not be written.
    Storage,
    /// The model file arrived whole, but is not flown.
    Model(ModelFault),
    /// A piece of a model is in work, or a new model waits for the restart.
    Busy,
    /// No vehicle has this setting, or this board another one ([`Setting::ControlRate`]); the settings stay as they were.
    Setting {
        /// Which one.
        what: Setting,
    },
    /// No vehicle measures such a number, or can be asked for it.
    Range {
        /// Which one.
        what: Quantity,
    },
    /// The vehicle brakes, or rests where it has braked.
    Braking,
    /// This firmware has no learner, or the gains are those of a loop beside which it cannot learn.
    NoLearner,
    /// The learner cannot do it.
    Learner(Problem),
}

/// What a number of a state or a setpoint is of. New ones come last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Quantity {
    /// At most [`POSITION_LIMIT`].
    Position,
    /// At most [`VELOCITY_LIMIT`].
    Velocity,
    /// At most [`ACCELERATION_LIMIT`].
    Acceleration,
    /// At most [`RATE_LIMIT`].
    Rates,
    /// At most [`YAW_LIMIT`].
    Yaw,
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Position => write!(f, "a position beyond {POSITION_LIMIT} m"),
            Self::Velocity => write!(f, "a velocity beyond {VELOCITY_LIMIT} m/s"),
            Self::Acceleration => write!(f, "an acceleration beyond {ACCELERATION_LIMIT} m/s²"),
            Self::Rates => write!(f, "a body rate beyond {RATE_LIMIT} rad/s"),
            Self::Yaw => write!(f, "a yaw beyond {YAW_LIMIT} rad"),
        }
    }
}

/// Why a model is not flown: [`Refusal`] without what only the file's maker needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum ModelFault {
    /// Not a model file, or a damaged one.
    Damaged,
    /// Another format version.
    Version {
        /// Version in the file.
        found: u16,
    },
    /// The file contradicts itself or does not fit this build.
    Content,
    /// A probe gave other bits than the file says.
    Probe {
        /// Index of the probe; `u8::MAX` for the feedback lane's.
        index: u8,
    },
    /// It is for other signals.
    Signal {
        /// First channel that differs.
        channel: u8,
    },
    /// It looks further ahead than the vehicle's preview.
    Preview {
        /// Samples that the model needs.
        needed: u32,
    },
    /// It is for references at another rate.
    Rate,
}

impl From<&Refusal> for ModelFault {
    fn from(refusal: &Refusal) -> Self {
        match *refusal {
            Refusal::TooShort { .. } | Refusal::NotAModel | Refusal::Length { .. } | Refusal::Checksum { .. } => Self::Damaged,
            Refusal::Version { found, .. } => Self::Version { found },
            Refusal::Probe { index } => Self::Probe { index },
            Refusal::Signal { channel, .. } => Self::Signal { channel },
            Refusal::Preview { needed, .. } => Self::Preview { needed },
            Refusal::Rate { .. } => Self::Rate,
            _ => Self::Content,
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Undecodable => write!(f, "the message is not known there: use the same version on both sides of the link"),
            Self::NotFinite => write!(f, "the message holds a number that is not finite: check what computes it"),
            Self::Attitude => write!(f, "the attitude is not a unit quaternion (to 1e-3): normalise it before it is sent"),
            Self::Fractions => write!(f, "a motor fraction is outside of 0..1: do not fly, report it"),
            Self::Armed => write!(f, "the vehicle is armed: disarm first"),
            Self::NotArmed => write!(f, "the vehicle is disarmed: arm first"),
            Self::NoState => write!(f, "the vehicle has no recent state: send attitude and position first, and keep sending"),
            Self::Settings => write!(f, "the flight stack cannot run with these settings: check airframe and rates"),
            Self::Setpoint { expected } => write!(f, "reference tick {expected} is next: send the setpoints in order from there"),
            Self::NoModel => write!(f, "there is no model: begin an upload first"),
            Self::Length { limit } if *limit == CHUNK as u32 => write!(f, "a piece of the model has at most {limit} bytes"),
            Self::Length { limit } => write!(f, "the model does not fit: at most {limit} bytes, train a smaller one"),
            Self::Offset { expected } => write!(f, "byte {expected} of the model is next: send the pieces in order from there"),
            Self::Checksum { computed } => {
                write!(f, "the model arrived with check sum {computed:08x}, not the one announced: upload it again")
            }
            Self::Storage => write!(f, "the flash could not be written: upload again; if it stays so, the flash is worn out"),
            Self::Model(fault) => write!(f, "the model is not flown: {fault}"),
            Self::Busy => {
                write!(f, "a piece of a model is being stored, or a new model waits for the restart: say it again later")
            }
            Self::Setting { what: Setting::ControlRate } => {
                write!(f, "the control rate is not the board's, or none that a loop has: send the board's")
            }
            Self::Setting { what } => write!(f, "no vehicle has this {}: correct it, nothing was changed", what.name()),
            Self::Range { what } => write!(f, "{what}: check its unit and what computes it; the sample counts as lost"),
            Self::Braking => write!(f, "the vehicle has braked: begin another trajectory with a re-plan"),
            Self::NoLearner => write!(
                f,
                "the vehicle does not learn: give its firmware a learner, and its position loop gains of second order (kp and kd)"
            ),
            Self::Learner(problem) => problem.fmt(f),
        }
    }
}

impl core::error::Error for Reason {}

impl fmt::Display for ModelFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Damaged => write!(f, "not a model file, or a damaged one: upload the file that model-export wrote"),
            Self::Version { found } => {
                write!(f, "format version {found}, the vehicle reads another: export it for the vehicle's")
            }
            Self::Content => write!(f, "the file contradicts itself or does not fit: load it on the host, which names the field"),
            Self::Probe { index: u8::MAX } => write!(f, "the feedback lane gives other bits there: do not fly, report it"),
            Self::Probe { index } => write!(f, "probe {index} gives other bits there: do not fly, report it"),
            Self::Signal { channel } => {
                write!(f, "channel {channel} of a signal differs from the vehicle's: train for this vehicle")
            }
            Self::Preview { needed } => {
                write!(f, "it looks at {needed} samples, more than the vehicle keeps: shorten its window")
            }
            Self::Rate => write!(f, "it is for references at another rate: train it at the vehicle's"),
        }
    }
}
