//! A recorded flight: every call of the flight stack in order, and its answers, so that another machine can fly it again.
//!
//! *in* the calls of [`crate::flight::Flight`], bit by bit; *out* fixed-size records that are read and written one at a time;
//! *never* a record that is rounded, normalised or skipped: what cannot be flown again to the bit is refused; *source* this file
//! is the format's specification.
//!
//! A **recording** is a header of [`HEADER`] bytes, then records of [`RECORD`] bytes, the last of which is [`Event::End`]:
//!
//! | header | content |
//! |--:|---|
//! | 0..8 | `IMPFLOWN` |
//! | 8..10 | format version, u16 |
//! | 10..12 | 1: flown with an add-on, 0: without; u16 |
//! | 12..16 | check sum of the add-on's model file, u32; 0 without |
//! | 16.. | [`Settings`] in postcard, then zeros |
//!
//! | record | content |
//! |--:|---|
//! | 0..4 | kind, u32: 1 tick, 2 setpoint, 3 lanes, 4 dither, 5 end |
//! | 4.. | 14, 10 or 3 f32 in the order of the fields; lanes, u32: bit 0 network, bit 1 feedback; end: ticks, u32. Then zeros |
//!
//! The **answers** are [`ANSWER`] bytes for each tick: four motor fractions, reference position and velocity, f32.
//! All numbers are little-endian.

mod event;
mod recorder;

use core::fmt;

use crate::{
    settings::Settings,
    types::{MotorCommand, Reference},
};

pub use event::Event;
pub use recorder::{Recorded, Recorder};

/// First bytes of every recording.
pub const MAGIC: [u8; 8] = *b"IMPFLOWN";
/// Format version that this build reads and writes.
pub const VERSION: u16 = 1;
/// Length of the header in bytes.
pub const HEADER: usize = 160;
/// Length of a record in bytes.
pub const RECORD: usize = 60;
/// Length of an answer in bytes.
pub const ANSWER: usize = 40;

/// Why a recording is not flown again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum RecordingError {
    /// The first eight bytes are not the format's.
    NotARecording,
    /// Another format version.
    Version {
        /// Version in the file.
        found: u16,
    },
    /// The settings cannot be decoded.
    Settings,
    /// A record of no known kind.
    Kind {
        /// Kind in the file.
        found: u32,
    },
    /// A number of a record is NaN or infinite.
    NotFinite,
}

impl fmt::Display for RecordingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotARecording => write!(f, "not a recorded flight (its first bytes are not IMPFLOWN)"),
            Self::Version { found } => write!(f, "format version {found}, this build reads {VERSION}: record the flight again"),
            Self::Settings => write!(f, "the settings in the header cannot be decoded: record the flight again"),
            Self::Kind { found } => write!(f, "a record of unknown kind {found}: the file is damaged, record the flight again"),
            Self::NotFinite => {
                write!(f, "a record holds a number that is not finite: the flight diverged or the file is damaged")
            }
        }
    }
}

impl core::error::Error for RecordingError {}

/// What a flight starts from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Header {
    /// Settings of the flight stack.
    pub settings: Settings,
    /// Check sum of the add-on's model file, if the flight had an add-on.
    pub model: Option<u32>,
}

impl Header {
    /// The header's bytes.
    pub fn to_bytes(&self) -> [u8; HEADER] {
        let mut bytes = [0; HEADER];
        bytes[..8].copy_from_slice(&MAGIC);
        bytes[8..10].copy_from_slice(&VERSION.to_le_bytes());
        bytes[10] = u8::from(self.model.is_some());
        bytes[12..16].copy_from_slice(&self.model.unwrap_or(0).to_le_bytes());
        // 37 numbers and a short count always fit; if they ever did not, `from_bytes` would say so.
        let _ = postcard::to_slice(&self.settings, &mut bytes[16..]);
        bytes
    }

    /// Reads a header.
    ///
    /// # Errors
    /// If it is not the header of a recording, or of another version.
    pub fn from_bytes(bytes: &[u8; HEADER]) -> Result<Self, RecordingError> {
        let number = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        if bytes[..8] != MAGIC {
            return Err(RecordingError::NotARecording);
        }
        if number(8) != VERSION {
            return Err(RecordingError::Version { found: number(8) });
        }
        let checksum = u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]);
        let settings = postcard::from_bytes(&bytes[16..]).map_err(|_| RecordingError::Settings)?;
        Ok(Self { settings, model: (number(10) == 1).then_some(checksum) })
    }
}

/// The answer to a tick: what the motors get, and the reference that the loop tracks.
pub fn answer(command: &MotorCommand, reference: &Reference) -> [u8; ANSWER] {
    let [a, b, c, d] = command.fractions();
    let Reference { position: p, velocity: v, .. } = reference;
    let mut bytes = [0; ANSWER];
    for (place, value) in bytes.as_chunks_mut().0.iter_mut().zip([a, b, c, d, p.x, p.y, p.z, v.x, v.y, v.z]) {
        *place = value.to_le_bytes();
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn only_headers_of_this_version_are_read(mut start in any::<[u8; 16]>(), magic in any::<bool>(), version in 0u16..3) {
            if magic {
                start[..8].copy_from_slice(&MAGIC);
            }
            start[8..10].copy_from_slice(&version.to_le_bytes());
            let mut bytes = [0; HEADER];
            bytes[..16].copy_from_slice(&start);
            let header = Header::from_bytes(&bytes);
            prop_assert_eq!(header.is_ok(), start[..8] == MAGIC && version == VERSION);
            if let Ok(header) = header {
                prop_assert_eq!(Header::from_bytes(&header.to_bytes()), Ok(header));
            }
        }

        #[test]
        fn settings_of_any_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), HEADER - 16)) {
            let mut header = [0; HEADER];
            header[..8].copy_from_slice(&MAGIC);
            header[8..10].copy_from_slice(&VERSION.to_le_bytes());
            header[16..].copy_from_slice(&bytes);
            let _ = Header::from_bytes(&header);
        }
    }
}
