//! Quantisation as TensorFlow Lite does it, which is what the other integer engines read: int8 codes with a zero point, one scale
//! for each tensor, int32 bias, a 32-bit multiplier with a shift.

use impromptu_model_export::{
    FloatNetwork,
    float_network::{Activation, DenseLayer},
};

/// real = scale × (code - zero point).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Codes {
    /// Real distance of two codes.
    pub scale: f32,
    /// The code of 0.
    pub zero_point: i32,
}

impl Codes {
    /// Codes for the range of `values`, which is widened to hold 0.
    fn over(values: impl Iterator<Item = f32>) -> Self {
        let (low, high) = values.fold((0.0f32, 0.0f32), |(low, high), value| (low.min(value), high.max(value)));
        let scale = ((high - low) / 255.0).max(f32::MIN_POSITIVE);
        Self { scale, zero_point: (-128.0 - low / scale).round() as i32 }
    }
}

/// One dense layer in integers.
#[derive(Clone, Debug)]
pub struct QuantisedLayer {
    /// Codes of its inputs.
    pub input: Codes,
    /// Codes of its outputs.
    pub output: Codes,
    /// Real size of a weight of 1.
    pub weight_scale: f32,
    /// Row-major `[outputs][inputs]`.
    pub weights: Vec<i8>,
    /// In units of input scale × weight scale.
    pub bias: Vec<i32>,
    /// input scale × weight scale / output scale = multiplier / 2³¹ × 2^shift.
    pub multiplier: i32,
    /// See the multiplier.
    pub shift: i32,
    /// Rectified, or nothing.
    pub activation: Activation,
}

/// Quantises a network of dense layers; ranges come from `rows`.
pub fn quantise(network: &FloatNetwork, rows: &[Vec<f32>]) -> Vec<QuantisedLayer> {
    let mut values = rows.to_vec();
    let mut input = Codes::over(values.iter().flatten().copied());
    let mut layers = Vec::new();
    for layer in &network.layers {
        values = values.iter().map(|row| layer.evaluate(row)).collect();
        let output = Codes::over(values.iter().flatten().copied());
        layers.push(quantise_layer(layer, input, output));
        input = output;
    }
    layers
}

fn quantise_layer(layer: &DenseLayer, input: Codes, output: Codes) -> QuantisedLayer {
    let largest = layer.weights.iter().fold(0.0f32, |largest, weight| largest.max(weight.abs()));
    let weight_scale = (largest / 127.0).max(f32::MIN_POSITIVE);
    let unit = f64::from(input.scale) * f64::from(weight_scale);
    let (multiplier, shift) = multiplier(unit / f64::from(output.scale));
    QuantisedLayer {
        input,
        output,
        weight_scale,
        weights: layer.weights.iter().map(|weight| (weight / weight_scale).round() as i8).collect(),
        bias: layer.bias.iter().map(|bias| (f64::from(*bias) / unit).round() as i32).collect(),
        multiplier,
        shift,
        activation: layer.activation,
    }
}

/// A positive factor as a 32-bit multiplier with 31 fractional bits and a power of two.
fn multiplier(factor: f64) -> (i32, i32) {
    let (mut shift, mut fraction) = (0, factor);
    while fraction >= 1.0 {
        (fraction, shift) = (fraction / 2.0, shift + 1);
    }
    while fraction < 0.5 && shift > -31 {
        (fraction, shift) = (fraction * 2.0, shift - 1);
    }
    match (fraction * 2_147_483_648.0).round() {
        whole if whole >= 2_147_483_648.0 => (1 << 30, shift + 1),
        whole => (whole as i32, shift),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_multiplier_and_its_shift_make_the_factor() {
        for factor in [1e-4, 0.01, 0.5, 0.999_999_999_9, 1.0, 3.7] {
            let (multiplier, shift) = multiplier(factor);
            assert!(multiplier >= 1 << 30);
            let made = f64::from(multiplier) / 2_147_483_648.0 * f64::from(shift).exp2();
            assert!((made / factor - 1.0).abs() < 1e-9, "{factor}: {made}");
        }
    }

    #[test]
    fn codes_hold_the_range_and_zero() {
        let codes = Codes::over([2.0, 5.1].into_iter());
        assert_eq!(codes.zero_point, -128);
        let codes = Codes::over([-1.0, 1.55].into_iter());
        assert_eq!((codes.zero_point, (codes.scale * 100.0).round()), (-28, 1.0));
    }
}
