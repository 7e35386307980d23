//! A slot in RAM that behaves like flash: for boards without a flash that can be written, such as the emulated one.
//!
//! *in* what a flash driver is asked; *out* the same as NOR flash gives; *never* a bit set but by erasing; *source* the traits of
//! `embedded-storage`.

use embedded_storage::nor_flash::{
    ErrorType, MultiwriteNorFlash, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

use super::Slot;

/// A slot of `BYTES` bytes, erased as a whole and written byte by byte, as a sector of the STM32F405. What it holds is lost
/// without power.
///
/// A static of it should be [`RamFlash::written`], which start-up code clears: erased bytes are not zero, so they would take as
/// much flash as RAM.
#[derive(Clone, Debug)]
#[repr(C, align(16))]
pub struct RamFlash<const BYTES: usize>([u8; BYTES]);

impl<const BYTES: usize> RamFlash<BYTES> {
    /// Erased memory.
    pub const fn new() -> Self {
        Self([0xff; BYTES])
    }

    /// Memory of zeros, which can only be erased.
    pub const fn written() -> Self {
        Self([0; BYTES])
    }
}

impl<const BYTES: usize> Default for RamFlash<BYTES> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const BYTES: usize> Slot for RamFlash<BYTES> {
    fn bytes(&self) -> &[u8] {
        &self.0
    }
}

impl<const BYTES: usize> ErrorType for RamFlash<BYTES> {
    type Error = NorFlashErrorKind;
}

impl<const BYTES: usize> ReadNorFlash for RamFlash<BYTES> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        check_read(self, offset, bytes.len())?;
        bytes.iter_mut().zip(self.0.iter().skip(offset as usize)).for_each(|(to, from)| *to = *from);
        Ok(())
    }

    fn capacity(&self) -> usize {
        BYTES
    }
}

impl<const BYTES: usize> NorFlash for RamFlash<BYTES> {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = BYTES;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        check_erase(self, from, to)?;
        if from < to {
            self.0.fill(0xff);
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        check_write(self, offset, bytes.len())?;
        self.0.iter_mut().skip(offset as usize).zip(bytes).for_each(|(cell, byte)| *cell &= byte);
        Ok(())
    }
}

impl<const BYTES: usize> MultiwriteNorFlash for RamFlash<BYTES> {}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn writing_only_clears_bits_and_erasing_sets_all(
            writes in prop::collection::vec((0..80u32, prop::collection::vec(any::<u8>(), 0..20)), 0..20)
        ) {
            let mut flash = RamFlash::<64>::new();
            let mut expected = [0xff; 64];
            for (offset, bytes) in writes {
                let end = offset as usize + bytes.len();
                let fits = flash.write(offset, &bytes);
                prop_assert_eq!(fits, if end <= 64 { Ok(()) } else { Err(NorFlashErrorKind::OutOfBounds) });
                if end <= 64 {
                    expected[offset as usize..end].iter_mut().zip(&bytes).for_each(|(cell, byte)| *cell &= byte);
                }
                let mut read = [0; 64];
                flash.read(0, &mut read).unwrap();
                prop_assert_eq!(read, expected);
                prop_assert_eq!(flash.bytes(), expected);
            }
            prop_assert_eq!(flash.erase(0, 32), Err(NorFlashErrorKind::NotAligned));
            flash.erase(0, 64).unwrap();
            prop_assert_eq!(flash.bytes(), [0xff; 64]);
        }
    }
}
