//! Dense layers over a packed stream of weights: what the kernels compute, and which of them runs.
//!
//! *in* one layer's stream and the words of its inputs; *out* the words of its outputs; *never* reads beyond the slices, panics
//! or gives other bits on another machine; *source* the packed orders below.
//!
//! A Cortex-M core with the DSP extension runs hand-written assembly for integer layers, one with an FPU for float layers; every
//! other machine (and each for a stream that is not aligned to words) runs the [portable twin](portable). Both give the same
//! bits. The choice is made by the target that is compiled for, in `build.rs`:
//!
//! | target | cores | integers | floats |
//! |---|---|---|---|
//! | `thumbv7em-none-eabihf` | M4F, M7 | assembly | assembly |
//! | `thumbv7em-none-eabi` | M4, M7 | assembly | twin |
//! | `thumbv8m.main-none-eabihf` | M33, M35P, M55, M85 | assembly with the Cargo feature `dsp` | assembly |
//! | `thumbv8m.main-none-eabi` | the same | assembly with the Cargo feature `dsp` | twin |
//! | others | M0, M3, M23, RISC-V, WebAssembly, x86-64, … | twin | twin |
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

#[cfg(any(dsp, fpu))]
mod cortex_m;
pub mod portable;

use super::ROWS;

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
    /// tanh: ⌊a m / 2³² + ½⌋ within −32,768..=32,767, and of it [`tanh_code`](super::tanh_code), two to a word.
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

/// Which instructions [`Integer`] and [`Float`] run on an aligned stream.
pub const NAME: &str = match (cfg!(dsp), cfg!(fpu)) {
    (true, true) => "DSP and FPU",
    (true, false) => "DSP",
    (false, true) => "FPU",
    (false, false) => "portable",
};

/// An integer layer, checked once: an evaluation then checks two lengths alone.
#[derive(Clone, Debug)]
pub struct Integer<'a> {
    stream: &'a [[u8; 4]],
    width: Width,
    finish: Finish,
    inputs: usize,
    outputs: usize,
    #[cfg(dsp)]
    assembly: Option<cortex_m::Integer<'a>>,
}

impl<'a> Integer<'a> {
    /// A layer of `inputs` words (an even number) and the blocks in `stream`.
    pub fn new(width: Width, stream: &'a [[u8; 4]], inputs: usize, finish: Finish) -> Self {
        let outputs = stream.len() / width.block(inputs) * finish.words();
        #[cfg(dsp)]
        let assembly = cortex_m::Integer::new(width, stream, inputs, finish);
        Self {
            stream,
            width,
            finish,
            inputs,
            outputs,
            #[cfg(dsp)]
            assembly,
        }
    }

    /// Its blocks.
    pub(super) fn stream(&self) -> &'a [[u8; 4]] {
        self.stream
    }

    /// Reads the first words of `inputs`, which are pairs of codes, and writes the first ones of `outputs`, [`Finish::words`] for
    /// each block; does nothing if either are too few.
    #[inline(always)]
    pub fn run(&self, inputs: &[u32], outputs: &mut [u32]) {
        #[cfg(dsp)]
        if let Some(assembly) = &self.assembly {
            assembly.run(inputs, outputs);
            return;
        }
        if let (Some(inputs), Some(outputs)) = (inputs.get(..self.inputs), outputs.get_mut(..self.outputs)) {
            portable::integer(self.width, self.stream, inputs, self.finish, outputs);
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

/// A float layer, checked once.
#[derive(Clone, Debug)]
pub struct Float<'a> {
    stream: &'a [[u8; 4]],
    relu: bool,
    inputs: u16,
    outputs: u16,
    #[cfg(fpu)]
    assembly: Option<cortex_m::Float<'a>>,
}

impl<'a> Float<'a> {
    /// A layer of `inputs` words (an even number) and `outputs` rows, those of [`float_rows`].
    pub fn new(stream: &'a [[u8; 4]], inputs: u16, relu: bool, outputs: u16) -> Self {
        #[cfg(fpu)]
        let assembly = cortex_m::Float::new(stream, inputs.into(), relu, outputs.into());
        Self {
            stream,
            relu,
            inputs,
            outputs,
            #[cfg(fpu)]
            assembly,
        }
    }

    /// Reads the bits of f32 in the first words of `inputs` and writes the first ones of `outputs`; does nothing if either are
    /// too few.
    #[inline(always)]
    pub fn run(&self, inputs: &[u32], outputs: &mut [u32]) {
        #[cfg(fpu)]
        if let Some(assembly) = &self.assembly {
            assembly.run(inputs, outputs);
            return;
        }
        if let (Some(inputs), Some(outputs)) = (inputs.get(..self.inputs.into()), outputs.get_mut(..self.outputs.into())) {
            portable::float(self.stream, inputs, self.relu, outputs);
        }
    }
}

/// The [`tanh`](super::tanh()) of each f32.
#[inline]
pub fn tanh(words: &mut [u32]) {
    #[cfg(fpu)]
    let words = cortex_m::tanh(words);
    portable::tanh(words);
}
