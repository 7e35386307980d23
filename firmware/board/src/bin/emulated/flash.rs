//! The slots of the emulated board, whose flash can be read and not written: RAM, which files keep for the next start of the
//! emulator.
//!
//! - in: what a flash driver is asked
//! - out: `slot0.bin`, `slot1.bin` or `learned.bin`, which whoever starts the emulator puts into its flash
//! - never: a file with half a model. Erasing empties it, the header's write fills it

use core::ffi::CStr;

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use impromptu_firmware::storage::{RamFlash, Slot, SlotIndex};
use semihosting::fs;
use static_cell::ConstStaticCell;

/// What an int8 network of four layers of 128 units has, and more; the emulated board has no other use for its RAM.
pub(crate) const SLOT: usize = 72 * 1024;

/// Room for two records of what was learned: the rest of the RAM is stack.
pub(crate) const LEARNED: usize = 5 * 1024;

/// Which file stands for a slot, and the write at which offset completes what is to be in it; `None`: each one.
#[derive(Clone, Copy, Debug)]
struct File {
    name: &'static CStr,
    complete_at: Option<u32>,
}

/// A slot in RAM and in a file.
pub(crate) struct FileSlot<const BYTES: usize> {
    memory: &'static mut RamFlash<BYTES>,
    file: File,
}

impl FileSlot<SLOT> {
    /// The spare slot of models. Once: the memory is a static.
    pub(crate) fn spare(place: SlotIndex) -> Self {
        static IMPROMPTU_WEIGHTS: ConstStaticCell<RamFlash<SLOT>> = ConstStaticCell::new(RamFlash::written());
        let name = match place {
            SlotIndex::First => c"slot0.bin",
            SlotIndex::Second => c"slot1.bin",
        };
        Self { memory: IMPROMPTU_WEIGHTS.take(), file: File { name, complete_at: Some(0) } }
    }
}

impl FileSlot<LEARNED> {
    /// The slot of what was learned. Once: the memory is a static.
    pub(crate) fn learned(held: &[u8]) -> Self {
        static MEMORY: ConstStaticCell<RamFlash<LEARNED>> = ConstStaticCell::new(RamFlash::written());
        let memory = MEMORY.take();
        // As the flash that it stands for.
        let _ = memory.erase(0, LEARNED as u32);
        let _ = memory.write(0, held.get(..LEARNED).unwrap_or(held));
        Self { memory, file: File { name: c"learned.bin", complete_at: None } }
    }
}

impl<const BYTES: usize> FileSlot<BYTES> {
    fn keep(&self, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        fs::write(self.file.name, bytes).map_err(|_| NorFlashErrorKind::Other)
    }
}

impl<const BYTES: usize> Slot for FileSlot<BYTES> {
    fn bytes(&self) -> &[u8] {
        self.memory.bytes()
    }
}

impl<const BYTES: usize> ErrorType for FileSlot<BYTES> {
    type Error = NorFlashErrorKind;
}

impl<const BYTES: usize> ReadNorFlash for FileSlot<BYTES> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        self.memory.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        BYTES
    }
}

impl<const BYTES: usize> NorFlash for FileSlot<BYTES> {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = BYTES;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        self.memory.erase(from, to)?;
        self.keep(&[])
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        self.memory.write(offset, bytes)?;
        if self.file.complete_at.is_none_or(|complete| complete == offset) { self.keep(self.memory.bytes()) } else { Ok(()) }
    }
}
