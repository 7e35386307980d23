//! Why a model is not stored, or a slot not read.
//!
//! *in* what a check or the flash driver found; *out* a sentence that says what to do; *never* an error after which the other
//! slot's model is lost; *source* the checks of [`super::Uploader`] and [`super::Stored`].

use core::fmt;

use embedded_storage::nor_flash::{NorFlashError, NorFlashErrorKind};

use crate::format::Refusal;

/// What the flash was asked to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Operation {
    /// Erase the slot.
    Erase,
    /// Program a part of the model file.
    WriteModel,
    /// Program the header, which makes the slot the newest.
    WriteHeader,
    /// Program a record of a journal.
    WriteRecord,
}

impl fmt::Display for Operation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Erase => "erasing a slot",
            Self::WriteModel => "writing the model",
            Self::WriteHeader => "writing the slot's header",
            Self::WriteRecord => "writing a record",
        })
    }
}

/// The reason, with what was found and expected. `Display` also says what to do. Whatever the reason, the model in the other slot
/// is untouched.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StorageError {
    /// The motors may turn.
    Armed,
    /// No upload has begun, or it was given up after an error.
    NotBegun,
    /// The model does not fit into a slot.
    TooLong {
        /// Length of the file, bytes.
        length: u32,
        /// Longest file that fits, bytes.
        room: u32,
    },
    /// A chunk is missing.
    Gap {
        /// Offset of the next byte that is expected.
        expected: u32,
        /// Offset of the chunk.
        found: u32,
    },
    /// A chunk reaches beyond the announced length.
    Overrun {
        /// Offset behind the chunk's last byte.
        end: u64,
        /// Announced length, bytes.
        length: u32,
    },
    /// Bytes are missing at the end.
    Incomplete {
        /// Bytes received.
        received: u32,
        /// Announced length, bytes.
        length: u32,
    },
    /// The flash holds other bytes than were announced.
    Checksum {
        /// Check sum that the upload announced.
        announced: u32,
        /// Check sum of what the flash holds.
        computed: u32,
    },
    /// The model is not for this machine or this application.
    Refused(Refusal),
    /// The other slot flies and this one now holds the newest model: there is no slot left to write.
    Restart,
    /// The driver of the flash reports an error.
    Flash {
        /// What it was asked to do.
        operation: Operation,
        /// The driver's error.
        #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
        kind: NorFlashErrorKind,
    },
    /// The flash does not hold the header that was written.
    ReadBack,
    /// The slot holds no model.
    Empty,
    /// The slot's header is damaged.
    Torn,
    /// The slot has another layout.
    Layout {
        /// Layout version in the slot.
        found: u32,
        /// Layout version that this build reads.
        expected: u16,
    },
    /// The header announces more bytes than the slot has.
    Length {
        /// Announced length, bytes.
        length: u32,
    },
    /// The header was written for another model than the slot holds.
    Mixed {
        /// Check sum in the header.
        header: u32,
        /// Check sum of the model.
        computed: u32,
    },
}

impl StorageError {
    pub(super) fn flash(operation: Operation, error: &impl NorFlashError) -> Self {
        Self::Flash { operation, kind: error.kind() }
    }
}

impl From<Refusal> for StorageError {
    fn from(refusal: Refusal) -> Self {
        Self::Refused(refusal)
    }
}

impl fmt::Display for StorageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Armed => write!(f, "armed: disarm before a model is written"),
            Self::NotBegun => write!(f, "no upload has begun, or it was given up: begin it again"),
            Self::TooLong { length, room } => {
                write!(f, "a model of {length} bytes does not fit into a slot of {room}: train a smaller one")
            }
            Self::Gap { expected, found } => {
                write!(f, "a chunk at offset {found} came, {expected} is next: send from {expected}")
            }
            Self::Overrun { end, length } => {
                write!(f, "a chunk ends at offset {end}, {length} bytes were announced: begin the upload again")
            }
            Self::Incomplete { received, length } => {
                write!(f, "{received} of {length} bytes were received: send from {received}")
            }
            Self::Checksum { announced, computed } => {
                write!(f, "check sum {announced:08x} announced, {computed:08x} in the flash: upload the model again")
            }
            Self::Refused(refusal) => write!(f, "the model is refused: {refusal}"),
            Self::Restart => write!(f, "a new model waits to be flown: restart before another upload"),
            Self::Flash { operation, kind } => write!(f, "the flash failed at {operation}: {kind}; upload the model again"),
            Self::ReadBack => write!(f, "the slot's header is not what was written: upload the model again"),
            Self::Empty => write!(f, "the slot holds no model: upload one"),
            Self::Torn => write!(f, "the slot's header is damaged (an interrupted upload): upload the model again"),
            Self::Layout { found, expected } => {
                write!(f, "the slot has layout {found}, this build reads {expected}: upload the model again")
            }
            Self::Length { length } => {
                write!(f, "the slot's header announces {length} bytes, more than the slot has: upload the model again")
            }
            Self::Mixed { header, computed } => {
                write!(f, "the slot's header is for model {header:08x}, the slot holds {computed:08x}: upload the model again")
            }
        }
    }
}

impl core::error::Error for StorageError {}
