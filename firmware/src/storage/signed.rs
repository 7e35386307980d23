//! Whose models are stored.
//!
//! *in* what was uploaded, the keys that the application trusts, the lowest version that it takes; *out* the model file without
//! its trailer; *never* a file that none of the keys has signed, or an older one than was stored; *source* Ed25519 (RFC 8032) by
//! `ed25519-compact`: no dependencies, no heap, small.
//!
//! A signature is checked at the commit only, before anything of the file is decoded. What the flash holds was checked when it
//! was stored: whoever can write to the flash can replace the program too.

use ed25519_compact::{PublicKey, Signature};

use crate::format::{Refusal, trailer};

/// The 32 bytes of an Ed25519 public key, as `model-export keygen` writes them.
pub type Key = [u8; 32];

/// Whose models an [`Uploader`](super::Uploader) stores.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Signers<'k> {
    /// A model is stored if one of them has signed it; without any, none is.
    pub keys: &'k [Key],
    /// Lowest version that is stored. What the slots hold raises it: see [`super::floor`].
    pub floor: u32,
}

impl Signers<'_> {
    /// The model file within `bytes`, if it may be stored.
    #[inline(never)]
    pub(super) fn check<'a>(&self, bytes: &'a [u8]) -> Result<&'a [u8], Refusal> {
        let found = trailer::split(bytes).ok_or(Refusal::Unsigned)?;
        let signature = Signature::new(*found.signature);
        let signed = |key: &Key| PublicKey::new(*key).verify(found.message, &signature).is_ok();
        if !self.keys.iter().any(signed) {
            return Err(Refusal::Signature);
        }
        if found.version < self.floor {
            return Err(Refusal::Downgrade { found: found.version, floor: self.floor });
        }
        Ok(found.file)
    }
}
