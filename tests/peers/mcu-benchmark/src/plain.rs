//! A float network as anyone writes it: row-major weights, one sum for each output.

use static_cell::StaticCell;

use crate::{
    kernel::Kernel,
    reader::{Activation, Reader},
};

/// Most layers of a network.
const MAX_LAYERS: usize = 6;
/// Most units in a layer.
pub(crate) const MAX_WIDTH: usize = 128;

/// One dense layer.
#[derive(Clone, Copy)]
pub(crate) struct Layer {
    /// Row-major `[outputs][inputs]`.
    pub(crate) weights: &'static [f32],
    pub(crate) bias: &'static [f32],
    pub(crate) activation: Activation,
}

/// A float network with its normalisations.
pub(crate) struct FloatNetwork {
    pub(crate) input_mean: &'static [f32],
    pub(crate) input_reciprocal: &'static [f32],
    pub(crate) output_mean: &'static [f32],
    pub(crate) output_scale: &'static [f32],
    /// Row-major, from normalised inputs to normalised outputs; empty: none.
    pub(crate) skip: &'static [f32],
    layers: [Layer; MAX_LAYERS],
    count: usize,
}

impl FloatNetwork {
    /// Borrows the numbers of an image.
    pub(crate) fn from_image(image: &'static [u8]) -> Result<Self, &'static str> {
        let mut reader = Reader::new(image);
        let (inputs, outputs) = (reader.count()?, reader.count()?);
        let (count, skip) = (reader.count()?, reader.count()?);
        let (input_mean, input_reciprocal) = (reader.floats(inputs)?, reader.floats(inputs)?);
        let (output_mean, output_scale) = (reader.floats(outputs)?, reader.floats(outputs)?);
        let skip = reader.floats(skip * inputs * outputs)?;
        let mut layers = [Layer { weights: &[], bias: &[], activation: Activation::Linear }; MAX_LAYERS];
        let mut width = inputs;
        for layer in layers.get_mut(..count).ok_or("too many layers")? {
            let units = reader.count()?;
            if units > MAX_WIDTH {
                return Err("a layer is too wide");
            }
            let activation = Activation::numbered(reader.word()?)?;
            *layer = Layer { bias: reader.floats(units)?, weights: reader.floats(units * width)?, activation };
            width = units;
        }
        Ok(Self { input_mean, input_reciprocal, output_mean, output_scale, skip, layers, count })
    }

    /// From the input to the output side.
    pub(crate) fn layers(&self) -> &[Layer] {
        &self.layers[..self.count]
    }

    /// (x - mean) / scale.
    pub(crate) fn normalise(&self, inputs: &[f32], normalised: &mut [f32]) {
        for (value, ((input, mean), reciprocal)) in
            normalised.iter_mut().zip(inputs.iter().zip(self.input_mean).zip(self.input_reciprocal))
        {
            *value = (input - mean) * reciprocal;
        }
    }

    /// mean + scale × value.
    pub(crate) fn denormalise(&self, values: &[f32], outputs: &mut [f32]) {
        for (output, ((value, mean), scale)) in outputs.iter_mut().zip(values.iter().zip(self.output_mean).zip(self.output_scale))
        {
            *output = mean + scale * value;
        }
    }
}

/// The network and the activations before and behind a layer.
struct Plain {
    network: FloatNetwork,
    normalised: [f32; MAX_WIDTH],
    buffers: [[f32; MAX_WIDTH]; 2],
}

/// Weights · inputs.
fn dot(weights: &[f32], inputs: &[f32]) -> f32 {
    weights.iter().zip(inputs).map(|(weight, input)| weight * input).sum()
}

impl Kernel for Plain {
    fn shape(&self) -> (usize, usize) {
        (self.network.input_mean.len(), self.network.output_mean.len())
    }

    fn working_memory(&self) -> usize {
        size_of_val(&self.normalised) + size_of_val(&self.buffers)
    }

    fn evaluate(&mut self, inputs: &[f32], outputs: &mut [f32]) {
        let normalised = &mut self.normalised[..inputs.len()];
        self.network.normalise(inputs, normalised);
        let [mut current, mut other] = self.buffers.each_mut();
        current[..inputs.len()].copy_from_slice(normalised);
        let mut width = inputs.len();
        for layer in self.network.layers() {
            let units = layer.bias.len();
            for ((value, row), bias) in other.iter_mut().zip(layer.weights.chunks_exact(width)).zip(layer.bias) {
                let sum = bias + dot(row, &current[..width]);
                *value = match layer.activation {
                    Activation::Linear => sum,
                    Activation::Relu => sum.max(0.0),
                    Activation::Tanh => libm::tanhf(sum),
                };
            }
            width = units;
            core::mem::swap(&mut current, &mut other);
        }
        for (value, row) in current.iter_mut().zip(self.network.skip.chunks_exact(inputs.len().max(1))) {
            *value += dot(row, normalised);
        }
        self.network.denormalise(current, outputs);
    }
}

/// Borrows an image.
pub(crate) fn load(image: &'static [u8]) -> Result<&'static mut dyn Kernel, &'static str> {
    static PLACE: StaticCell<Plain> = StaticCell::new();
    let network = FloatNetwork::from_image(image)?;
    Ok(PLACE.init(Plain { network, normalised: [0.0; MAX_WIDTH], buffers: [[0.0; MAX_WIDTH]; 2] }))
}
