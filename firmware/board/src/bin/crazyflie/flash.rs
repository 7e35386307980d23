//! The spare slot: sector 10 or 11 of the flash.
//!
//! - in: what a flash driver is asked, offsets from the slot's first byte
//! - out: an erased or programmed sector
//! - never: another sector's bytes, or what the flash's caches remember of a sector that has changed

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write};
use impromptu_board::slots::{SLOT, slots};
use impromptu_firmware::storage::{Slot, SlotIndex};
use stm32f4xx_hal::{flash::FlashExt as _, pac::FLASH};

/// Offset of the slots from the first byte of the flash.
const SLOTS: u32 = 0xC_0000;

/// The spare slot.
pub(crate) struct Sector {
    flash: FLASH,
    place: SlotIndex,
}

impl Sector {
    pub(crate) fn new(flash: FLASH, place: SlotIndex) -> Self {
        Self { flash, place }
    }

    /// Where an offset is in the flash.
    fn locate(&self, offset: u32) -> u32 {
        match self.place {
            SlotIndex::First => SLOTS + offset,
            SlotIndex::Second => SLOTS + SLOT as u32 + offset,
        }
    }

    /// RM0090, 3.5.2 and 3.6.3: the caches may hold what was there before; they are reset while they are off.
    fn forget(&self) {
        let acr = self.flash.acr();
        acr.modify(|_, w| w.dcen().clear_bit().icen().clear_bit());
        acr.modify(|_, w| w.dcrst().set_bit().icrst().set_bit());
        acr.modify(|_, w| w.dcrst().clear_bit().icrst().clear_bit());
        acr.modify(|_, w| w.dcen().set_bit().icen().set_bit());
    }
}

impl Slot for Sector {
    fn bytes(&self) -> &[u8] {
        let [first, second] = slots();
        match self.place {
            SlotIndex::First => first,
            SlotIndex::Second => second,
        }
    }
}

impl ErrorType for Sector {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Sector {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        check_read(self, offset, bytes.len())?;
        bytes.iter_mut().zip(self.bytes().iter().skip(offset as usize)).for_each(|(to, from)| *to = *from);
        Ok(())
    }

    fn capacity(&self) -> usize {
        SLOT
    }
}

impl NorFlash for Sector {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = SLOT;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        check_erase(self, from, to)?;
        if from < to {
            let (start, end) = (self.locate(from), self.locate(to));
            let erased = NorFlash::erase(&mut self.flash.unlocked(), start, end);
            self.forget();
            erased.map_err(|_| NorFlashErrorKind::Other)?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        check_write(self, offset, bytes.len())?;
        let start = self.locate(offset);
        let written = NorFlash::write(&mut self.flash.unlocked(), start, bytes);
        self.forget();
        written.map_err(|_| NorFlashErrorKind::Other)
    }
}
