//! Integer weights with a scale for each row, codes with a scale for each layer.
//!
//! - An activation's scale covers the largest magnitude that the calibration rows reach, with [`HEADROOM`].
//! - A layer's largest input code is the largest with which no accumulator can overflow, whatever the codes: the accumulator's 32
//!   bits are shared by weights and codes. The firmware proves it again at load.
//! - int8: the largest weight of a row is 127 steps. int16: weights and codes get about as many bits each.
//! - Weights are rounded column by column, each column's error being made good by those to come ([`mod@rounding`]), on the inputs
//!   that the quantised layers before give; the bias then takes what is left in the mean.
//!
//! Bias and accumulator share the unit `s_in · s_row` of effective weights (1/256 of an int8 step). Jacob et al. 2018
//! (integer-arithmetic-only inference); what differs: symmetric codes of up to 16 bits, one multiplier without a shift. Frantar
//! et al. 2023 (GPTQ) for the rounding.

pub mod rounding;

use impromptu_firmware::network::{ROWS, TANH_INPUT_ONE, kernel::Width};
use nalgebra::DMatrix;

use crate::{
    batch::Batch,
    float_network::{Activation, DenseLayer, FloatNetwork},
    integer_network::{IntegerLayer, IntegerNetwork},
};

/// Calibrated range over the largest magnitude seen.
pub const HEADROOM: f32 = 1.25;
/// Most that the envelope may widen the range of the inputs, over the largest magnitude seen: one outlier must not take the
/// codes' steps from all features.
const WIDEST: f32 = 4.0;
/// Calibration rows on which weights are rounded: enough for the second moments of 256 inputs.
const ROUNDING_ROWS: usize = 4096;
/// Most that a row's bias may be, over its largest weight times the largest input; else the scale grows.
const BIAS_SHARE: f64 = 2.0;

/// Normalised inputs of `rows` (in physical units).
fn normalised(network: &FloatNetwork, row: &[f32]) -> Vec<f32> {
    row.iter().zip(network.input_mean.iter().zip(&network.input_scale)).map(|(x, (mean, scale))| (x - mean) / scale).collect()
}

/// Largest magnitude of the normalised inputs and of each layer's output over `rows` (each in physical units).
fn ranges(network: &FloatNetwork, rows: &[&[f32]]) -> (f32, Vec<f32>) {
    let mut largest = Batch::of_network(network).largest_magnitudes(rows.iter().copied());
    largest.iter_mut().for_each(|range| *range = range.max(1e-3));
    (largest[0], largest.split_off(1))
}

/// Inputs of a layer, over the rows that weights are rounded on.
struct Inputs {
    /// Largest magnitude that must be representable.
    range: f64,
    /// Whether they can be negative.
    signed: bool,
    /// Finest useful limit of their codes: the layer before has no finer steps.
    finest: f64,
    /// For each row: those of the float layer, and those that the quantised layers before give (codes not rounded: their number
    /// of bits follows from this layer's weights).
    float: Vec<Vec<f32>>,
    quantised: Vec<Vec<f64>>,
}

