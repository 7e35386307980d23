//! Working memory of an evaluation.
//!
//! *in* the size that a network needs; *out* room for the activations of two layers; *never* more than the widest network needs;
//! *source* the limits in [`crate::format`].

use super::shape::{INPUT_PADDING, ROWS, padded};
use crate::format::{Arithmetic, MAX_FEATURES, MAX_WIDTH, NetworkLayout};

/// Words that are enough for every network.
pub const MAX_SCRATCH: usize = 2 * MAX_WIDTH;
const _: () = assert!(MAX_FEATURES <= MAX_WIDTH && MAX_WIDTH.is_multiple_of(ROWS));

/// `WORDS` words for the activations of two layers. Without a number it serves any network; [`super::Network::scratch_words`]
/// says how many one network needs (128 words, 512 bytes, for integer layers of 128 units).
#[derive(Clone, Debug)]
pub struct Scratch<const WORDS: usize = MAX_SCRATCH> {
    words: [u32; WORDS],
}

impl Scratch {
    /// Zeroed memory for any network.
    pub const fn new() -> Self {
        Self::sized()
    }
}

impl<const WORDS: usize> Scratch<WORDS> {
    /// Zeroed memory of this size.
    pub const fn sized() -> Self {
        Self { words: [0; WORDS] }
    }

    /// The words.
    #[inline(always)]
    pub(super) fn words(&mut self) -> &mut [u32] {
        &mut self.words
    }
}

impl<const WORDS: usize> Default for Scratch<WORDS> {
    fn default() -> Self {
        Self::sized()
    }
}

/// Words of the activations of the widest layer of a checked network, the inputs included.
pub(super) fn half(layout: &NetworkLayout, inputs: usize, outputs: usize) -> usize {
    // The normalised inputs are f32 in any arithmetic; integer layers take two outputs to a word;
    // the last one's accumulators take a word each.
    let codes = if layout.arithmetic == Arithmetic::Float { 1 } else { 2 };
    let hidden = layout.layers.iter().rev().skip(1).map(|layer| padded(usize::from(layer.outputs)) / codes);
    hidden.fold(inputs.next_multiple_of(INPUT_PADDING).max(padded(outputs)), usize::max)
}
