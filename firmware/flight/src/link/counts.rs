//! What goes wrong on the link, by kind.
//!
//! *in* faults; *out* counts since the start; *never* a fault that is not counted.

use core::fmt;

use super::{VERSION, message::FrameReport, outcome::Reason};

/// Why a frame is not delivered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fault {
    /// The frame ends too early for its byte stuffing (COBS).
    Stuffing,
    /// Fewer bytes than a check sum and a header.
    Short,
    /// More bytes than any frame has; noticed at the first one too many.
    Long,
    /// The check sum is wrong.
    Checksum,
    /// Another protocol version.
    Version {
        /// The sender's version.
        found: u8,
    },
    /// The frame arrived as it was sent, but its message is refused: [`Reason::Undecodable`], or what the message's check says.
    Message {
        /// Sequence number of the frame.
        sequence: u8,
        /// What is wrong.
        reason: Reason,
    },
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stuffing => write!(f, "a frame with a byte missing or damaged: check the line and its baud rate"),
            Self::Short => write!(f, "a piece of a frame: check the line and its baud rate"),
            Self::Long => write!(f, "more bytes than any frame has: check that the other side speaks this protocol"),
            Self::Checksum => write!(f, "a damaged frame: check the line and its baud rate"),
            Self::Version { found } => {
                write!(f, "protocol version {found}, this build speaks {VERSION}: use the same on both sides")
            }
            Self::Message { sequence, reason } => write!(f, "frame {sequence}: {reason}"),
        }
    }
}

impl core::error::Error for Fault {}

/// Frames since the start, by what became of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Delivered.
    pub received: u32,
    /// [`Fault::Stuffing`].
    pub stuffing: u32,
    /// [`Fault::Short`].
    pub short: u32,
    /// [`Fault::Long`].
    pub long: u32,
    /// [`Fault::Checksum`].
    pub checksum: u32,
    /// [`Fault::Version`].
    pub version: u32,
    /// [`Fault::Message`].
    pub message: u32,
    /// Of those with a sequence number, came twice or after a younger one.
    pub reordered: u32,
    /// Missing when a younger one came. A frame that comes late is counted here, and as reordered when it comes.
    pub dropped: u32,
}

impl Counts {
    /// Frames that were not delivered, whatever the fault.
    pub fn damaged(&self) -> u32 {
        let Self { stuffing, short, long, checksum, version, message, .. } = *self;
        [short, long, checksum, version, message].iter().fold(stuffing, |sum, count| sum.saturating_add(*count))
    }

    /// The counts as telemetry reports them.
    pub fn report(&self) -> FrameReport {
        let Self { received, reordered, dropped, .. } = *self;
        FrameReport { received, damaged: self.damaged(), reordered, dropped }
    }

    pub(super) fn count(&mut self, fault: &Fault) {
        let count = match fault {
            Fault::Stuffing => &mut self.stuffing,
            Fault::Short => &mut self.short,
            Fault::Long => &mut self.long,
            Fault::Checksum => &mut self.checksum,
            Fault::Version { .. } => &mut self.version,
            Fault::Message { .. } => &mut self.message,
        };
        *count = count.saturating_add(1);
    }
}
