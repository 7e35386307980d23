//! Plain rounding to integers, for the forward pass of quantisation-aware training.
//!
//! The exporter has the same step for each row, but rounds more cleverly (`impromptu_model_export::quantise`): an error in one
//! column is made good by the columns to come, and a packed weight carries a known fraction of a step. So training sees about the
//! noise that export brings, somewhat more of it at the outputs, and never the very numbers that are flown.
//!
//! Weights: int8, symmetric, one scale for each output row: `scale = max|w| / 127` (1 for a row of zeros), number =
//! `w / scale` rounded half away from zero. Activations: a signed integer of n bits with one scale for each layer's input,
//! `scale = largest value / (2^(n-1) - 1)`, rounded alike, clamped.

use impromptu_model_export::{batch::padded_matrix::PaddedMatrix, float_network::FloatNetwork};
use pulp::Arch;

/// The largest int8 weight; -128 is not used, so that the range is symmetric.
pub const LARGEST_WEIGHT: f32 = 127.0;

/// The scale of one output row of weights.
pub fn row_scale(row: &[f32]) -> f32 {
    scale_of(row.iter().fold(0.0, |largest: f32, weight| largest.max(weight.abs())), LARGEST_WEIGHT)
}

/// The network with each weight of its layers replaced by the nearest whole number of its row's steps; biases and skip as they
/// are.
pub fn with_rounded_weights(network: &FloatNetwork) -> FloatNetwork {
    let mut rounded = network.clone();
    for layer in &mut rounded.layers {
        let inputs = layer.weights.len() / layer.outputs().max(1);
        for row in layer.weights.chunks_exact_mut(inputs.max(1)) {
            let scale = row_scale(row);
            row.iter_mut().for_each(|weight| *weight = round_to(*weight, scale, LARGEST_WEIGHT));
        }
    }
    rounded
}

/// The scale and largest number of a signed integer of so many bits that covers ±`largest`.
pub(super) fn activation_range(largest: f32, bits: u32) -> (f32, f32) {
    let limit = ((1u32 << (bits - 1)) - 1) as f32;
    (scale_of(largest, limit), limit)
}

fn scale_of(largest: f32, limit: f32) -> f32 {
    if largest > 0.0 { largest / limit } else { 1.0 }
}

#[inline(always)]
fn round_to(value: f32, scale: f32, limit: f32) -> f32 {
    (value / scale).round().clamp(-limit, limit) * scale
}

/// Rounds the weights of one layer, `[inputs][outputs]` as in training; `scales` is scratch space of at least one padded
/// row.
pub(super) fn round_weights(arch: Arch, from: &PaddedMatrix, to: &mut PaddedMatrix, scales: &mut [f32]) {
    let (stride, width) = (from.stride, from.width());
    arch.dispatch(
        #[inline(always)]
        || {
            // Moved in for the reason given in `elementwise`.
            let (to, scales) = (to, scales);
            let scales = &mut scales[..width];
            scales.fill(0.0);
            for row in from.values.chunks_exact(stride) {
                for (largest, weight) in scales.iter_mut().zip(row) {
                    *largest = largest.max(weight.abs());
                }
            }
            for scale in scales.iter_mut() {
                *scale = if *scale > 0.0 { *scale / LARGEST_WEIGHT } else { 1.0 };
            }
            for (source, target) in from.values.chunks_exact(stride).zip(to.values.chunks_exact_mut(stride)) {
                for ((slot, weight), scale) in target.iter_mut().zip(source).zip(scales.iter()) {
                    *slot = round_to(*weight, *scale, LARGEST_WEIGHT);
                }
            }
        },
    );
}

/// Rounds the first `rows` rows in place.
pub(super) fn round_activations(arch: Arch, matrix: &mut PaddedMatrix, rows: usize, (scale, limit): (f32, f32)) {
    arch.dispatch(
        #[inline(always)]
        || {
            // Moved in for the reason given in `elementwise`.
            let matrix = matrix;
            for row in 0..rows {
                for value in matrix.wide_row_mut(row) {
                    *value = round_to(*value, scale, limit);
                }
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use impromptu_model_export::float_network::{Activation, DenseLayer};

    #[test]
    fn rounds_half_away_from_zero_by_row() {
        assert_eq!(row_scale(&[1.0, -2.0]), 2.0 / 127.0);
        assert_eq!(row_scale(&[0.0]), 1.0);
        assert_eq!([2.5, -2.5, 2.4, 300.0].map(|value| round_to(value, 1.0, 127.0)), [3.0, -3.0, 2.0, 127.0]);
        assert_eq!(activation_range(8.0, 4), (8.0 / 7.0, 7.0));
    }

    #[test]
    fn training_rounds_to_the_nearest_step_of_each_row() {
        let (inputs, outputs) = (13, 19);
        let weight = |input: usize, output: usize| {
            if output == 3 { 0.0 } else { ((input * 37 + output * 11) % 29) as f32 / 7.3 - 1.9 }
        };
        let network = FloatNetwork {
            input_mean: vec![0.0; inputs],
            input_scale: vec![1.0; inputs],
            layers: vec![DenseLayer {
                weights: (0..outputs * inputs).map(|index| weight(index % inputs, index / inputs)).collect(),
                bias: vec![0.3; outputs],
                activation: Activation::Linear,
            }],
            skip: None,
            output_mean: vec![0.0; outputs],
            output_scale: vec![1.0; outputs],
            notes: Default::default(),
        };
        let expected = with_rounded_weights(&network);
        assert_ne!(expected, network);
        let source = PaddedMatrix::from_fn(inputs, outputs, weight);
        let mut rounded = PaddedMatrix::zeros(inputs, outputs);
        round_weights(Arch::new(), &source, &mut rounded, &mut [7.0; 64]);
        for (index, value) in expected.layers[0].weights.iter().enumerate() {
            assert_eq!(*value, rounded.row(index % inputs)[index / inputs]);
        }
        assert_eq!(with_rounded_weights(&expected), expected, "rounding twice changes nothing");
    }
}
