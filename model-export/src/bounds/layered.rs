//! A network in real numbers with bounded errors: what the bounds are computed on, whatever arithmetic it stands for.
//!
//! *in* a [`FloatNetwork`] or the network of a model file, and the box of its features; *out* a [`Layered`] network
//!
//! ```text
//! x₀ = n + r,  |r| ≤ input_error          z = weights · x + bias + δ,  |δ| ≤ error + relative · (Σ |weight x| + |bias|)
//! x' = activation(z) within ±clip, + η,  |η| ≤ activation_error          y = mean + scale · (z of the last layer + skip · n)
//! ```
//!
//! of which the stored arithmetic is one member for every choice of its roundings; *never* one that it is not; *source* the
//! standard error analysis of sums (Higham, *Accuracy and Stability of Numerical Algorithms*, section 3.1).

use impromptu_firmware::network::{TANH_ERROR, TANH_INPUT_ONE, tanh_code};

use super::interval::Interval;
use crate::{
    float_network::{Activation, DenseLayer, FloatNetwork},
    stored_network::{Requantisation, StoredIntegerLayer, StoredLayers, StoredNetwork},
};

/// Half a unit in the last place of an f32 of 1.
const ROUNDING: f64 = 1.0 / 16_777_216.0;
/// What f32 loses below its smallest normal number, with a wide margin.
const UNDERFLOW: f64 = 1e-36;
/// Error of tanh in f32 with a margin: libm's is one unit in the last place of a number below 1.
const LIBM_TANH_ERROR: f64 = 1.3e-7;
/// The firmware's is found by search, not proven: twice as much.
const FIRMWARE_TANH_ERROR: f64 = 2.0 * TANH_ERROR;
/// tanh of an integer network saturates at ±5⅓: 1 - tanh of the largest code is less.
const TANH_END: f64 = 4.7e-5;

/// Relative error of a sum of `terms` products in f32.
fn sum_rounding(terms: usize) -> f64 {
    (terms + 2) as f64 * ROUNDING * 1.01
}

/// One dense layer.
pub(super) struct Dense {
    /// Inputs.
    pub(super) inputs: usize,
    /// Row-major `[outputs][inputs]`.
    pub(super) weights: Vec<f64>,
    /// One for each output.
    pub(super) bias: Vec<f64>,
    /// Error of each pre-activation.
    pub(super) error: f64,
    /// Further error, relative to the sum of the magnitudes.
    pub(super) relative: f64,
    /// Activation.
    pub(super) activation: Activation,
    /// Largest magnitude that the activation gives.
    pub(super) clip: f64,
    /// Error behind the activation.
    pub(super) activation_error: f64,
}

impl Dense {
    fn float(layer: &DenseLayer, inputs: usize, tanh_error: f64) -> Self {
        Self {
            inputs,
            weights: layer.weights.iter().map(|weight| f64::from(*weight)).collect(),
            bias: layer.bias.iter().map(|bias| f64::from(*bias)).collect(),
            error: UNDERFLOW * (inputs + 1) as f64,
            relative: sum_rounding(inputs),
            activation: layer.activation,
            clip: f64::INFINITY,
            activation_error: if layer.activation == Activation::Tanh { tanh_error } else { 0.0 },
        }
    }

    /// Outputs.
    pub(super) fn outputs(&self) -> usize {
        self.bias.len()
    }
}

/// A network with errors.
pub(super) struct Layered {
    /// Normalised inputs.
    pub(super) inputs: Vec<Interval>,
    /// Difference of what the first layer reads from that.
    pub(super) input_error: Vec<f64>,
    /// Dense layers.
    pub(super) layers: Vec<Dense>,
    /// Row-major `[outputs][inputs]`.
    pub(super) skip: Option<Vec<f64>>,
    /// Factor on the outputs.
    pub(super) scale: Vec<f64>,
    /// Added to them.
    pub(super) mean: Vec<f64>,
    /// Error of an output behind the dense layers, relative to the magnitudes that add up to it.
    pub(super) relative: f64,
}

fn wide(values: &[f32]) -> Vec<f64> {
    values.iter().map(|value| f64::from(*value)).collect()
}

/// Rounding is monotonic: the ends of a feature's range give the ends of the normalised one, to the bit.
fn normalised(envelope: &[(f32, f32)], normalise: impl Fn(usize, f32) -> f32) -> Vec<Interval> {
    let ends = envelope.iter().enumerate();
    ends.map(|(index, (low, high))| Interval { low: f64::from(normalise(index, *low)), high: f64::from(normalise(index, *high)) })
        .collect()
}

impl Layered {
    /// A float network as it is evaluated in f32.
    pub(super) fn of_network(network: &FloatNetwork, envelope: &[(f32, f32)]) -> Self {
        let inputs = network.inputs();
        Self {
            inputs: normalised(envelope, |index, value| (value - network.input_mean[index]) / network.input_scale[index]),
            input_error: vec![0.0; inputs],
            layers: float_layers(&network.layers, inputs, LIBM_TANH_ERROR),
            skip: network.skip.as_deref().map(wide),
            scale: wide(&network.output_scale),
            mean: wide(&network.output_mean),
            relative: sum_rounding(inputs + 4),
        }
    }

