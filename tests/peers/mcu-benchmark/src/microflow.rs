//! The crate `microflow`: its dense layer, called as the code calls it that its macro makes of a TensorFlow Lite file.
//!
//! The macro wants such a file at compile time; here the same numbers, prepared by the compiler out of the int8 images, go into
//! the same types and the same functions. Shapes are types, so each network has a function of its own. It has no tanh.

use microflow::{
    activation::FusedActivation,
    buffer::Buffer2D,
    ops::{FullyConnectedOptions, fully_connected},
    tensor::Tensor2D,
};
use nalgebra_of_microflow::{ArrayStorage, SMatrix};
use static_cell::StaticCell;

use crate::kernel::Kernel;

const fn word(image: &[u8], at: usize) -> i32 {
    i32::from_le_bytes([image[at], image[at + 1], image[at + 2], image[at + 3]])
}

const fn float(image: &[u8], at: usize) -> f32 {
    f32::from_bits(word(image, at) as u32)
}

/// Bytes in front of a layer's bias.
const HEADER: usize = 36;

/// Where the layer behind a layer of this shape starts.
const fn after(at: usize, inputs: usize, outputs: usize) -> usize {
    at + HEADER + 4 * outputs + (inputs * outputs).next_multiple_of(4)
}

/// A dense layer with the constants that the macro computes at compile time.
struct Layer<const INPUTS: usize, const OUTPUTS: usize> {
    weights: Tensor2D<i8, INPUTS, OUTPUTS, 1>,
    constants: (Buffer2D<f32, OUTPUTS, 1>, f32, Buffer2D<i32, 1, OUTPUTS>, i32),
    input: (f32, i8),
    output: (f32, i8),
    relu: bool,
}

impl<const INPUTS: usize, const OUTPUTS: usize> Layer<INPUTS, OUTPUTS> {
    /// The layer that starts at byte `at` of an image.
    const fn from_image(image: &[u8], at: usize) -> Self {
        assert!(word(image, at) as usize == OUTPUTS);
        let (input_zero, output_zero) = (word(image, at + 8), word(image, at + 12));
        let scales = [float(image, at + 24), float(image, at + 28), float(image, at + 32)];
        let bias = at + HEADER;
        let (mut weights, mut scaled_bias, mut sums) = ([[0; INPUTS]; OUTPUTS], [0.0; OUTPUTS], [[0]; OUTPUTS]);
        let mut row = 0;
        while row < OUTPUTS {
            scaled_bias[row] = scales[0] * scales[1] / scales[2] * word(image, bias + 4 * row) as f32;
            let mut column = 0;
            while column < INPUTS {
                let weight = image[bias + 4 * OUTPUTS + row * INPUTS + column] as i8;
                weights[row][column] = weight;
                sums[row][0] += weight as i32 * input_zero;
                column += 1;
            }
            row += 1;
        }
        Self {
            weights: Tensor2D::new(SMatrix::from_array_storage(ArrayStorage(weights)), [scales[1]], [0]),
            constants: (
                SMatrix::from_array_storage(ArrayStorage([scaled_bias])),
                scales[0] * scales[1] / scales[2],
                SMatrix::from_array_storage(ArrayStorage(sums)),
                0,
            ),
            input: (scales[0], input_zero as i8),
            output: (scales[2], output_zero as i8),
            relu: word(image, at + 4) == 1,
        }
    }

    fn evaluate(&self, input: Tensor2D<i8, 1, INPUTS, 1>) -> Tensor2D<i8, 1, OUTPUTS, 1> {
        let fused_activation = if self.relu { FusedActivation::Relu } else { FusedActivation::None };
        let options = FullyConnectedOptions { fused_activation };
        fully_connected(input, &self.weights, [self.output.0], [self.output.1], options, self.constants)
    }
}

/// `INPUTS`-128-128-128-128-6.
struct Network<const INPUTS: usize>(Layer<INPUTS, 128>, [Layer<128, 128>; 3], Layer<128, 6>);

impl<const INPUTS: usize> Network<INPUTS> {
    const fn from_image(image: &[u8]) -> Self {
        let second = after(8, INPUTS, 128);
        let third = after(second, 128, 128);
        let fourth = after(third, 128, 128);
        Self(
            Layer::from_image(image, 8),
            [Layer::from_image(image, second), Layer::from_image(image, third), Layer::from_image(image, fourth)],
            Layer::from_image(image, after(fourth, 128, 128)),
        )
    }
}

impl<const INPUTS: usize> Kernel for &'static Network<INPUTS> {
    fn shape(&self) -> (usize, usize) {
        (INPUTS, 6)
    }

    /// Everything lives on the stack.
    fn working_memory(&self) -> usize {
        0
    }

    fn evaluate(&mut self, inputs: &[f32], outputs: &mut [f32]) {
        let Network(first, hidden, last) = *self;
        let (scale, zero) = first.input;
        let mut values = first.evaluate(Tensor2D::quantize(SMatrix::from_row_slice(inputs), [scale], [zero]));
        for layer in hidden {
            values = layer.evaluate(values);
        }
        let result = last.evaluate(values).dequantize();
        outputs.copy_from_slice(result.as_slice());
    }
}

static SMALL: Network<12> = Network::from_image(include_bytes!(concat!(env!("OUT_DIR"), "/s8-12-128x4-6")));
static LARGE: Network<36> = Network::from_image(include_bytes!(concat!(env!("OUT_DIR"), "/s8-36-128x4-6")));

/// The network with as many inputs as the image.
pub(crate) fn load(image: &'static [u8]) -> Result<&'static mut dyn Kernel, &'static str> {
    static SMALL_PLACE: StaticCell<&'static Network<12>> = StaticCell::new();
    static LARGE_PLACE: StaticCell<&'static Network<36>> = StaticCell::new();
    match image {
        [12, 0, 0, 0, ..] => Ok(SMALL_PLACE.init(&SMALL)),
        [36, 0, 0, 0, ..] => Ok(LARGE_PLACE.init(&LARGE)),
        _ => Err("microflow has no such network in this binary"),
    }
}
