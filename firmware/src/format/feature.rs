//! One network input as data; [`crate::features`] evaluates it.
//!
//! *in* the card's list; *out* values that name a signal, a channel and a time; *never* an evaluation; *source* Zhou 2017,
//! Insights 2 and 3.

use serde::{Deserialize, Serialize};

/// Where a feature's value comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Source {
    /// The desired trajectory.
    Desired,
    /// The measured signals.
    Measured,
    /// The reference that the loop received in the past.
    Reference,
}

/// What is subtracted from a feature: the same quantity, now.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Relative {
    /// Nothing: the absolute value.
    Nothing,
    /// The desired channel of this index, now.
    Desired(u8),
    /// The measured channel of this index, now.
    Measured(u8),
}

/// One network input.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Feature {
    /// Signal that is read.
    pub source: Source,
    /// Channel of that signal (index into the model's signal table).
    pub channel: u8,
    /// Time offset in sub-rate ticks; positive is the future (desired only).
    pub offset: i16,
    /// What is subtracted.
    pub relative: Relative,
}
