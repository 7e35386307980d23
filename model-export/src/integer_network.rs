//! Dense layers in integers, rows not yet packed: what quantisation makes and what the packing reads.
//!
//! *in* codes of a layer's inputs; *out* its exact accumulators and the codes of its outputs; *never* another arithmetic than the
//! firmware's; *source* `impromptu_firmware::network::integer`.

use impromptu_firmware::network::{INPUT_PADDING, requantise, tanh_code};

use crate::float_network::Activation;

/// One integer layer, rows not yet packed.
#[derive(Clone, Debug, PartialEq)]
pub struct IntegerLayer {
    /// Inputs of each row.
    pub inputs: usize,
    /// Effective weights, row-major `[outputs padded to whole blocks][inputs padded]`. int8: with the fractions that the packing
    /// brings.
    pub weights: Vec<i16>,
    /// One for each output, in units of the accumulator.
    pub bias: Vec<i32>,
    /// Hidden layers: accumulator to next code, times 2³².
    pub multipliers: Vec<i32>,
    /// Last layer: accumulator to normalised output.
    pub row_scales: Vec<f32>,
    /// Largest magnitude of an input code.
    pub input_limit: u16,
    /// Activation.
    pub activation: Activation,
}

/// The dense layers of a network in integers. The skip stays in f32: it carries nearly all of the correction and costs little.
#[derive(Clone, Debug, PartialEq)]
pub struct IntegerNetwork {
    /// Factor from a normalised input to its code.
    pub input_code: f32,
    /// Layers.
    pub layers: Vec<IntegerLayer>,
}

impl IntegerLayer {
    /// Inputs of a packed row.
    pub fn stride(&self) -> usize {
        self.inputs.next_multiple_of(INPUT_PADDING)
    }

    /// Effective weights of an output.
    pub fn row(&self, row: usize) -> &[i16] {
        &self.weights[row * self.stride()..][..self.inputs]
    }

    /// The exact accumulator of an output.
    pub fn accumulator(&self, row: usize, codes: &[i16]) -> i64 {
        let products = self.row(row).iter().zip(codes).map(|(weight, code)| i64::from(*weight) * i64::from(*code));
        i64::from(self.bias[row]) + products.sum::<i64>()
    }

    /// A hidden layer's codes, of which `limit` is the largest: the firmware's arithmetic.
    pub fn codes(&self, codes: &[i16], limit: u16) -> Vec<i16> {
        let one = |row: usize| {
            let code = requantise(self.accumulator(row, codes) as i32, self.multipliers[row]);
            let limit_code = i32::from(limit);
            match self.activation {
                Activation::Relu => code.clamp(0, limit_code) as i16,
                Activation::Linear => code.clamp(-limit_code, limit_code) as i16,
                Activation::Tanh => tanh_code(code.clamp(i16::MIN.into(), i16::MAX.into()) as i16, limit),
            }
        };
        (0..self.bias.len()).map(one).collect()
    }
}
