//! Records of one length, one behind the other, of which the newest counts: what a machine learned, kept across power cuts.
//!
//! *in* a [`Slot`] and a record whose bytes say themselves whether they are whole; *out* the newest whole one, in place; *never*
//! one that was torn, or, but for the erase of a full slot, none where there was one; *source* the log of a log-structured store.
//!
//! A sector is erased once for as many records as it holds: 52 of a quadrotor in 128 KB. A power cut while a record is written
//! leaves the one before it; only while a full slot is erased, and until the first record stands in it, there is none.
//!
//! The crates that keep small items in flash (`sequential-storage` 8, `ekv` 1) want two sectors at least, here 256 KB, and are
//! async.

use super::{Arming, Operation, Slot, StorageError};

/// Most bytes that a NOR flash programs at once.
const BLOCK: usize = 16;

/// Appends records of `LENGTH` bytes to a slot.
#[derive(Debug)]
pub struct Journal<S, const LENGTH: usize> {
    slot: S,
}

/// From one record to the next.
const fn stride(length: usize) -> usize {
    length.next_multiple_of(BLOCK)
}

/// The newest record of a journal that is whole, as this says.
pub fn newest<const LENGTH: usize>(slot: &[u8], mut whole: impl FnMut(&[u8; LENGTH]) -> bool) -> Option<&[u8; LENGTH]> {
    slot.chunks_exact(stride(LENGTH)).filter_map(<[u8]>::first_chunk).rfind(|record| whole(record))
}

impl<S: Slot, const LENGTH: usize> Journal<S, LENGTH> {
    /// A journal in a slot, whatever that holds.
    pub const fn new(slot: S) -> Self {
        const { assert!(LENGTH > 0) };
        Self { slot }
    }

    /// Appends a record of `LENGTH` bytes; a full slot is erased before.
    ///
    /// # Errors
    /// If armed, if the slot is too small, or if the flash fails; then the newest record is another one, or lost if the slot was
    /// full.
    pub fn append(&mut self, arming: Arming, record: impl Iterator<Item = u8> + Clone) -> Result<(), StorageError> {
        arming.permit()?;
        let capacity = self.slot.capacity();
        if capacity < stride(LENGTH) {
            return Err(StorageError::TooLong { length: LENGTH as u32, room: capacity as u32 });
        }
        let free = |place: &[u8]| place.iter().all(|byte| *byte == 0xff);
        let place = match self.slot.bytes().chunks_exact(stride(LENGTH)).position(free) {
            Some(place) => place,
            None => {
                self.slot.erase(0, capacity as u32).map_err(|error| StorageError::flash(Operation::Erase, &error))?;
                0
            }
        };
        let start = place * stride(LENGTH);
        let mut left = record.clone().take(LENGTH);
        for offset in (start..start + stride(LENGTH)).step_by(BLOCK) {
            let mut block = [0xff; BLOCK];
            block.iter_mut().zip(&mut left).for_each(|(place, byte)| *place = byte);
            self.slot.write(offset as u32, &block).map_err(|error| StorageError::flash(Operation::WriteRecord, &error))?;
        }
        let written = self.slot.bytes().get(start..start + LENGTH).unwrap_or_default();
        if record.take(LENGTH).eq(written.iter().copied()) { Ok(()) } else { Err(StorageError::ReadBack) }
    }
}

#[cfg(test)]
mod tests {
    use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
    use proptest::prelude::*;

    use super::*;
    use crate::{format::file::CRC, storage::RamFlash};

    const LENGTH: usize = 37;

    fn record(number: u8) -> [u8; LENGTH] {
        let mut bytes = [number; LENGTH];
        let sum = CRC.checksum(&bytes[4..]).to_le_bytes();
        bytes[..4].copy_from_slice(&sum);
        bytes
    }

    fn whole(bytes: &[u8; LENGTH]) -> bool {
        CRC.checksum(&bytes[4..]).to_le_bytes() == bytes[..4]
    }

    /// A flash whose power is cut after so many bytes were programmed; an erase counts as one byte.
    struct Cut {
        flash: RamFlash<160>,
        left: usize,
    }

    impl Slot for Cut {
        fn bytes(&self) -> &[u8] {
            self.flash.bytes()
        }
    }

    impl ErrorType for Cut {
        type Error = NorFlashErrorKind;
    }

    impl ReadNorFlash for Cut {
        const READ_SIZE: usize = 1;

        fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
            self.flash.read(offset, bytes)
        }

        fn capacity(&self) -> usize {
            160
        }
    }

    impl NorFlash for Cut {
        const WRITE_SIZE: usize = 1;
        const ERASE_SIZE: usize = 160;

        fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
            self.left = self.left.checked_sub(1).ok_or(NorFlashErrorKind::Other)?;
            self.flash.erase(from, to)
        }

        fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
            let now = self.left.min(bytes.len());
            self.left -= now;
            self.flash.write(offset, &bytes[..now])?;
            if now < bytes.len() { Err(NorFlashErrorKind::Other) } else { Ok(()) }
        }
    }

    #[test]
    fn nothing_is_written_while_the_motors_may_turn_or_where_nothing_fits() {
        let mut flash = RamFlash::<160>::new();
        assert_eq!(Journal::<_, LENGTH>::new(&mut flash).append(Arming::Armed, record(1).into_iter()), Err(StorageError::Armed));
        assert_eq!(newest(flash.bytes(), whole), None);
        let too_long = StorageError::TooLong { length: 37, room: 32 };
        let mut small = RamFlash::<32>::new();
        let appended = Journal::<_, LENGTH>::new(&mut small).append(Arming::Disarmed, record(1).into_iter());
        assert_eq!(appended, Err(too_long));
    }

    proptest! {
        /// The power is cut at any byte of any record, of what was garbage before.
        #[test]
        fn the_newest_is_the_last_that_was_written_or_was_cut_short(
            garbage in prop::collection::vec(any::<u8>(), 0..160), cuts in prop::collection::vec(0usize..150, 1..12)
        ) {
            let mut flash = RamFlash::<160>::new();
            flash.write(0, &garbage).unwrap();
            prop_assume!(newest(flash.bytes(), whole).is_none());
            let mut last = None;
            for (number, left) in cuts.into_iter().enumerate() {
                let full = flash.bytes().chunks_exact(48).all(|place| place.iter().any(|byte| *byte != 0xff));
                let mut journal = Journal::<_, LENGTH>::new(Cut { flash: flash.clone(), left });
                let next = record(number as u8);
                let written = journal.append(Arming::Disarmed, next.into_iter()).is_ok();
                flash = journal.slot.flash.clone();
                let found = newest(flash.bytes(), whole).copied();
                if written {
                    prop_assert_eq!(found, Some(next));
                } else if full && left > 0 {
                    prop_assert!(found.is_none() || found == Some(next), "erased");
                } else {
                    prop_assert!(found == last || found == Some(next));
                }
                last = found;
            }
        }
    }
}
