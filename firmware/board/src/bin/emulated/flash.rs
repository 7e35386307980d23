//! The spare slot of the emulated board, whose flash can be read and not written: RAM, which a file keeps for the emulator's next start.
//!
//! - in: what a flash driver is asked
//! - out: `slot0.bin` or `slot1.bin`, which whoever starts the emulator puts into its flash
//! - never: a file with half a model. Erasing empties it, the header's write fills it

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use impromptu_firmware::storage::{RamFlash, Slot, SlotIndex};
use semihosting::fs;
use static_cell::ConstStaticCell;

/// What an int8 network of four layers of 128 units has, and more; the emulated board has no other use for its RAM.
const SLOT: usize = 72 * 1024;

/// The spare slot.
pub(crate) struct FileSlot {
    memory: &'static mut RamFlash<SLOT>,
    place: SlotIndex,
}

impl FileSlot {
    /// Once: the memory is a static.
    pub(crate) fn new(place: SlotIndex) -> Self {
        static IMPROMPTU_WEIGHTS: ConstStaticCell<RamFlash<SLOT>> = ConstStaticCell::new(RamFlash::written());
        Self { memory: IMPROMPTU_WEIGHTS.take(), place }
    }

    fn keep(&self, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        let name = match self.place {
            SlotIndex::First => c"slot0.bin",
            SlotIndex::Second => c"slot1.bin",
        };
        fs::write(name, bytes).map_err(|_| NorFlashErrorKind::Other)
    }
}

impl Slot for FileSlot {
    fn bytes(&self) -> &[u8] {
        self.memory.bytes()
    }
}

impl ErrorType for FileSlot {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for FileSlot {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        self.memory.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        SLOT
    }
}

impl NorFlash for FileSlot {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = SLOT;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        self.memory.erase(from, to)?;
        self.keep(&[])
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        self.memory.write(offset, bytes)?;
        if offset == 0 { self.keep(self.memory.bytes()) } else { Ok(()) }
    }
}
