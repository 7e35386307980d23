//! The signature of a model, behind its file.
//!
//! *in* a model file and, behind it, [`TRAILER`] bytes; *out* the file as it was, the version that was signed, the signature;
//! *never* whether a signature is right: that is [`crate::storage`]'s affair, at commit; *source* this file is the layout's
//! specification.
//!
//! | bytes from the file's end on | content |
//! |--:|---|
//! | 0..8 | `IMPRSIGN` |
//! | 8..10 | layout version, u16 |
//! | 10..12 | zero |
//! | 12..16 | version of the model, u32: later models have higher ones |
//! | 16..20 | length of the model file in bytes, u32 |
//! | 20..32 | zero |
//! | 32..96 | Ed25519 signature (RFC 8032) of all bytes before it, those of the model file first |
//!
//! All numbers are little-endian. The trailer is no part of the model file, whose lengths and check sum do not know it: a file is
//! the same with and without, and what reads files needs not know of signatures.

use super::file::MAX_FILE;

/// First bytes of every trailer.
pub const MAGIC: [u8; 8] = *b"IMPRSIGN";
/// Layout version that this build reads and writes.
pub const VERSION: u16 = 1;
/// Bytes of the trailer that are signed.
pub const SIGNED: usize = 32;
/// Bytes of the signature.
pub const SIGNATURE: usize = 64;
/// Length of the trailer in bytes.
pub const TRAILER: usize = SIGNED + SIGNATURE;

/// A model file with a signature behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SignedFile<'a> {
    /// The model file.
    pub file: &'a [u8],
    /// What was signed: the file and the signed part of the trailer.
    pub message: &'a [u8],
    /// Version of the model.
    pub version: u32,
    /// The signature, checked or not.
    pub signature: &'a [u8; SIGNATURE],
}

/// The part of the trailer that is signed.
pub fn signed_part(version: u32, length: u32) -> [u8; SIGNED] {
    let mut part = [0; SIGNED];
    part[..8].copy_from_slice(&MAGIC);
    part[8..10].copy_from_slice(&VERSION.to_le_bytes());
    part[12..16].copy_from_slice(&version.to_le_bytes());
    part[16..20].copy_from_slice(&length.to_le_bytes());
    part
}

/// Takes bytes apart that end with a trailer of this layout; nothing if they do not.
pub fn split(bytes: &[u8]) -> Option<SignedFile<'_>> {
    let (message, signature) = bytes.split_last_chunk()?;
    let (file, part) = message.split_last_chunk::<SIGNED>()?;
    let (version, _) = part.get(12..)?.split_first_chunk()?;
    let version = u32::from_le_bytes(*version);
    let whole = file.len() <= MAX_FILE && *part == signed_part(version, file.len() as u32);
    whole.then_some(SignedFile { file, message, version, signature })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_bytes_of_a_trailer_are_frozen() {
        let expected = *b"IMPRSIGN\x01\0\0\0\x04\x03\x02\x01\x0d\x0c\0\0\0\0\0\0\0\0\0\0\0\0\0\0";
        assert_eq!(signed_part(0x0102_0304, 0x0c0d), expected);
        assert_eq!(TRAILER, 96);
    }

    proptest! {
        #[test]
        fn what_is_put_together_comes_apart_and_nothing_else_does(
            file in prop::collection::vec(any::<u8>(), 0..80), version: u32, signature: [u8; 32], bit in 0..8 * SIGNED
        ) {
            let signature = [signature; 2].concat();
            let mut bytes = [&file[..], &signed_part(version, file.len() as u32), &signature].concat();
            let found = split(&bytes).unwrap();
            prop_assert_eq!((found.file, found.version, &found.signature[..]), (&file[..], version, &signature[..]));
            prop_assert_eq!(found.message, &bytes[..bytes.len() - SIGNATURE]);
            prop_assert_eq!(split(&bytes[1..]), None);
            prop_assert_eq!(split(&bytes[..bytes.len() - 1]), None);
            let at = file.len() + bit / 8;
            bytes[at] ^= 1 << (bit % 8);
            // The version is a number like any other; its signature says that it was another one.
            prop_assert_eq!(split(&bytes).is_some(), (12..16).contains(&(bit / 8)));
        }
    }
}
