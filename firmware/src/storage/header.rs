//! What stands before a stored model and makes it one.
//!
//! *in* [`HEADER`] bytes; *out* sequence number, length and check sum of the model behind them; *never* accepts a header that was
//! torn or has a flipped bit; *source* this file is the layout's specification.
//!
//! | bytes | content |
//! |--:|---|
//! | 0..8 | `IMPRSLOT` |
//! | 8..10 | layout version, u16 |
//! | 10..12 | zero |
//! | 12..16 | sequence number, u32 |
//! | 16..20 | length of the model file in bytes, u32 |
//! | 20..24 | check sum of the model file ([`crate::format::file::checksum`]), u32 |
//! | 24..28 | zero |
//! | 28..32 | CRC-32 (ISO-HDLC) of the bytes before, u32 |
//!
//! All numbers are little-endian. The model file follows at once, so it lies on a boundary of 16 bytes if its slot does.

use super::StorageError;
use crate::format::file::CRC;

/// First bytes of every slot that holds a model.
pub const MAGIC: [u8; 8] = *b"IMPRSLOT";
/// Layout version that this build reads and writes.
pub const VERSION: u16 = 1;
/// Length of the header in bytes.
pub const HEADER: usize = 32;

/// Number of an upload. Numbers wrap around; the newer of two is less than half of the range ahead.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sequence(pub u32);

impl Sequence {
    /// The number after this one.
    pub fn next(self) -> Self {
        Self(self.0.wrapping_add(1))
    }

    /// Whether this number was given later than `other`.
    pub fn is_newer_than(self, other: Self) -> bool {
        self.0.wrapping_sub(other.0).cast_signed() > 0
    }
}

/// The header of a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Number of the upload.
    pub sequence: Sequence,
    /// Length of the model file, bytes.
    pub length: u32,
    /// Check sum of the model file.
    pub checksum: u32,
}

impl Header {
    /// The header's bytes.
    pub fn to_bytes(&self) -> [u8; HEADER] {
        let [a, b] = VERSION.to_le_bytes();
        let version = u32::from_le_bytes([a, b, 0, 0]);
        let mut bytes = [0; HEADER];
        let (magic, words) = bytes.split_at_mut(MAGIC.len());
        magic.copy_from_slice(&MAGIC);
        for (place, word) in words.as_chunks_mut().0.iter_mut().zip([version, self.sequence.0, self.length, self.checksum]) {
            *place = word.to_le_bytes();
        }
        if let Some((content, crc)) = bytes.split_last_chunk_mut() {
            *crc = CRC.checksum(content).to_le_bytes();
        }
        bytes
    }

    /// Reads a header.
    ///
    /// # Errors
    /// If there is none, a damaged one or one of another layout.
    pub fn from_bytes(bytes: &[u8; HEADER]) -> Result<Self, StorageError> {
        let Some((content, crc)) = bytes.split_last_chunk() else { return Err(StorageError::Empty) };
        if !content.starts_with(&MAGIC) {
            return Err(StorageError::Empty);
        }
        if CRC.checksum(content) != u32::from_le_bytes(*crc) {
            return Err(StorageError::Torn);
        }
        let (words, _) = bytes.as_chunks();
        let [_, _, version, sequence, length, checksum, reserved, _] = [0, 1, 2, 3, 4, 5, 6, 7].map(|index: usize| {
            let word: Option<&[u8; 4]> = words.get(index);
            u32::from_le_bytes(word.copied().unwrap_or_default())
        });
        if version != u32::from(VERSION) || reserved != 0 {
            return Err(StorageError::Layout { found: version, expected: VERSION });
        }
        Ok(Self { sequence: Sequence(sequence), length, checksum })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_bytes_of_a_header_are_frozen() {
        let header = Header { sequence: Sequence(0x0403_0201), length: 0x0102, checksum: 0xa1b2_c3d4 };
        let mut expected = *b"IMPRSLOT\x01\0\0\0\x01\x02\x03\x04\x02\x01\0\0\xd4\xc3\xb2\xa1\0\0\0\0....";
        let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&expected[..28]);
        expected[28..].copy_from_slice(&crc.to_le_bytes());
        assert_eq!(header.to_bytes(), expected);
    }

    #[test]
    fn another_layout_is_named() {
        let mut bytes = Header { sequence: Sequence(1), length: 2, checksum: 3 }.to_bytes();
        bytes[8] = 9;
        let crc = CRC.checksum(&bytes[..28]).to_le_bytes();
        bytes[28..].copy_from_slice(&crc);
        assert_eq!(Header::from_bytes(&bytes), Err(StorageError::Layout { found: 9, expected: VERSION }));
    }

    proptest! {
        #[test]
        fn a_header_is_read_as_written_and_never_with_a_flipped_bit(
            sequence: u32, length: u32, checksum: u32, bit in 0..8 * HEADER
        ) {
            let header = Header { sequence: Sequence(sequence), length, checksum };
            let mut bytes = header.to_bytes();
            prop_assert_eq!(Header::from_bytes(&bytes), Ok(header));
            bytes[bit / 8] ^= 1 << (bit % 8);
            prop_assert!(Header::from_bytes(&bytes).is_err());
        }

        #[test]
        fn the_next_number_is_newer_also_after_the_last(number: u32, steps in 1..1000u32) {
            let (old, new) = (Sequence(number), (0..steps).fold(Sequence(number), |sequence, _| sequence.next()));
            prop_assert!(new.is_newer_than(old) && !old.is_newer_than(new) && !old.is_newer_than(old));
            prop_assert!(Sequence(u32::MAX).next().is_newer_than(Sequence(u32::MAX)));
        }
    }
}
