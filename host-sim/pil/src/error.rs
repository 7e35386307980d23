//! Why the microcontroller does not fly.

use impromptu_flight::link::Reason;
use impromptu_sim::rollout::RolloutError;

/// Why the microcontroller does not fly.
#[derive(Debug, thiserror::Error)]
pub enum PilError {
    /// The emulator or the firmware cannot be built or started.
    #[error(transparent)]
    Emulator(#[from] anyhow::Error),
    /// The flights cannot be flown, by the firmware or at all.
    #[error(transparent)]
    Rollout(#[from] RolloutError),
    /// The line to the firmware broke.
    #[error("the line to the firmware broke: {0}; the emulator said: {1}")]
    Line(std::io::Error, String),
    /// The firmware did not answer.
    #[error("the firmware did not answer {0}")]
    Silence(&'static str),
    /// The firmware refused a command.
    #[error("the firmware refuses {command}: {reason}")]
    Refused {
        /// What it was told.
        command: &'static str,
        /// Why it does not obey.
        reason: Reason,
    },
    /// The firmware flies another model than it was given.
    #[error("the firmware flies model {found}, not {expected}: build it anew")]
    Model {
        /// Check sum that was expected.
        expected: String,
        /// Check sum that it names.
        found: String,
    },
}
