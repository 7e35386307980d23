//! What a learning add-on is told, and how far it is.
//!
//! *in/out* plain values; *never* a problem without what to do about it; *source* ours.

use core::fmt;

use super::{
    commission::{Probe, Unfit},
    response::Response,
    values::Limits,
};

/// What is known of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisSettings {
    /// How the loop answers; `None`: it is to be measured.
    pub response: Option<Response>,
    /// What a correction may be.
    pub limits: Limits,
    /// How a response is measured.
    pub probe: Probe,
}

impl AxisSettings {
    /// Of no axis.
    pub(super) const NONE: Self = Self {
        response: None,
        limits: Limits { scale: 0.0, correction: 0.0, feedback: 0.0, rate: 0.0 },
        probe: Probe { size: 0.0, seconds: 0.0 },
    };
}

/// What the add-on does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(serde::Serialize, serde::Deserialize)]
pub enum Phase {
    /// Nothing.
    #[default]
    Off,
    /// It measures the responses.
    Commissioning,
    /// It learns and corrects.
    Learning,
    /// It corrects by what it has learned.
    Holding,
}

/// Why it does not do what it was told to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub enum Problem {
    /// The response of an axis is neither given nor measured.
    Unknown {
        /// Axis.
        axis: u8,
    },
    /// The loop does not move the machine, as on the ground.
    Grounded,
    /// The desired trajectory moved while the responses were measured, or for half a minute before.
    Moving,
    /// Ticks were left out while the responses were measured.
    Gap,
    /// No response fits what an axis did.
    Unfit {
        /// Axis.
        axis: u8,
        /// Why.
        why: Unfit,
    },
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown { axis } => write!(f, "axis {axis}: the response is not known: commission first, or give one"),
            Self::Grounded => f.write_str("the loop does not move the machine: take off, or switch it on, then commission"),
            Self::Moving => f.write_str("the trajectory does not rest: hover, or stand still, then commission"),
            Self::Gap => f.write_str("ticks were left out while the responses were measured: commission again"),
            Self::Unfit { axis, why } => write!(f, "axis {axis}: {why}"),
        }
    }
}

impl core::error::Error for Problem {}

/// How far it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    /// What it does.
    pub phase: Phase,
    /// Of commissioning, 0..1.
    pub commissioned: f32,
    /// Seconds in motion learned from, of the axis with the least.
    pub learned_s: f32,
    /// Share of the correction that acts, 0..1, of the axis with the least.
    pub share: f32,
    /// How often what was learned was forgotten because it did harm.
    pub forgotten: u16,
    /// What went wrong last.
    pub problem: Option<Problem>,
}