    /// A model file's network as the firmware evaluates it. Where a unit of its codes is arbitrary, it is chosen so that the
    /// weights come near to those of `float`, from which the file was made.
    pub(super) fn of_model(stored: &StoredNetwork, float: &FloatNetwork, envelope: &[(f32, f32)]) -> Self {
        let inputs = normalised(envelope, |index, value| (value - stored.input_mean[index]) * stored.input_reciprocal[index]);
        let mut input_error = vec![0.0; inputs.len()];
        let layers = match &stored.layers {
            StoredLayers::Float(layers) => float_layers(layers, inputs.len(), FIRMWARE_TANH_ERROR),
            StoredLayers::Integer { input_code, layers } => {
                let unit = 1.0 / f64::from(*input_code);
                let limit = layers.first().map_or(0.0, |layer| f64::from(layer.input_limit)) * unit;
                for (error, range) in input_error.iter_mut().zip(&inputs) {
                    // The product with the factor is rounded to f32 before it is rounded to a code.
                    *error = 0.504 * unit + (range.magnitude() - limit).max(0.0);
                }
                integer_layers(layers, &float.layers, unit)
            }
        };
        Self {
            relative: sum_rounding(inputs.len() + 6),
            inputs,
            input_error,
            layers,
            skip: stored.skip.as_ref().map(|skip| wide(&skip.weights)),
            scale: wide(&stored.output_scale),
            mean: stored
                .output_mean
                .iter()
                .enumerate()
                .map(|(output, mean)| {
                    let bias = stored.skip.as_ref().map_or(0.0, |skip| skip.bias[output]);
                    f64::from(*mean) + f64::from(bias) * f64::from(stored.output_scale[output])
                })
                .collect(),
        }
    }
}

fn float_layers(layers: &[DenseLayer], inputs: usize, tanh_error: f64) -> Vec<Dense> {
    let mut width = inputs;
    let layers = layers.iter().map(|layer| {
        let dense = Dense::float(layer, width, tanh_error);
        width = layer.outputs();
        dense
    });
    layers.collect()
}

fn integer_layers(layers: &[StoredIntegerLayer], float: &[DenseLayer], input_unit: f64) -> Vec<Dense> {
    let mut unit_in = input_unit;
    let mut result = Vec::new();
    for (index, (layer, float)) in layers.iter().zip(float).enumerate() {
        let inputs = layer.weights.len() / layer.bias.len().max(1);
        // From the accumulator to codes, or in the last layer to outputs.
        let row_factors: Vec<f64> = match &layer.requantisation {
            Requantisation::Codes(multipliers) => {
                multipliers.iter().map(|multiplier| f64::from(*multiplier) / 4_294_967_296.0).collect()
            }
            Requantisation::Floats(scales) => wide(scales),
        };
        let limit = layers.get(index + 1).map_or(0, |next| next.input_limit);
        // Unit of the pre-activation's code, unit and largest magnitude of the activation's code, errors.
        let (unit, unit_out, clip, error, activation_error) = match (&layer.requantisation, layer.activation) {
            (Requantisation::Floats(_), _) => (1.0, 1.0, f64::INFINITY, 0.0, 0.0),
            (Requantisation::Codes(_), Activation::Tanh) => {
                let unit = 1.0 / f64::from(TANH_INPUT_ONE);
                (unit, 1.0 / f64::from(limit), f64::INFINITY, 0.5 * unit, tanh_error(limit) + TANH_END)
            }
            (Requantisation::Codes(_), Activation::Relu | Activation::Linear) => {
                let unit = fitting_unit(layer, float, &row_factors, unit_in);
                (unit, unit, f64::from(limit) * unit, 0.5 * unit, 0.0)
            }
        };
        let last = matches!(layer.requantisation, Requantisation::Floats(_));
        result.push(Dense {
            inputs,
            weights: layer
                .weights
                .chunks(inputs.max(1))
                .zip(&row_factors)
                .flat_map(|(row, factor)| row.iter().map(move |weight| f64::from(*weight) * factor * unit / unit_in))
                .collect(),
            bias: layer.bias.iter().zip(&row_factors).map(|(bias, factor)| f64::from(*bias) * factor * unit).collect(),
            error: error + if last { UNDERFLOW } else { 0.0 },
            // The accumulator becomes an f32 and is multiplied by one.
            relative: if last { 2.1 * ROUNDING } else { 0.0 },
            activation: layer.activation,
            clip,
            activation_error,
        });
        unit_in = unit_out;
    }
    result
}

/// The unit of the layer's output codes with which its weights are nearest to the float ones. Any positive unit is right.
fn fitting_unit(layer: &StoredIntegerLayer, float: &DenseLayer, row_factors: &[f64], unit_in: f64) -> f64 {
    let inputs = layer.weights.len() / layer.bias.len().max(1);
    let (mut cross, mut square) = (0.0, 0.0);
    for (row, factor) in row_factors.iter().enumerate() {
        for input in 0..inputs {
            let code = f64::from(layer.weights[row * inputs + input]) * factor / unit_in;
            cross += code * f64::from(float.weights[row * inputs + input]);
            square += code * code;
        }
    }
    if cross > 0.0 && square > 0.0 { cross / square } else { 1.0 }
}

/// Largest error of the integer tanh over all of its arguments.
fn tanh_error(limit: u16) -> f64 {
    let error = |code: i16| {
        let exact = (f64::from(code) / f64::from(TANH_INPUT_ONE)).tanh();
        (f64::from(tanh_code(code, limit)) / f64::from(limit) - exact).abs()
    };
    (i16::MIN..=i16::MAX).map(error).fold(0.0, f64::max)
}
