//! Packed weights: in which order they lie, and what becomes of a row's sum.
//!
//! # Integer stream
//! For each block of [`ROWS`] outputs: eight i32 biases, the weights, and eight words of requantisation (i32 multipliers; f32 row
//! scales in the last layer, which the kernel skips). Inputs are 16-bit codes, two to a word, the first one in the low half.
//! - [`Width::Int16`]: for each pair of inputs eight words, one a row: the halves are the weights of the pair, low half first.
//! - [`Width::Int8`]: for each pair of inputs four words of four bytes, one for two rows. The even row's weights are the word's
//!   halves, the odd row's are the halves of the same word moved up by eight bits. So a byte is one row's weight *and* the
//!   fraction of another's; in units of 1/256 of an int8 step, with bytes b₀…b₃ (b as signed, u as unsigned),
//!
//!   | | first input | second input |
//!   |---|--:|--:|
//!   | even row | 256 b₁ + u₀ | 256 b₃ + u₂ |
//!   | odd row | 256 b₀ | 256 b₂ + u₁ |
//!
//!   These are the exact weights on every machine. Who packs chooses b₀, then b₁, b₂, b₃, and so has each of them within half a
//!   step.
//!
//! An accumulator is bias + Σ weight × code, modulo 2³²; the loader proves that the sum itself never leaves 32 bits.
//!
//! # Float stream
//! Up to six outputs are one block of six rows. More are padded to a multiple of 4, at least 8, and divided into blocks of twelve
//! rows and at most two of eight at the end ([`float_blocks`]). For each block: its f32 biases, then for each input the block's
//! f32 weights. An accumulator starts at the bias and adds weight × input in the inputs' order, each product and each sum
//! rounded.
//!
//! The number of inputs is padded with zero weights: to a multiple of 4 (integers) or of 2 (floats).

use crate::network::ROWS;

/// Bits of a packed weight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Width {
    /// One byte for each weight.
    Int8,
    /// Two bytes for each weight.
    Int16,
}

impl Width {
    /// Words of weights for each word of inputs in a block.
    pub const fn words(self) -> usize {
        match self {
            Self::Int8 => ROWS / 2,
            Self::Int16 => ROWS,
        }
    }

    /// Words of a block whose inputs take `inputs` words.
    pub const fn block(self, inputs: usize) -> usize {
        2 * ROWS + self.words() * inputs
    }
}

/// What becomes of an accumulator *a* with multiplier *m*.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finish {
    /// ReLU: ⌊a m / 2³² + ½⌋ within 0..=limit, two to a word.
    Codes {
        /// Largest code, at most 32,767.
        limit: u16,
    },
    /// tanh: ⌊a m / 2³² + ½⌋ within −32,768..=32,767, and of it [`tanh_code`](crate::network::tanh_code), two to a word.
    Tanh {
        /// Code of 1, at most 32,767.
        limit: u16,
    },
    /// The identity: ⌊a m / 2³² + ½⌋ within ±limit, two to a word.
    Linear {
        /// Largest code, at most 32,767.
        limit: u16,
    },
    /// The accumulator itself, one to a word.
    Sums,
}

impl Finish {
    /// Words of outputs for each block.
    pub const fn words(self) -> usize {
        match self {
            Self::Codes { .. } | Self::Tanh { .. } | Self::Linear { .. } => ROWS / 2,
            Self::Sums => ROWS,
        }
    }
}

/// Rows of a float layer of so many outputs.
pub const fn float_rows(outputs: usize) -> usize {
    match outputs {
        ..=6 => 6,
        7 => 8,
        _ => outputs.next_multiple_of(4),
    }
}

/// How many blocks of twelve, eight and six rows make so many rows; none if that is not possible.
pub const fn float_blocks(rows: usize) -> Option<[usize; 3]> {
    if rows == 6 {
        return Some([0, 0, 1]);
    }
    if rows < 8 || !rows.is_multiple_of(4) {
        return None;
    }
    let eights = [0, 2, 1][rows / 4 % 3];
    Some([(rows - 8 * eights) / 12, eights, 0])
}
