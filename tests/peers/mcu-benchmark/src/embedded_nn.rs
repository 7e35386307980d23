//! The crate `embedded-nn`: its dense layers in f32 and in int8.
//!
//! Its float tanh is x / (1 + |x|), so libm's follows its dense layer; its int8 tanh has no input scale, so int8 is measured on
//! ReLU only.

use embedded_nn::{
    fully_connected_s8, quantize_f32_to_s8,
    support::dequantize_s8_to_f32,
    types::{Activation as Range, Dims, FcParams, PerTensorQuantParams},
};
use static_cell::StaticCell;

use crate::{
    kernel::Kernel,
    plain::{FloatNetwork, MAX_WIDTH},
    reader::{Activation, Reader},
};

/// Shapes of a dense layer as the crate wants them: input, filter, output.
fn shapes(inputs: usize, outputs: usize) -> (Dims, Dims, Dims) {
    let (inputs, outputs) = (inputs as i32, outputs as i32);
    (Dims::new(1, 1, 1, inputs), Dims::new(inputs, 1, 1, outputs), Dims::new(1, 1, 1, outputs))
}

fn float_layer(weights: &[f32], bias: Option<&[f32]>, inputs: &[f32], outputs: &mut [f32]) {
    let (input, filter, output) = shapes(inputs.len(), outputs.len());
    // It never fails.
    let _ = embedded_nn::float_ops::fully_connected_f32(&input, inputs, &filter, weights, bias, &output, outputs);
}

/// A float network and the activations before and behind a layer.
struct Float {
    network: FloatNetwork,
    normalised: [f32; MAX_WIDTH],
    buffers: [[f32; MAX_WIDTH]; 2],
}

impl Kernel for Float {
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
            let values = &mut other[..units];
            float_layer(layer.weights, Some(layer.bias), &current[..width], values);
            match layer.activation {
                Activation::Linear => {}
                Activation::Relu => embedded_nn::float_ops::relu_f32(values),
                Activation::Tanh => values.iter_mut().for_each(|value| *value = libm::tanhf(*value)),
            }
            width = units;
            core::mem::swap(&mut current, &mut other);
        }
        if !self.network.skip.is_empty() {
            let values = &mut other[..outputs.len()];
            float_layer(self.network.skip, None, normalised, values);
            current.iter_mut().zip(values).for_each(|(sum, value)| *sum += *value);
        }
        self.network.denormalise(current, outputs);
    }
}

/// Borrows a float image.
pub(crate) fn load_float(image: &'static [u8]) -> Result<&'static mut dyn Kernel, &'static str> {
    static PLACE: StaticCell<Float> = StaticCell::new();
    let network = FloatNetwork::from_image(image)?;
    Ok(PLACE.init(Float { network, normalised: [0.0; MAX_WIDTH], buffers: [[0.0; MAX_WIDTH]; 2] }))
}

/// One int8 layer, quantised per tensor.
#[derive(Clone, Copy)]
struct Layer {
    parameters: FcParams,
    requantisation: PerTensorQuantParams,
    bias: &'static [i32],
    weights: &'static [i8],
}

/// An int8 network of at most [`MAX_LAYERS`] layers and the codes before and behind a layer.
struct Integer {
    inputs: usize,
    /// Scale and zero point of inputs and outputs.
    codes: [(f32, i32); 2],
    layers: [Option<Layer>; MAX_LAYERS],
    buffers: [[i8; MAX_WIDTH]; 2],
}

/// Most layers of a network.
const MAX_LAYERS: usize = 6;

impl Kernel for Integer {
    fn shape(&self) -> (usize, usize) {
        (self.inputs, self.layers.iter().flatten().last().map_or(0, |layer| layer.bias.len()))
    }

    fn working_memory(&self) -> usize {
        size_of_val(&self.buffers)
    }

    fn evaluate(&mut self, inputs: &[f32], outputs: &mut [f32]) {
        let [mut current, mut other] = self.buffers.each_mut();
        let [(scale, zero), (output_scale, output_zero)] = self.codes;
        for (code, input) in current.iter_mut().zip(inputs) {
            *code = quantize_f32_to_s8(*input, scale, zero);
        }
        let mut width = inputs.len();
        for layer in self.layers.iter().flatten() {
            let units = layer.bias.len();
            let (input, filter, output) = shapes(width, units);
            // It never fails.
            let _ = fully_connected_s8(
                &layer.parameters,
                &layer.requantisation,
                &input,
                &current[..width],
                &filter,
                layer.weights,
                Some(layer.bias),
                &output,
                &mut other[..units],
            );
            width = units;
            core::mem::swap(&mut current, &mut other);
        }
        for (output, code) in outputs.iter_mut().zip(current) {
            *output = dequantize_s8_to_f32(*code, output_scale, output_zero);
        }
    }
}

/// Borrows an int8 image.
pub(crate) fn load_integer(image: &'static [u8]) -> Result<&'static mut dyn Kernel, &'static str> {
    static PLACE: StaticCell<Integer> = StaticCell::new();
    let mut reader = Reader::new(image);
    let (inputs, count) = (reader.count()?, reader.count()?);
    let mut width = inputs;
    let mut layers = [None; MAX_LAYERS];
    let mut codes = [(1.0, 0); 2];
    for (index, place) in layers.get_mut(..count).ok_or("too many layers")?.iter_mut().enumerate() {
        let units = reader.count()?;
        let relu = Activation::numbered(reader.word()?)? == Activation::Relu;
        let (input_zero, output_zero) = (reader.word()?, reader.word()?);
        let (multiplier, shift) = (reader.word()?, reader.word()?);
        let scales = reader.floats(3)?;
        if index == 0 {
            codes[0] = (scales[0], input_zero);
        }
        codes[1] = (scales[2], output_zero);
        *place = Some(Layer {
            parameters: FcParams {
                input_offset: -input_zero,
                filter_offset: 0,
                output_offset: output_zero,
                activation: Range::new(if relu { output_zero } else { -128 }, 127),
            },
            requantisation: PerTensorQuantParams::new(multiplier, shift),
            bias: reader.integers(units)?,
            weights: reader.small(units * width)?,
        });
        width = units;
    }
    Ok(PLACE.init(Integer { inputs, codes, layers, buffers: [[0; MAX_WIDTH]; 2] }))
}
