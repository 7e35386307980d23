//! Integer layers over blocks of rows: the firmware's codes, one row of the batch in each vector lane.

use impromptu_firmware::network::{requantise, tanh_code};
use pulp::{Arch, Simd, WithSimd};

use super::padded_matrix::PaddedMatrix;
use crate::{
    float_network::Activation,
    stored_network::{Requantisation, StoredIntegerLayer},
};

/// Rows that are evaluated together: the activations of two layers of 128 units stay in the second-level cache.
pub(super) const BLOCK: usize = 128;
/// Rows of the batch in a tile.
const LANES: usize = 32;
/// Outputs in a tile.
const OUTPUTS: usize = 4;

/// Codes of one layer: for each unit those of the batch's rows.
type Codes = Vec<[i16; BLOCK]>;

/// The layers and the codes between them.
pub(super) struct IntegerLayers {
    input_code: f32,
    layers: Vec<StoredIntegerLayer>,
    inputs: Codes,
    outputs: Codes,
    result: PaddedMatrix,
}

impl IntegerLayers {
    pub(super) fn new(input_code: f32, layers: &[StoredIntegerLayer]) -> Self {
        let outputs = layers.last().map_or(0, |last| last.bias.len());
        Self {
            input_code,
            layers: layers.to_vec(),
            inputs: Vec::new(),
            outputs: Vec::new(),
            result: PaddedMatrix::zeros(BLOCK, outputs),
        }
    }

    /// Normalised outputs, if there is a layer.
    pub(super) fn result(&self) -> Option<&PaddedMatrix> {
        self.layers.last().map(|_| &self.result)
    }

    /// From normalised inputs to normalised outputs, over the first `rows` rows.
    pub(super) fn forward(&mut self, arch: Arch, rows: usize, inputs: &PaddedMatrix) {
        self.inputs.clear();
        self.inputs.resize(inputs.columns, [0; BLOCK]);
        let limit = self.layers.first().map_or(0.0, |layer| f32::from(layer.input_limit));
        for row in 0..rows {
            for (codes, value) in self.inputs.iter_mut().zip(inputs.row(row)) {
                codes[row] = (value * self.input_code).round_ties_even().clamp(-limit, limit) as i16;
            }
        }
        for (index, layer) in self.layers.iter().enumerate() {
            let limit = self.layers.get(index + 1).map_or(0, |next| next.input_limit);
            self.outputs.clear();
            self.outputs.resize(layer.bias.len(), [0; BLOCK]);
            for first_row in (0..rows).step_by(LANES) {
                for first_output in (0..layer.bias.len()).step_by(OUTPUTS) {
                    let tile = tile(arch, layer, &self.inputs, first_output, first_row);
                    for (output, sums) in (first_output..layer.bias.len()).zip(&tile) {
                        match &layer.requantisation {
                            Requantisation::Codes(multipliers) => {
                                for (code, sum) in self.outputs[output][first_row..].iter_mut().zip(sums) {
                                    *code = activated(layer.activation, requantise(*sum, multipliers[output]), limit);
                                }
                            }
                            Requantisation::Floats(scales) => {
                                for (row, sum) in (first_row..rows).zip(sums) {
                                    self.result.row_mut(row)[output] = *sum as f32 * scales[output];
                                }
                            }
                        }
                    }
                }
            }
            std::mem::swap(&mut self.inputs, &mut self.outputs);
        }
    }
}

#[inline(always)]
fn activated(activation: Activation, code: i32, limit: u16) -> i16 {
    let most = i32::from(limit);
    match activation {
        Activation::Linear => code.clamp(-most, most) as i16,
        Activation::Relu => code.clamp(0, most) as i16,
        Activation::Tanh => tanh_code(code.clamp(i16::MIN.into(), i16::MAX.into()) as i16, limit),
    }
}

/// Accumulators of `OUTPUTS` outputs (what is beyond the last is zero) and `LANES` rows. Sums of integers that cannot overflow
/// may be taken in any order.
fn tile(
    arch: Arch,
    layer: &StoredIntegerLayer,
    inputs: &Codes,
    first_output: usize,
    first_row: usize,
) -> [[i32; LANES]; OUTPUTS] {
    let width = inputs.len();
    let weights: [&[i32]; OUTPUTS] = core::array::from_fn(|output| {
        let start = (first_output + output) * width;
        layer.weights.get(start..start + width).unwrap_or_default()
    });
    let bias = core::array::from_fn(|output| layer.bias.get(first_output + output).copied().unwrap_or(0));
    arch.dispatch(Tile { inputs, weights, bias, first_row })
}

struct Tile<'a> {
    inputs: &'a [[i16; BLOCK]],
    weights: [&'a [i32]; OUTPUTS],
    bias: [i32; OUTPUTS],
    first_row: usize,
}

impl WithSimd for Tile<'_> {
    type Output = [[i32; LANES]; OUTPUTS];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let mut sums = self.bias.map(|bias| [bias; LANES]);
        for (input, codes) in self.inputs.iter().enumerate() {
            let codes: &[i16; LANES] = codes[self.first_row..].first_chunk().expect("blocks are whole tiles");
            for (sums, weights) in sums.iter_mut().zip(self.weights) {
                let weight = weights.get(input).copied().unwrap_or(0);
                for (sum, code) in sums.iter_mut().zip(codes) {
                    *sum = sum.wrapping_add(weight.wrapping_mul(i32::from(*code)));
                }
            }
        }
        sums
    }
}
