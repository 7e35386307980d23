//! Dense layers over a packed stream of weights: what the kernels compute, and which of them runs.
//!
//! *in* one layer's stream and the words of its inputs; *out* the words of its outputs; *never* reads beyond the slices, panics
//! or gives other bits on another machine; *source* the packed orders in [`stream`].
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

#[cfg(any(dsp, fpu))]
mod cortex_m;
pub mod portable;
pub mod stream;

pub use stream::{Finish, Width, float_blocks, float_rows};

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
