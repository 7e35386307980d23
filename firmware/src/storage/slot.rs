//! A part of the flash that holds a model.
//!
//! *in* calls of a NOR flash; *out* what it holds, in place; *never* bytes of another slot; *source* the traits of
//! `embedded-storage`.

use embedded_storage::nor_flash::NorFlash;

/// A part of the flash that is erased alone and can be read in place.
///
/// Offsets of the driver start at the slot's first byte, and its capacity is the slot's: [`super::Uploader`] erases all of it.
/// The first byte lies on a boundary of 16 bytes.
///
/// A board gets the bytes of its sectors without unsafe code from a static of zeros whose name memory.x places there and does not
/// load, as it does with `IMPROMPTU_WEIGHTS`. It reads the static through [`core::hint::black_box`]: otherwise the compiler, who
/// knows nothing of uploads, reads the zeros. For a model that lives as long as the program the slots are `&'static mut`, or the
/// board calls [`super::survey`] with two `&'static [u8]` and makes the flash driver a slot for the spare one alone.
pub trait Slot: NorFlash {
    /// What the flash holds now, all of it. On a board with a cache before its flash, erasing and writing also empty the cache.
    fn bytes(&self) -> &[u8];
}

impl<S: Slot> Slot for &mut S {
    fn bytes(&self) -> &[u8] {
        S::bytes(self)
    }
}