/// Quantises the dense layers on the calibration rows (features in physical units). Input codes also cover the `envelope`
/// (smallest and largest value of each feature): rows are a sample, and inputs that saturate there cost far more than finer steps
/// gain.
pub fn quantise<'r>(
    network: &FloatNetwork,
    width: Width,
    rows: impl Iterator<Item = &'r [f32]>,
    envelope: &[(f32, f32)],
) -> IntegerNetwork {
    let rows: Vec<&[f32]> = rows.collect();
    let (calibrated, layer_ranges) = ranges(network, &rows);
    let ends: [Vec<f32>; 2] = envelope.iter().copied().unzip().into();
    let widest = ends.iter().flat_map(|end| normalised(network, end)).fold(0.0f32, |widest, value| widest.max(value.abs()));
    let input_range = (calibrated * HEADROOM).max(widest.min(calibrated * WIDEST));
    let float: Vec<Vec<f32>> =
        rows.iter().step_by(rows.len().div_ceil(ROUNDING_ROWS).max(1)).map(|row| normalised(network, row)).collect();
    let quantised = float.iter().map(|row| row.iter().map(|x| f64::from(*x)).collect()).collect();
    let mut inputs = Inputs { range: f64::from(input_range), signed: true, finest: f64::INFINITY, float, quantised };
    let mut result = IntegerNetwork { input_code: 1.0, layers: Vec::new() };
    // Of the layer before: for each row the accumulator's unit.
    let mut units: Vec<f64> = Vec::new();
    for (layer, layer_range) in network.layers.iter().zip(layer_ranges) {
        let (integer, scales) = quantised_layer(layer, width, &inputs);
        let unit_in = inputs.range / f64::from(integer.input_limit);
        match result.layers.last_mut() {
            None => result.input_code = (1.0 / unit_in) as f32,
            Some(before) => before.multipliers = multipliers(before.activation, &units, unit_in),
        }
        units = scales.iter().map(|scale| unit_in * scale).collect();
        let coarsest = units.iter().fold(f64::MIN_POSITIVE, |coarsest, unit| coarsest.max(*unit));
        let next_range = f64::from(layer_range * HEADROOM);
        let (range, finest) = match layer.activation {
            Activation::Tanh => (1.0, f64::INFINITY),
            // A multiplier is below 1/2.
            Activation::Relu | Activation::Linear => (next_range, next_range / (2.001 * coarsest)),
        };
        inputs = Inputs {
            range,
            signed: layer.activation != Activation::Relu,
            finest,
            quantised: outputs(&integer, &scales, &inputs, range),
            float: inputs.float.iter().map(|row| layer.evaluate(row)).collect(),
        };
        result.layers.push(integer);
    }
    if let Some(last) = result.layers.last_mut() {
        last.row_scales = units.iter().map(|unit| *unit as f32).collect();
    }
    result
}

/// Accumulator to the unit in which the activation reads its argument, times 2³². At `i32::MAX` a tanh layer is too steep;
/// `encode` refuses it.
fn multipliers(activation: Activation, units: &[f64], unit_out: f64) -> Vec<i32> {
    let unit_pre = match activation {
        Activation::Tanh => 1.0 / f64::from(TANH_INPUT_ONE),
        Activation::Relu | Activation::Linear => unit_out,
    };
    units.iter().map(|unit| (unit / unit_pre * 4_294_967_296.0).round().min(f64::from(i32::MAX)) as i32).collect()
}

/// The layer with its weights, bias and input limit; and the real weight of an effective one of each row.
fn quantised_layer(layer: &DenseLayer, width: Width, inputs: &Inputs) -> (IntegerLayer, Vec<f64>) {
    let count = layer.weights.len() / layer.outputs().max(1);
    let rows: Vec<&[f32]> = layer.weights.chunks(count.max(1)).collect();
    let largest = largest_weight(width, &rows, inputs.signed);
    let scales: Vec<f64> = rows.iter().zip(&layer.bias).map(|(row, bias)| scale(row, *bias, largest, inputs.range)).collect();
    let wanted: Vec<Vec<f64>> =
        rows.iter().zip(&scales).map(|(row, scale)| row.iter().map(|weight| f64::from(*weight) / scale).collect()).collect();
    let weights = rounding::round(&wanted, count, width, &moments(&inputs.quantised, count));
    let stride = weights.len() / wanted.len().next_multiple_of(ROWS).max(1);
    let bias = corrected_bias(layer, inputs, &weights, stride, &scales);
    // What the accumulator can reach for each step of the inputs' codes.
    let mut reach = 1.0f64;
    for (index, row) in weights.chunks(stride.max(1)).enumerate() {
        let positive: f64 = row.iter().map(|weight| f64::from((*weight).max(0))).sum();
        let negative: f64 = row.iter().map(|weight| f64::from(-i32::from((*weight).min(0)))).sum();
        let side = if inputs.signed { positive + negative } else { positive.max(negative) };
        let bias = bias.get(index).zip(scales.get(index)).map_or(0.0, |(bias, scale)| bias.abs() / (inputs.range * scale));
        reach = reach.max(side + bias);
    }
    let input_limit = (f64::from(i32::MAX - 2) / reach).min(inputs.finest).clamp(1.0, f64::from(i16::MAX)) as u16;
    let unit_in = inputs.range / f64::from(input_limit);
    let layer = IntegerLayer {
        inputs: count,
        weights,
        bias: bias.iter().zip(&scales).map(|(bias, scale)| (bias / (unit_in * scale)).round() as i32).collect(),
        multipliers: Vec::new(),
        row_scales: Vec::new(),
        input_limit,
        activation: layer.activation,
    };
    (layer, scales)
}

