//! Models in flash, which an upload replaces without a new program.
//!
//! *in* two [`Slot`]s of NOR flash; *out* the newest model that this machine flies, in place, and an [`Uploader`] for the other
//! slot; *never*, wherever the power is cut, none where there was one, or a mix of two; *source* two slots with a commit record
//! written last.
//!
//! A slot is a [`Header`] and behind it the model file. An upload erases the slot that does not fly, writes the file, checks it
//! as it stands in the flash, and last writes the header, whose own CRC tells whether it is whole: until then the old model is
//! the newest one. The slot that flies is borrowed by its model, so no code can write to it.
//!
//! ```
//! use impromptu_firmware::{network::Scratch, storage::{self, Arming, RamFlash}};
//! # let file: &[u8] = include_bytes!("../tests/models/int8-lane.model");
//! # let checksum = impromptu_firmware::model::file::checksum(file);
//!
//! let mut slots = [RamFlash::<4096>::new(), RamFlash::new()];
//! let (stored, mut uploader) = storage::open(&mut slots, |_| Ok(()));
//! assert!(stored.is_none());
//! let mut next = uploader.begin(Arming::Disarmed, file.len() as u32, checksum)?;
//! while let Some(chunk) = file.get(next as usize..).and_then(|rest| rest.chunks(100).next()) {
//!     next = uploader.write(Arming::Disarmed, next, chunk)?;
//! }
//! uploader.commit(Arming::Disarmed, &mut Scratch::new(), |_| Ok(()))?;
//!
//! let (stored, _) = storage::open(&mut slots, |_| Ok(()));
//! assert_eq!(stored.map(|stored| stored.checksum()), Some(checksum));
//! # Ok::<(), storage::StorageError>(())
//! ```
//!
//! With the feature `signed`, `Uploader::require` makes the commit ask for a signature ([`crate::format::trailer`]) of one of
//! the application's keys, and for a version that is not below those in the slots: an unsigned, a wrongly signed and an older
//! model are refused ([`Refusal::Unsigned`], [`Refusal::Signature`], [`Refusal::Downgrade`]), and what is stored stays. Only the
//! file stands in the header; the trailer lies behind it.
//!
//! What a machine learned is kept in a slot of its own, a [`Journal`].
//!
//! The crates that keep data in NOR flash do not serve: `sequential-storage` 8 and `ekv` 1 copy an item out of pages into a
//! buffer, where the kernels read a model of up to 100 KB in place, contiguous and on a boundary of 16 bytes. The former's items
//! are shorter than 64 KB, the latter's records are cut into chunks; both are async. Only the traits of `embedded-storage` are
//! used.

mod error;
mod header;
mod journal;
mod ram;
#[cfg(feature = "signed")]
mod signed;
mod slot;
mod stored;
mod uploader;

use crate::{format::Refusal, model::Model, network::Scratch};

pub use error::{Operation, StorageError};
pub use header::{HEADER, Header, MAGIC, Sequence, VERSION};
pub use journal::{Journal, newest};
pub use ram::RamFlash;
#[cfg(feature = "signed")]
pub use signed::{Key, Signers};
pub use slot::Slot;
pub use stored::{SlotIndex, Stored, Survey, floor, survey};
pub use uploader::{Arming, Uploader};

/// Start-up: the newest model that is intact and passes `check` (signals, rate, preview of the application), and an uploader for
/// the slot that it does not lie in.
pub fn open<'a, S: Slot>(
    slots: &'a mut [S; 2],
    check: impl Fn(&Model<'_>) -> Result<(), Refusal>,
) -> (Option<Stored<'a>>, Uploader<&'a mut S>) {
    let Survey { flies, spare, sequence } = survey(slots.each_ref().map(Slot::bytes), &mut Scratch::new(), check);
    let found = flies.is_some();
    let [first, second] = slots;
    let (kept, spare) = match spare {
        SlotIndex::First => (&*second, first),
        SlotIndex::Second => (&*first, second),
    };
    let stored = if found { Stored::read(kept.bytes()).ok() } else { None };
    (stored, Uploader::new(spare, sequence))
}
