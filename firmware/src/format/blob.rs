//! Bulk numbers, read in place.
//!
//! *in* the bytes behind the card; *out* little-endian f32 and words; *never* a copy, never out of range:
//! an array that does not fit is refused at load; *source* the file format in [`super::file`].
//! Every section starts at a multiple of 16 bytes from the file's start, so a file that is placed on a 16-byte boundary
//! can also be read by kernels that load words.

use super::{Section, refusal::Refusal};

/// A borrowed array of little-endian f32.
#[derive(Clone, Copy, Debug, Default)]
pub struct Floats<'a>(&'a [[u8; 4]]);

impl<'a> Floats<'a> {
    /// No elements.
    pub const EMPTY: Self = Self(&[]);

    /// Number of elements.
    #[inline]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Element `index`, 0 beyond the end.
    #[inline]
    pub fn get(&self, index: usize) -> f32 {
        self.0.get(index).map_or(0.0, |bytes| f32::from_le_bytes(*bytes))
    }

    /// The elements in order.
    #[inline]
    pub fn iter(&self) -> impl ExactSizeIterator<Item = f32> + Clone + use<'a> {
        self.0.iter().map(|bytes| f32::from_le_bytes(*bytes))
    }

    /// Blocks of `N` elements; a tail shorter than that is left out.
    #[inline]
    pub fn blocks<const N: usize>(&self) -> impl ExactSizeIterator<Item = [f32; N]> + use<'a, N> {
        self.0.as_chunks::<N>().0.iter().map(|block| block.map(f32::from_le_bytes))
    }

    /// The first `count` elements and the rest.
    #[inline]
    pub fn split_at(&self, count: usize) -> (Self, Self) {
        let (head, tail) = self.0.split_at(count.min(self.0.len()));
        (Self(head), Self(tail))
    }
}

/// A borrowed array of words, not yet interpreted: the streams of [`crate::network::kernel`].
#[derive(Clone, Copy, Debug, Default)]
pub struct Words<'a>(&'a [[u8; 4]]);

impl<'a> Words<'a> {
    /// All of them, each little-endian.
    #[inline(always)]
    pub fn all(&self) -> &'a [[u8; 4]] {
        self.0
    }

    /// Pieces of `count` words; a tail shorter than that is left out.
    #[inline]
    pub fn chunks(&self, count: usize) -> impl ExactSizeIterator<Item = &'a [[u8; 4]]> + Clone + use<'a> {
        self.0.chunks_exact(count.max(1))
    }
}

/// The bytes behind the card.
#[derive(Clone, Copy, Debug)]
pub struct Blob<'a>(&'a [u8]);

impl<'a> Blob<'a> {
    /// The bulk numbers in `bytes`.
    pub const fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    /// The bytes of a section that must have `length` bytes; `what` names it if it does not.
    pub fn bytes(&self, section: Section, length: usize, what: &'static str) -> Result<&'a [u8], Refusal> {
        let start = section.offset as usize;
        let found = section.length as usize;
        if found != length {
            return Err(Refusal::SectionLength { what, expected: length as u32, found: section.length });
        }
        if !start.is_multiple_of(16) {
            return Err(Refusal::SectionAlignment { what });
        }
        start.checked_add(found).and_then(|end| self.0.get(start..end)).ok_or(Refusal::SectionRange { what })
    }

    /// A section of `count` finite f32.
    pub fn floats(&self, section: Section, count: usize, what: &'static str) -> Result<Floats<'a>, Refusal> {
        let floats = Floats(self.bytes(section, count * 4, what)?.as_chunks().0);
        if floats.iter().all(f32::is_finite) { Ok(floats) } else { Err(Refusal::NotFinite { what }) }
    }

    /// A section of `count` words.
    pub fn words(&self, section: Section, count: usize, what: &'static str) -> Result<Words<'a>, Refusal> {
        Ok(Words(self.bytes(section, count * 4, what)?.as_chunks().0))
    }
}
