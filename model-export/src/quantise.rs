//! int8 weights with a scale for each row, 16-bit activations with a scale for each layer.
//!
//! A weight is `round(w / s)` with `s = max|w| / 127` of its row. An activation's scale covers the largest magnitude that the calibration rows
//! reach, with [`HEADROOM`]. Bias and accumulator share the unit `s_in · s_row`. Jacob et al. 2018 (integer-arithmetic-only
//! inference); what differs: symmetric codes, 16-bit activations, one multiplier without a shift.

use impromptu_firmware::network::{CODE_LIMIT, TANH_INPUT_ONE};

use crate::float_network::{Activation, FloatNetwork};

/// Calibrated range over the largest magnitude seen.
pub const HEADROOM: f32 = 1.25;

/// One integer layer, rows not yet packed.
#[derive(Clone, Debug, PartialEq)]
pub struct IntegerLayer {
    /// Row-major `[outputs][inputs]`.
    pub weights: Vec<i8>,
    /// One for each output, in units of the accumulator.
    pub bias: Vec<i32>,
    /// Hidden layers: accumulator to next code, times 2³².
    pub multipliers: Vec<i32>,
    /// Last layer: accumulator to normalised output.
    pub row_scales: Vec<f32>,
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

/// Largest magnitude of the normalised inputs and of each layer's output over `rows` (each in physical units).
fn ranges<'r>(network: &FloatNetwork, rows: impl Iterator<Item = &'r [f32]>) -> (f32, Vec<f32>) {
    let mut input_range = 1e-3f32;
    let mut layer_ranges = vec![1e-3f32; network.layers.len()];
    for row in rows {
        let mut values: Vec<f32> = row
            .iter()
            .zip(network.input_mean.iter().zip(&network.input_scale))
            .map(|(x, (mean, scale))| (x - mean) / scale)
            .collect();
        input_range = values.iter().fold(input_range, |range, value| range.max(value.abs()));
        for (layer, range) in network.layers.iter().zip(&mut layer_ranges) {
            values = layer.evaluate(&values);
            *range = values.iter().fold(*range, |range, value| range.max(value.abs()));
        }
    }
    (input_range, layer_ranges)
}

/// Quantises the dense layers, with activation ranges from the calibration rows (features in physical units).
pub fn quantise<'r>(network: &FloatNetwork, rows: impl Iterator<Item = &'r [f32]>) -> IntegerNetwork {
    let (input_range, layer_ranges) = ranges(network, rows);
    let one = CODE_LIMIT as f32;
    let input_code = one / (input_range * HEADROOM);
    let mut unit_in = 1.0 / f64::from(input_code);
    let last = network.layers.len().saturating_sub(1);
    let mut width = network.inputs();
    let mut layers = Vec::new();
    for (index, (layer, range)) in network.layers.iter().zip(layer_ranges).enumerate() {
        let unit_activation = f64::from(range * HEADROOM) / f64::from(CODE_LIMIT);
        // The accumulator is requantised to the unit in which the activation function reads its argument.
        let (unit_pre, unit_out) = match layer.activation {
            Activation::Tanh => (1.0 / f64::from(TANH_INPUT_ONE), 1.0 / f64::from(CODE_LIMIT)),
            Activation::Relu | Activation::Linear => (unit_activation, unit_activation),
        };
        let row_scales: Vec<f32> =
            layer.weights.chunks(width.max(1)).zip(&layer.bias).map(|(row, bias)| row_scale(row, *bias, unit_in)).collect();
        // A multiplier is below 1/2: where the next code would be finer than that, the accumulator's own step is the resolution.
        let coarsest = row_scales.iter().fold(0.0f64, |coarsest, scale| coarsest.max(unit_in * f64::from(*scale)));
        let (unit_pre, unit_out) = match layer.activation {
            Activation::Tanh => (unit_pre, unit_out),
            Activation::Relu | Activation::Linear => (unit_pre.max(2.001 * coarsest), unit_out.max(2.001 * coarsest)),
        };
        let mut integer = IntegerLayer {
            weights: Vec::with_capacity(layer.weights.len()),
            bias: Vec::new(),
            multipliers: Vec::new(),
            row_scales: Vec::new(),
            activation: layer.activation,
        };
        for ((row, &bias), scale) in layer.weights.chunks(width.max(1)).zip(&layer.bias).zip(row_scales) {
            integer.weights.extend(row.iter().map(|weight| (weight / scale).round().clamp(-127.0, 127.0) as i8));
            let unit = unit_in * f64::from(scale);
            integer.bias.push((f64::from(bias) / unit).round() as i32);
            if index == last {
                integer.row_scales.push(unit as f32);
            } else {
                // At `i32::MAX` a tanh layer is too steep; `encode` refuses it.
                integer.multipliers.push((unit / unit_pre * 4_294_967_296.0).round().min(f64::from(i32::MAX)) as i32);
            }
        }
        width = layer.outputs();
        unit_in = unit_out;
        layers.push(integer);
    }
    IntegerNetwork { input_code, layers }
}

/// max|w| / 127, or more where a large bias beside small weights would not fit into the accumulator.
fn row_scale(row: &[f32], bias: f32, unit_in: f64) -> f32 {
    let largest = row.iter().fold(0.0f32, |largest, weight| largest.max(weight.abs()));
    let for_bias = (f64::from(bias.abs()) / (unit_in * f64::from(1 << 29))) as f32;
    (largest / 127.0).max(for_bias).max(f32::MIN_POSITIVE * 1e6)
}
