//! Which of two slots holds what.
//!
//! *in* the bytes of the slots; *out* the newest model that flies here, in place, and the slot that the next upload may
//! overwrite; *never* a slot as spare that holds the model to be flown; *source* sequence numbers and check sums of [`Header`].

use super::{HEADER, Header, Sequence, StorageError};
use crate::{
    format::{Refusal, file, trailer},
    model::Model,
    network::Scratch,
};

/// An intact model in its slot: header and check sums hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stored<'a> {
    sequence: Sequence,
    checksum: u32,
    name: &'a str,
    file: &'a [u8],
}

impl<'a> Stored<'a> {
    /// Reads a slot.
    ///
    /// # Errors
    /// If it holds no model, or a damaged one. Shapes and probes are [`Model::from_bytes`]' affair.
    pub fn read(slot: &'a [u8]) -> Result<Self, StorageError> {
        let (header, rest) = slot.split_first_chunk::<HEADER>().ok_or(StorageError::Empty)?;
        let Header { sequence, length, checksum } = Header::from_bytes(header)?;
        let file = rest.get(..length as usize).ok_or(StorageError::Length { length })?;
        let (card, _) = file::split(file)?;
        let computed = file::checksum(file);
        if computed != checksum {
            return Err(StorageError::Mixed { header: checksum, computed });
        }
        // The first field of a card: telemetry needs it without the rest.
        let (name, _) = postcard::take_from_bytes(card).map_err(|_| Refusal::Card)?;
        Ok(Self { sequence, checksum, name, file })
    }

    /// Number of the upload.
    pub fn sequence(&self) -> Sequence {
        self.sequence
    }

    /// Check sum that identifies the model.
    pub fn checksum(&self) -> u32 {
        self.checksum
    }

    /// Name of the model.
    pub fn name(&self) -> &'a str {
        self.name
    }

    /// The model file in place, for [`Model::from_bytes`].
    pub fn file(&self) -> &'a [u8] {
        self.file
    }
}

/// One of the two slots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlotIndex {
    /// The first.
    First,
    /// The second.
    Second,
}

impl SlotIndex {
    /// The other slot.
    pub fn other(self) -> Self {
        match self {
            Self::First => Self::Second,
            Self::Second => Self::First,
        }
    }
}

/// What two slots hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Survey<'a> {
    /// The newest model that is intact and passes every check.
    pub flies: Option<Stored<'a>>,
    /// The slot for the next upload. It does not hold the model that flies, nor, if none does, the newest intact one.
    pub spare: SlotIndex,
    /// Number of the next upload.
    pub sequence: Sequence,
}

/// Whether a file is a model that flies here.
#[inline(never)]
pub(super) fn examine(
    file: &[u8],
    scratch: &mut Scratch,
    check: impl FnOnce(&Model<'_>) -> Result<(), Refusal>,
) -> Result<(), Refusal> {
    let mut place = Model::empty();
    check(Model::load_into(&mut place, file, scratch)?)
}

/// The highest signed version in two slots, which is the lowest that may be stored; 0 without signed models. Whether their
/// signatures are right was checked when they were stored.
///
/// An upload erases the spare slot first. If the model there was the newest one but does not fly here any more, as after a new
/// program, its version is forgotten with it: an application that must not go back even then keeps a floor of its own.
pub fn floor(slots: [&[u8]; 2]) -> u32 {
    let versions = slots.map(|slot| {
        let stored = Stored::read(slot).ok()?;
        let end = HEADER.checked_add(stored.file.len())?.checked_add(trailer::TRAILER)?;
        trailer::split(slot.get(HEADER..end)?).map(|signed| signed.version)
    });
    versions.into_iter().flatten().max().unwrap_or(0)
}

/// Looks at both slots; `check` says whether a model fits the application (signals, rate, preview). The scratch is for the
/// probes.
pub fn survey<'a>(slots: [&'a [u8]; 2], scratch: &mut Scratch, check: impl Fn(&Model<'_>) -> Result<(), Refusal>) -> Survey<'a> {
    let [first, second] = slots.map(|slot| Stored::read(slot).ok());
    let newest_first = match (first, second) {
        (Some(a), Some(b)) if b.sequence.is_newer_than(a.sequence) => [(SlotIndex::Second, second), (SlotIndex::First, first)],
        _ => [(SlotIndex::First, first), (SlotIndex::Second, second)],
    };
    let intact = newest_first.into_iter().filter_map(|(place, stored)| Some((place, stored?)));
    let newest = intact.clone().next();
    let flies = intact.clone().find(|(_, stored)| examine(stored.file, scratch, &check).is_ok());
    Survey {
        flies: flies.map(|(_, stored)| stored),
        spare: flies.or(newest).map_or(SlotIndex::First, |(place, _)| place.other()),
        sequence: newest.map_or(Sequence(0), |(_, stored)| stored.sequence.next()),
    }
}
