//! Dense layers with int8 weights, 16-bit activations and 32-bit accumulators.
//!
//! A row's accumulator is Σ weight × code + bias; validation proves that it cannot overflow. A hidden layer turns it into
//! the next layer's code with one rounded multiplication, (accumulator × multiplier + 2³¹) / 2³², what SMMULR does on an Armv7E-M.

use super::{Activation, CODE_LIMIT, ROWS, padded, tanh::tanh_code};
use crate::{
    math::round_to_i32,
    model::{Blob, Floats, Integers, LayerLayout, MAX_OUTPUTS, MAX_WIDTH, Refusal},
};

#[derive(Debug)]
enum Requantisation<'a> {
    /// To the next layer's codes.
    Codes(Integers<'a>),
    /// To f32, one scale a row.
    Floats(Floats<'a>),
}

/// One checked layer.
#[derive(Debug)]
pub(super) struct Layer<'a> {
    inputs: usize,
    /// Packed rows: `[block][input][row in block]`.
    weights: &'a [[u8; ROWS]],
    bias: Integers<'a>,
    requantisation: Requantisation<'a>,
    activation: Activation,
}

impl<'a> Layer<'a> {
    pub(super) fn new(blob: &Blob<'a>, layout: &LayerLayout, index: u8, last: bool) -> Result<Self, Refusal> {
        let (inputs, rows) = (usize::from(layout.inputs), padded(layout.outputs.into()));
        let requantisation = if last {
            Requantisation::Floats(blob.floats(layout.requantisation, rows, "layer row scales")?)
        } else {
            Requantisation::Codes(blob.integers(layout.requantisation, rows, "layer multipliers")?)
        };
        let layer = Self {
            inputs,
            weights: blob.bytes(layout.weights, inputs * rows, "layer weights")?.as_chunks().0,
            bias: blob.integers(layout.bias, rows, "layer bias")?,
            requantisation,
            activation: layout.activation,
        };
        layer.refuse_overflow(index)?;
        Ok(layer)
    }

    /// No accumulator may leave 32 bits for any codes.
    fn refuse_overflow(&self, index: u8) -> Result<(), Refusal> {
        for (block, bias) in self.weights.chunks(self.inputs.max(1)).zip(self.bias.blocks::<ROWS>()) {
            let mut largest = bias.map(|bias| i64::from(bias).abs());
            for row in block {
                for (sum, weight) in largest.iter_mut().zip(row) {
                    *sum += i64::from((*weight as i8).unsigned_abs()) * i64::from(CODE_LIMIT);
                }
            }
            if largest.iter().any(|sum| *sum > i64::from(i32::MAX)) {
                return Err(Refusal::Overflow { layer: index });
            }
        }
        Ok(())
    }

    /// Accumulators of each block of rows.
    fn accumulators<'l>(&'l self, codes: &'l [i16]) -> impl Iterator<Item = [i32; ROWS]> + 'l {
        self.weights.chunks(self.inputs.max(1)).zip(self.bias.blocks::<ROWS>()).map(move |(block, bias)| {
            let mut sums = bias;
            for (row, &code) in block.iter().zip(codes) {
                for (sum, weight) in sums.iter_mut().zip(row) {
                    *sum = sum.wrapping_add(i32::from(*weight as i8).wrapping_mul(i32::from(code)));
                }
            }
            sums
        })
    }

    fn hidden(&self, codes: &[i16], outputs: &mut [i16]) {
        let Requantisation::Codes(multipliers) = self.requantisation else { return };
        let blocks = outputs.as_chunks_mut::<ROWS>().0.iter_mut().zip(multipliers.blocks::<ROWS>());
        for ((outputs, multipliers), sums) in blocks.zip(self.accumulators(codes)) {
            for ((output, multiplier), sum) in outputs.iter_mut().zip(multipliers).zip(sums) {
                let code = requantise(sum, multiplier);
                *output = match self.activation {
                    Activation::Linear => code,
                    Activation::Relu => code.max(0),
                    Activation::Tanh => tanh_code(code),
                };
            }
        }
    }

    fn output(&self, codes: &[i16], result: &mut [f32; MAX_OUTPUTS]) {
        let Requantisation::Floats(scales) = self.requantisation else { return };
        let sums = self.accumulators(codes).flatten();
        for ((value, sum), scale) in result.iter_mut().zip(sums).zip(scales.iter()) {
            *value = sum as f32 * scale;
        }
    }
}

/// Rounded high word of accumulator × multiplier, saturated to a code.
#[inline(always)]
pub fn requantise(accumulator: i32, multiplier: i32) -> i16 {
    let product = i64::from(accumulator) * i64::from(multiplier);
    let rounded = (product.wrapping_add(1 << 31) >> 32) as i32;
    rounded.clamp(-CODE_LIMIT, CODE_LIMIT) as i16
}

/// Runs the layers from normalised `inputs` to `result`.
pub(super) fn evaluate(
    layers: &[Layer<'_>],
    inputs: &[f32],
    code: f32,
    buffers: &mut [[i16; MAX_WIDTH]; 2],
    result: &mut [f32; MAX_OUTPUTS],
) {
    let Some((last, hidden)) = layers.split_last() else { return };
    let [mut current, mut other] = buffers.each_mut();
    for (value, input) in current.iter_mut().zip(inputs) {
        *value = round_to_i32(*input * code, CODE_LIMIT) as i16;
    }
    for layer in hidden {
        layer.hidden(current, other);
        core::mem::swap(&mut current, &mut other);
    }
    last.output(current, result);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn requantisation_is_a_rounded_product(accumulator in any::<i32>(), multiplier in any::<i32>()) {
            let exact = f64::from(accumulator) * f64::from(multiplier) / 4_294_967_296.0;
            let found = f64::from(requantise(accumulator, multiplier));
            let limit = f64::from(CODE_LIMIT);
            prop_assert!((found - exact.clamp(-limit, limit)).abs() <= 0.500_001);
        }
    }
}
