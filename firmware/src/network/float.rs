//! Dense layers in f32.
//!
//! *in* words of f32 bits; *out* the same of the next layer; *never* another order of operations than the kernel's; *source*
//! [`super::kernel`].

use super::{
    kernel,
    shape::{ROWS, padded},
};
use crate::format::{
    Activation, Blob, LayerLayout, MAX_OUTPUTS, Refusal, Section,
    ranges::{LAYER_ROWS, Range, SKIP_ROWS},
};

/// Inputs are padded to a multiple of this.
const PADDING: usize = 2;

/// One checked layer.
#[derive(Debug)]
pub(super) struct Layer<'a> {
    kernel: kernel::Float<'a>,
    outputs: u16,
    tanh: bool,
}

impl<'a> Layer<'a> {
    pub(super) fn new(blob: &Blob<'a>, layout: &LayerLayout) -> Result<Self, Refusal> {
        let (inputs, outputs) = (layout.inputs.into(), layout.outputs.into());
        Self::checked(blob, layout.rows, [inputs, outputs], layout.activation, &LAYER_ROWS)
    }

    /// The linear skip.
    pub(super) fn skip(blob: &Blob<'a>, section: Section, inputs: usize, outputs: usize) -> Result<Self, Refusal> {
        Self::checked(blob, section, [inputs, outputs], Activation::Linear, &SKIP_ROWS)
    }

    fn checked(
        blob: &Blob<'a>,
        section: Section,
        [inputs, outputs]: [usize; 2],
        activation: Activation,
        range: &Range,
    ) -> Result<Self, Refusal> {
        let (inputs, outputs) = (inputs.next_multiple_of(PADDING), kernel::float_rows(outputs));
        range.all(blob.floats(section, outputs * (1 + inputs), range.what)?)?;
        let stream = blob.words(section, outputs * (1 + inputs), range.what)?.all();
        let kernel = kernel::Float::new(stream, inputs as u16, activation == Activation::Relu, outputs as u16);
        Ok(Self { kernel, outputs: outputs as u16, tanh: activation == Activation::Tanh })
    }

    #[inline(always)]
    fn run(&self, inputs: &[u32], outputs: &mut [u32]) {
        self.kernel.run(inputs, outputs);
        if self.tanh
            && let Some(outputs) = outputs.get_mut(..self.outputs.into())
        {
            kernel::tanh(outputs);
        }
    }

    /// Writes the outputs of the skip.
    #[inline(never)]
    pub(super) fn outputs(&self, inputs: &[u32], result: &mut [f32]) {
        if result.len() > ROWS {
            self.more_outputs(inputs, result);
        } else {
            self.rows::<ROWS>(inputs, result);
        }
    }

    /// Of a skip with more rows than a block. Apart from what a small network needs of the stack.
    #[cold]
    #[inline(never)]
    fn more_outputs(&self, inputs: &[u32], result: &mut [f32]) {
        self.rows::<{ padded(MAX_OUTPUTS) }>(inputs, result);
    }

    /// The outputs of a skip with at most this many rows.
    #[inline(always)]
    fn rows<const N: usize>(&self, inputs: &[u32], result: &mut [f32]) {
        let mut outputs = [0; N];
        // It is linear.
        self.kernel.run(inputs, &mut outputs);
        for (result, output) in result.iter_mut().zip(outputs) {
            *result = f32::from_bits(output);
        }
    }
}

/// Runs all layers on the inputs in `current`; gives the last one's outputs.
#[inline(always)]
pub(super) fn outputs<'s>(layers: &[Layer<'_>], mut current: &'s mut [u32], mut other: &'s mut [u32]) -> &'s [u32] {
    if layers.is_empty() {
        current.fill(0);
    }
    for layer in layers {
        layer.run(current, other);
        core::mem::swap(&mut current, &mut other);
    }
    current
}