/// Magnitude to which a row's largest weight is scaled.
fn largest_weight(width: Width, rows: &[&[f32]], signed: bool) -> f64 {
    match width {
        Width::Int8 => 127.0 * 256.0,
        Width::Int16 => {
            // Sum of a row over its largest weight: with codes about twice as fine as weights, what they share is 2³¹.
            let relative = |row: &&[f32]| {
                let largest = row.iter().fold(f32::MIN_POSITIVE, |largest, weight| largest.max(weight.abs()));
                let sum: f32 = row.iter().map(|weight| weight.abs()).sum();
                f64::from(sum / largest) * if signed { 1.0 } else { 0.6 }
            };
            let reach = rows.iter().map(relative).fold(1.0, f64::max);
            (f64::from(1 << 30) / reach).sqrt().min(f64::from(i16::MAX))
        }
    }
}

/// Real weight of an effective one: the largest becomes `largest`, or less where a large bias beside small weights would leave
/// the codes no room in the accumulator.
fn scale(row: &[f32], bias: f32, largest: f64, range: f64) -> f64 {
    let most = row.iter().fold(0.0f32, |most, weight| most.max(weight.abs()));
    (f64::from(most) / largest).max(f64::from(bias.abs()) / (BIAS_SHARE * largest * range)).max(1e-30)
}

/// Mean products of pairs of inputs. Fewer rows say less of how inputs go together: their share of the diagonal's mean is added
/// to it.
fn moments(rows: &[Vec<f64>], count: usize) -> DMatrix<f64> {
    let inputs = DMatrix::from_fn(count, rows.len(), |input, row| rows[row][input]);
    let moments = &inputs * inputs.transpose() / rows.len().max(1) as f64;
    let doubt = moments.diagonal().sum() / rows.len().max(1) as f64;
    moments + DMatrix::identity(count, count) * doubt
}

/// The bias, plus the mean by which the quantised weights on quantised inputs fall short of the float layer.
fn corrected_bias(layer: &DenseLayer, inputs: &Inputs, weights: &[i16], stride: usize, scales: &[f64]) -> Vec<f64> {
    let count = layer.weights.len() / layer.outputs().max(1);
    let mean =
        |row: &dyn Fn(usize) -> f64| -> f64 { (0..inputs.float.len()).map(row).sum::<f64>() / inputs.float.len().max(1) as f64 };
    let float: Vec<f64> = (0..count).map(|input| mean(&|row| f64::from(inputs.float[row][input]))).collect();
    let quantised: Vec<f64> = (0..count).map(|input| mean(&|row| inputs.quantised[row][input])).collect();
    let row = |(index, bias): (usize, &f32)| {
        let wanted: f64 = layer.weights[index * count..].iter().zip(&float).map(|(weight, mean)| f64::from(*weight) * mean).sum();
        let found: f64 = weights[index * stride..].iter().zip(&quantised).map(|(weight, mean)| f64::from(*weight) * mean).sum();
        f64::from(*bias) + wanted - found * scales[index]
    };
    layer.bias.iter().enumerate().map(row).collect()
}

/// The quantised layer's outputs for each row, in real units, within `range`.
fn outputs(layer: &IntegerLayer, scales: &[f64], inputs: &Inputs, range: f64) -> Vec<Vec<f64>> {
    let unit_in = inputs.range / f64::from(layer.input_limit);
    let one = |row: &Vec<f64>| {
        let output = |index: usize| {
            let sum: f64 = layer.row(index).iter().zip(row).map(|(weight, input)| f64::from(*weight) * input).sum();
            let value = (sum + f64::from(layer.bias[index]) * unit_in) * scales[index];
            match layer.activation {
                Activation::Relu => value.clamp(0.0, range),
                Activation::Linear => value.clamp(-range, range),
                Activation::Tanh => value.tanh(),
            }
        };
        let limited: Vec<f64> = (0..layer.bias.len()).map(output).collect();
        limited
    };
    inputs.quantised.iter().map(one).collect()
}
