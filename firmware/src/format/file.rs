//! The model file: header, card, blob.
//!
//! *in* bytes; *out* the card's bytes and the blob's; *never* reads past the end, accepts a flipped bit or another version;
//! *source* this file is the format's specification.
//!
//! | bytes | content |
//! |--:|---|
//! | 0..8 | `IMPROMPT` |
//! | 8..10 | format version, u16 |
//! | 10..12 | zero |
//! | 12..16 | length of the card in bytes, u32 |
//! | 16..20 | length of the blob in bytes, u32 |
//! | 20..24 | CRC-32 (ISO-HDLC) of every other byte of the file, u32 |
//! | 24..32 | zero |
//! | 32.. | the card ([`super::Card`] in postcard), then zeros up to a multiple of 16, then the blob |
//!
//! All numbers are little-endian. The card is the fields of [`super::Card`] in their order, without names: integers of more than
//! a byte as varints, f32 in four bytes, texts and lists behind their length, an option behind 0 or 1, the variant of an enum as
//! its number.
//!
//! Sections of the blob, each at a multiple of 16 bytes, in the order in which `model-export` writes them (a reader goes by the
//! card's offsets; f features, o outputs, sizes in words of four bytes):
//!
//! | section | words | content |
//! |---|--:|---|
//! | input normalisation | 2 f | f32 mean of each input, then reciprocal scale of each |
//! | output normalisation | 2 o | f32 scale of each output, then mean of each |
//! | skip | blocks of 8 outputs × 8 (1 + f padded to 2) | a float stream ([`crate::network::kernel`]) |
//! | rows of each layer | as its kernel asks for | a float or integer stream |
//! | coefficients of each lane axis | lags (errors + 1) | f32, newest lag first: each error's, then the output's own |
//! | taps of each monitor axis | inputs × taps | f32, newest first: of each input in turn |
//! | envelope | 2 f | f32 smallest value of each feature in training, then largest of each |
//! | bounds | 4 o, none without a network | f32 low, high, difference, lipschitz of each output ([`super::OutputBounds`]) |
//! | network probes | probes × (f + o) | f32 features of each probe, then outputs of each |
//! | lane probe | axes | f32 outputs ([`crate::feedback::probe`]) |
//!
//! Versions differ in what a model may have, not in how it is written:
//!
//! | version | channels in a signal | corrected channels | axes of a lane and of the monitor |
//! |--:|--:|--:|--:|
//! | 2 | 16 | 8 | 4 |
//! | 3 | 32 | 16 | 8 |
//!
//! A model that keeps within version 2 is written as one, so that every firmware that is in the field reads it, and its bytes do
//! not change; what is larger says so in its version, by which an older build refuses it. Version 2 is frozen:
//! `tests/golden/models` holds the exact bytes of small models, which every build reads and writes.

use crc::{CRC_32_ISO_HDLC, Crc, Table};

use super::refusal::Refusal;

/// First bytes of every model file.
pub const MAGIC: [u8; 8] = *b"IMPROMPT";
/// Newest format version that this build reads and writes.
pub const VERSION: u16 = 3;
/// Oldest format version that this build reads and writes.
pub const OLDEST_VERSION: u16 = super::limits::OLDEST;
/// Length of the header in bytes.
pub const HEADER: usize = 32;
/// Alignment of the blob and of each of its sections, bytes.
pub const ALIGNMENT: usize = 16;
/// Largest file that is accepted: the F405's upper flash half.
pub const MAX_FILE: usize = 512 * 1024;

pub(crate) const CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// Check sum of a file: everything but the check sum's own four bytes.
pub fn checksum(bytes: &[u8]) -> u32 {
    checksum_around(bytes, 20)
}

/// Check sum of everything but the four bytes at a place, where it stands itself.
pub(crate) fn checksum_around(bytes: &[u8], place: usize) -> u32 {
    let mut digest = CRC.digest();
    digest.update(bytes.get(..place).unwrap_or_default());
    digest.update(bytes.get(place.saturating_add(4)..).unwrap_or_default());
    digest.finalize()
}

/// The header for a card of this version ([`Card::version`](super::Card::version)) and a blob of these lengths, with
/// the check sum still zero.
pub fn header(version: u16, card: u32, blob: u32) -> [u8; HEADER] {
    let mut header = [0; HEADER];
    header[..8].copy_from_slice(&MAGIC);
    header[8..10].copy_from_slice(&version.to_le_bytes());
    header[12..16].copy_from_slice(&card.to_le_bytes());
    header[16..20].copy_from_slice(&blob.to_le_bytes());
    header
}

/// The version that a file says, whatever else it holds; 0 of one that is too short.
pub fn version(bytes: &[u8]) -> u16 {
    bytes.get(8..10).and_then(<[u8]>::first_chunk).map_or(0, |version| u16::from_le_bytes(*version))
}

/// Splits a checked file into card and blob.
pub fn split(bytes: &[u8]) -> Result<(&[u8], &[u8]), Refusal> {
    let Some((header, body)) = bytes.split_first_chunk::<HEADER>() else {
        return Err(Refusal::TooShort { found: bytes.len() });
    };
    let word = |at: usize| u32::from_le_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]);
    if header[..8] != MAGIC {
        return Err(Refusal::NotAModel);
    }
    let version = version(bytes);
    if !(OLDEST_VERSION..=VERSION).contains(&version) {
        return Err(Refusal::Version { found: version, expected: VERSION });
    }
    if header[10..12].iter().chain(&header[24..]).any(|byte| *byte != 0) {
        return Err(Refusal::Value { what: "reserved part of the header" });
    }
    let (card, blob, stored) = (word(12) as usize, word(16) as usize, word(20));
    let padded = (card as u64).next_multiple_of(ALIGNMENT as u64);
    let expected = HEADER as u64 + padded + blob as u64;
    if expected > MAX_FILE as u64 {
        return Err(Refusal::Shape {
            what: "file length",
            found: u32::try_from(expected).unwrap_or(u32::MAX),
            limit: MAX_FILE as u32,
        });
    }
    if expected != bytes.len() as u64 {
        return Err(Refusal::Length { expected, found: bytes.len() });
    }
    let computed = checksum(bytes);
    if computed != stored {
        return Err(Refusal::Checksum { stored, computed });
    }
    let (card_bytes, rest) = body.split_at_checked(card).ok_or(Refusal::Card)?;
    let blob_bytes = rest.get(rest.len().saturating_sub(blob)..).ok_or(Refusal::Card)?;
    Ok((card_bytes, blob_bytes))
}
