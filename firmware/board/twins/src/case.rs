//! What cases of all kinds have in common: memory, numbers, failures.

use core::fmt;

use embedded_io::{Read, Write};
use impromptu_firmware::network::{Scratch, kernel};

/// Most words of a layer's inputs, and of its outputs.
const ACTIVATIONS: usize = 128;

/// The memory of a case: at most `WORDS` words of a layer's stream or of a model file.
#[derive(Debug)]
pub struct Memory<const WORDS: usize> {
    pub(crate) inputs: [u32; ACTIVATIONS],
    pub(crate) outputs: [[u32; ACTIVATIONS]; 2],
    pub(crate) bulk: Aligned<[[u8; 4]; WORDS]>,
    pub(crate) scratch: Scratch,
}

/// On a boundary that suits every section of a model file.
#[derive(Debug)]
#[repr(C, align(16))]
pub(crate) struct Aligned<T>(pub(crate) T);

impl<const WORDS: usize> Memory<WORDS> {
    /// Zeroed memory.
    pub const fn new() -> Self {
        Self { inputs: [0; ACTIVATIONS], outputs: [[0; ACTIVATIONS]; 2], bulk: Aligned([[0; 4]; WORDS]), scratch: Scratch::new() }
    }
}

impl<const WORDS: usize> Default for Memory<WORDS> {
    fn default() -> Self {
        Self::new()
    }
}

/// What was run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// Cases of all kinds.
    pub cases: u32,
    /// Layers for which the assembly gave other words than the twin that was compiled for the same processor.
    pub different: u32,
    /// Layers whose stream was not aligned, which the twin alone can run.
    pub unaligned: u32,
}

/// A JSON object.
impl fmt::Display for Counts {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cases, different, unaligned } = self;
        let name = kernel::NAME;
        write!(formatter, "{{\"kernel\":\"{name}\",\"cases\":{cases},\"different\":{different},\"unaligned\":{unaligned}}}")
    }
}

/// Why no more cases were run; displayed for people.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Failure(pub(crate) &'static str);

impl fmt::Display for Failure {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.0)
    }
}

pub(crate) const ENDED: Failure = Failure("the cases end too early");
pub(crate) const UNWRITTEN: Failure = Failure("the outputs cannot be written");
pub(crate) const TOO_LARGE: Failure = Failure("a case is too large for this machine");

/// Reads a model file to its place.
pub(crate) fn read_file<'b, const WORDS: usize>(
    cases: &mut impl Read,
    bulk: &'b mut Aligned<[[u8; 4]; WORDS]>,
    length: usize,
) -> Result<&'b [u8], Failure> {
    let padded = bulk.0.as_flattened_mut().get_mut(..length.next_multiple_of(4)).ok_or(TOO_LARGE)?;
    cases.read_exact(padded).map_err(|_| ENDED)?;
    padded.get(..length).ok_or(TOO_LARGE)
}

/// Reads little-endian words.
pub(crate) fn read_words(cases: &mut impl Read, words: &mut [u32]) -> Result<(), Failure> {
    let mut bytes = [0; 64];
    for words in words.chunks_mut(bytes.len() / 4) {
        let bytes = &mut bytes[..4 * words.len()];
        cases.read_exact(bytes).map_err(|_| ENDED)?;
        for (word, bytes) in words.iter_mut().zip(bytes.as_chunks().0) {
            *word = u32::from_le_bytes(*bytes);
        }
    }
    Ok(())
}

/// Writes words, little-endian.
pub(crate) fn write_words(outputs: &mut impl Write, words: &[u32]) -> Result<(), Failure> {
    let mut bytes = [0; 64];
    for words in words.chunks(bytes.len() / 4) {
        let bytes = &mut bytes[..4 * words.len()];
        for (bytes, word) in bytes.as_chunks_mut().0.iter_mut().zip(words) {
            *bytes = word.to_le_bytes();
        }
        outputs.write_all(bytes).map_err(|_| UNWRITTEN)?;
    }
    Ok(())
}
