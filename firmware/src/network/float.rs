//! Dense layers in f32.

use super::{Activation, ROWS, padded};
use crate::{
    math,
    model::{Blob, Floats, LayerLayout, MAX_OUTPUTS, MAX_WIDTH, Refusal, Section},
};

/// One checked layer.
#[derive(Debug)]
pub(super) struct Layer<'a> {
    inputs: usize,
    weights: Floats<'a>,
    bias: Floats<'a>,
    activation: Activation,
}

impl<'a> Layer<'a> {
    pub(super) fn new(blob: &Blob<'a>, layout: &LayerLayout) -> Result<Self, Refusal> {
        let (inputs, rows) = (usize::from(layout.inputs), padded(layout.outputs.into()));
        Ok(Self {
            inputs,
            weights: blob.floats(layout.weights, inputs * rows, "layer weights")?,
            bias: blob.floats(layout.bias, rows, "layer bias")?,
            activation: layout.activation,
        })
    }

    /// The linear skip: weights only.
    pub(super) fn skip(blob: &Blob<'a>, section: Section, inputs: usize, outputs: usize) -> Result<Self, Refusal> {
        let weights = blob.floats(section, inputs * padded(outputs), "skip weights")?;
        Ok(Self { inputs, weights, bias: Floats::default(), activation: Activation::Linear })
    }

    /// Adds weights × inputs to `sums`, a block of rows at a time.
    pub(super) fn accumulate(&self, inputs: &[f32], sums: &mut [f32]) {
        let mut weights = self.weights;
        for block in sums.as_chunks_mut::<ROWS>().0 {
            let (these, rest) = weights.split_at(ROWS * self.inputs);
            weights = rest;
            let mut accumulators = *block;
            for (row, &input) in these.blocks::<ROWS>().zip(inputs) {
                for (accumulator, weight) in accumulators.iter_mut().zip(row) {
                    *accumulator += weight * input;
                }
            }
            *block = accumulators;
        }
    }

    fn forward(&self, inputs: &[f32], outputs: &mut [f32]) {
        for (output, bias) in outputs.iter_mut().zip(self.bias.iter()) {
            *output = bias;
        }
        let rows = outputs.get_mut(..self.bias.len()).unwrap_or_default();
        self.accumulate(inputs, rows);
        match self.activation {
            Activation::Linear => {}
            Activation::Relu => rows.iter_mut().for_each(|value| *value = if *value > 0.0 { *value } else { 0.0 }),
            Activation::Tanh => rows.iter_mut().for_each(|value| *value = math::tanh(*value)),
        }
    }
}

/// Runs the layers from `inputs` to `result`.
pub(super) fn evaluate(
    layers: &[Layer<'_>],
    inputs: &[f32],
    buffers: &mut [[f32; MAX_WIDTH]; 2],
    result: &mut [f32; MAX_OUTPUTS],
) {
    let Some((last, hidden)) = layers.split_last() else { return };
    let [mut current, mut other] = buffers.each_mut();
    for (value, input) in current.iter_mut().zip(inputs) {
        *value = *input;
    }
    for layer in hidden {
        layer.forward(current, other);
        core::mem::swap(&mut current, &mut other);
    }
    last.forward(current, result);
}
