//! Fixed-size feed-forward network: normalise, dense layers plus a linear skip, denormalise.
//!
//! *in* features in physical units; *out* corrections in physical units; *never* allocates, panics or gives other bits on another
//! machine; *source* Zhou 2017, section IV-A (dense layers); the linear skip from inputs to outputs is ours.
//!
//! Packed order of every weight matrix, f32 and int8: blocks of [`ROWS`] outputs; within a block, for each input in turn,
//! the weights of the block's outputs side by side. The last block is padded with zero rows, and so are bias and requantisation.
//! A sum is therefore taken over the inputs in order, for eight outputs at once.

mod float;
mod integer;
mod tanh;

use serde::{Deserialize, Serialize};

use crate::model::{Arithmetic, Blob, Floats, MAX_FEATURES, MAX_OUTPUTS, MAX_WIDTH, NetworkLayout, Refusal};

pub use integer::requantise;
pub use tanh::{TANH_INPUT_ONE, tanh_code};

/// Outputs that are computed side by side.
pub const ROWS: usize = 8;
/// Largest magnitude of a 16-bit activation code.
pub const CODE_LIMIT: i32 = 32_767;

/// Non-linearity behind a dense layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Activation {
    /// The identity.
    Linear,
    /// max(0, x).
    Relu,
    /// Hyperbolic tangent.
    Tanh,
}

/// Working memory of one evaluation.
#[derive(Clone, Debug)]
pub struct Scratch {
    normalised: [f32; MAX_FEATURES],
    floats: [[f32; MAX_WIDTH]; 2],
    codes: [[i16; MAX_WIDTH]; 2],
}

impl Scratch {
    /// Zeroed memory.
    pub const fn new() -> Self {
        Self { normalised: [0.0; MAX_FEATURES], floats: [[0.0; MAX_WIDTH]; 2], codes: [[0; MAX_WIDTH]; 2] }
    }
}

impl Default for Scratch {
    fn default() -> Self {
        Self::new()
    }
}

#[derive(Debug)]
enum Layers<'a> {
    Float(heapless::Vec<float::Layer<'a>, { crate::model::MAX_LAYERS }>),
    Integer { code: f32, layers: heapless::Vec<integer::Layer<'a>, { crate::model::MAX_LAYERS }> },
}

/// A network whose shapes and sections have been checked.
#[derive(Debug)]
pub struct Network<'a> {
    mean: Floats<'a>,
    reciprocal_scale: Floats<'a>,
    layers: Layers<'a>,
    skip: Option<float::Layer<'a>>,
    output_scale: Floats<'a>,
    output_mean: Floats<'a>,
    multiply_adds: u32,
}

impl<'a> Network<'a> {
    /// Checks shapes and sections against `inputs` features and `outputs` corrections.
    pub(crate) fn new(layout: &NetworkLayout, blob: &Blob<'a>, inputs: usize, outputs: usize) -> Result<Self, Refusal> {
        if inputs > MAX_FEATURES || outputs == 0 || outputs > MAX_OUTPUTS {
            return Err(Refusal::Shape { what: "number of outputs", found: outputs as u32, limit: MAX_OUTPUTS as u32 });
        }
        let (mean, reciprocal_scale) =
            blob.floats(layout.input_normalisation, 2 * inputs, "input normalisation")?.split_at(inputs);
        let (output_scale, output_mean) =
            blob.floats(layout.output_normalisation, 2 * outputs, "output normalisation")?.split_at(outputs);
        let mut width = inputs;
        let mut multiply_adds = 0;
        for (index, layer) in layout.layers.iter().enumerate() {
            if usize::from(layer.inputs) != width {
                return Err(Refusal::Shape { what: "layer inputs", found: layer.inputs.into(), limit: width as u32 });
            }
            multiply_adds += u32::from(layer.inputs) * u32::from(layer.outputs);
            width = usize::from(layer.outputs);
            let last = index + 1 == layout.layers.len();
            if last && (width != outputs || layer.activation != Activation::Linear) {
                return Err(Refusal::Shape {
                    what: "outputs of the last (linear) layer",
                    found: width as u32,
                    limit: outputs as u32,
                });
            }
        }
        let skip = if layout.skip.length > 0 {
            multiply_adds += (inputs * outputs) as u32;
            Some(float::Layer::skip(blob, layout.skip, inputs, outputs)?)
        } else if layout.layers.is_empty() {
            return Err(Refusal::Shape {
                what: "number of layers without a skip",
                found: 0,
                limit: crate::model::MAX_LAYERS as u32,
            });
        } else {
            None
        };
        let layers = match layout.arithmetic {
            Arithmetic::Float => {
                let mut layers = heapless::Vec::new();
                for layer in &layout.layers {
                    let _ = layers.push(float::Layer::new(blob, layer)?);
                }
                Layers::Float(layers)
            }
            Arithmetic::Int8 => {
                if !layout.input_code.is_finite() {
                    return Err(Refusal::NotFinite { what: "input code" });
                }
                if layout.input_code <= 0.0 {
                    return Err(Refusal::Value { what: "input code" });
                }
                let mut layers = heapless::Vec::new();
                for (index, layer) in layout.layers.iter().enumerate() {
                    let last = index + 1 == layout.layers.len();
                    let _ = layers.push(integer::Layer::new(blob, layer, index as u8, last)?);
                }
                Layers::Integer { code: layout.input_code, layers }
            }
        };
        Ok(Self { mean, reciprocal_scale, layers, skip, output_scale, output_mean, multiply_adds })
    }

    /// Multiplications with a weight in one evaluation.
    pub fn multiply_adds(&self) -> u32 {
        self.multiply_adds
    }

    /// Evaluates the network: `inputs` in physical units, one for each feature; `outputs` in the units of the corrected channels.
    pub fn evaluate(&self, inputs: &[f32], outputs: &mut [f32], scratch: &mut Scratch) {
        let count = self.mean.len();
        let normalised = scratch.normalised.get_mut(..count).unwrap_or_default();
        let normalisation = self.mean.iter().zip(self.reciprocal_scale.iter());
        for ((value, input), (mean, reciprocal)) in normalised.iter_mut().zip(inputs).zip(normalisation) {
            *value = (*input - mean) * reciprocal;
        }
        let mut result = [0.0; MAX_OUTPUTS];
        match &self.layers {
            Layers::Float(layers) => float::evaluate(layers, normalised, &mut scratch.floats, &mut result),
            Layers::Integer { code, layers } => {
                integer::evaluate(layers, normalised, *code, &mut scratch.codes, &mut result);
            }
        }
        if let Some(skip) = &self.skip {
            skip.accumulate(normalised, &mut result);
        }
        let denormalisation = self.output_scale.iter().zip(self.output_mean.iter());
        for ((output, value), (scale, mean)) in outputs.iter_mut().zip(result).zip(denormalisation) {
            *output = value * scale + mean;
        }
    }
}

/// Rows of a packed matrix: outputs rounded up to whole blocks.
pub fn padded(outputs: usize) -> usize {
    outputs.next_multiple_of(ROWS)
}
