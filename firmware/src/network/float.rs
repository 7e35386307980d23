//! Dense layers in f32.

use super::{Activation, ROWS, kernel};
use crate::model::{Blob, LayerLayout, Refusal, Section, Words};

/// Inputs are padded to a multiple of this.
const PADDING: usize = 2;

/// One checked layer.
#[derive(Debug)]
pub(super) struct Layer<'a> {
    stream: Words<'a>,
    inputs: u16,
    outputs: u16,
    activation: Activation,
}

impl<'a> Layer<'a> {
    pub(super) fn new(blob: &Blob<'a>, layout: &LayerLayout) -> Result<Self, Refusal> {
        let (inputs, outputs) = (layout.inputs.into(), layout.outputs.into());
        Self::checked(blob, layout.rows, [inputs, outputs], layout.activation, "layer rows")
    }

    /// The linear skip.
    pub(super) fn skip(blob: &Blob<'a>, section: Section, inputs: usize, outputs: usize) -> Result<Self, Refusal> {
        Self::checked(blob, section, [inputs, outputs], Activation::Linear, "skip rows")
    }

    fn checked(
        blob: &Blob<'a>,
        section: Section,
        [inputs, outputs]: [usize; 2],
        activation: Activation,
        what: &'static str,
    ) -> Result<Self, Refusal> {
        let (inputs, outputs) = (inputs.next_multiple_of(PADDING), kernel::float_rows(outputs));
        blob.floats(section, outputs * (1 + inputs), what)?;
        let stream = blob.words(section, outputs * (1 + inputs), what)?;
        Ok(Self { stream, inputs: inputs as u16, outputs: outputs as u16, activation })
    }

    #[inline(always)]
    fn run(&self, inputs: &[u32], outputs: &mut [u32]) {
        let (Some(inputs), Some(outputs)) = (inputs.get(..self.inputs.into()), outputs.get_mut(..self.outputs.into())) else {
            return;
        };
        kernel::float(self.stream.all(), inputs, self.activation == Activation::Relu, outputs);
        if self.activation == Activation::Tanh {
            kernel::tanh(outputs);
        }
    }

    /// Writes the outputs of the skip.
    #[inline(never)]
    pub(super) fn outputs(&self, inputs: &[u32], result: &mut [f32]) {
        let mut outputs = [0; ROWS];
        self.run(inputs, &mut outputs);
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
