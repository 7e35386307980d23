//! What the number formats cost in precision, on networks as they are before training: random weights of He's scale.

use impromptu_firmware::{
    model::{DEFAULT_OUTPUTS, Model},
    network::Scratch,
};
use impromptu_model_export::{
    Description, FloatNetwork, Precision, encode,
    float_network::{Activation, DenseLayer},
};

use crate::fixture::{Numbers, description};

impl Numbers {
    /// Sum of twelve: near enough to a normal deviate.
    fn normal(&mut self) -> f32 {
        (0..12).map(|_| 0.5 * self.next()).sum()
    }
}

/// A network of these widths, its weights normal with variance `gain` over the inputs.
fn random(numbers: &mut Numbers, widths: &[usize], activation: Activation, gain: f32) -> FloatNetwork {
    let mut layers: Vec<DenseLayer> = widths
        .windows(2)
        .map(|pair| {
            let scale = (gain / pair[0] as f32).sqrt();
            let weights = (0..pair[0] * pair[1]).map(|_| scale * numbers.normal()).collect();
            DenseLayer { weights, bias: vec![0.0; pair[1]], activation }
        })
        .collect();
    layers.last_mut().unwrap().activation = Activation::Linear;
    let (inputs, outputs) = (widths[0], widths[widths.len() - 1]);
    FloatNetwork {
        input_mean: vec![0.0; inputs],
        input_scale: vec![1.0; inputs],
        layers,
        skip: None,
        output_mean: vec![0.0; outputs],
        output_scale: vec![1.0; outputs],
        notes: Default::default(),
    }
}

fn describe(widths: &[usize]) -> Description {
    let mut description = description(widths[0]);
    let outputs = widths[widths.len() - 1];
    let signals = &mut description.signals;
    for signal in [&mut signals.desired, &mut signals.measured, &mut signals.reference] {
        let first = signal[0].clone();
        signal.clear();
        signal.extend((0..outputs).map(|index| {
            let mut channel = first.clone();
            channel.name = format!("channel.{index}");
            channel
        }));
    }
    description.outputs =
        (0..outputs as u8).map(|channel| impromptu_firmware::model::Output { channel, limit: 9.0, slew: 9.0 }).collect();
    description
}

/// The network in f64.
fn exact(network: &FloatNetwork, row: &[f32]) -> Vec<f64> {
    let mut values: Vec<f64> = row.iter().map(|x| f64::from(*x)).collect();
    for layer in &network.layers {
        let sums = layer.weights.chunks(values.len()).zip(&layer.bias).map(|(weights, bias)| {
            let sum: f64 = weights.iter().zip(&values).map(|(weight, value)| f64::from(*weight) * value).sum();
            sum + f64::from(*bias)
        });
        values = sums
            .map(|sum| match layer.activation {
                Activation::Relu => sum.max(0.0),
                Activation::Tanh => sum.tanh(),
                Activation::Linear => sum,
            })
            .collect();
    }
    values
}

/// Largest error, and RMS of the output, on rows that the exporter has not seen.
fn error(widths: &[usize], activation: Activation, gain: f32, precision: Precision, seed: u64) -> (f64, f64) {
    let mut numbers = Numbers(seed);
    let network = random(&mut numbers, widths, activation, gain);
    let mut rows =
        |count: usize| -> Vec<Vec<f32>> { (0..count).map(|_| (0..widths[0]).map(|_| numbers.normal()).collect()).collect() };
    let bytes = encode(&describe(widths), Some(&network), precision, &rows(2000)).unwrap();
    if let Ok(folder) = std::env::var("WRITE_MODELS") {
        std::fs::write(format!("{folder}/{}-{}-{precision:?}-{seed}.model", widths[0], widths.len()), &bytes).unwrap();
    }
    let model = Model::from_bytes(&bytes).unwrap();
    let (mut worst, mut square, mut count) = (0.0f64, 0.0, 0.0);
    for row in rows(1000) {
        let mut found = [0.0; DEFAULT_OUTPUTS];
        model.network().unwrap().evaluate(&row, &mut found, &mut Scratch::new());
        for (expected, found) in exact(&network, &row).iter().zip(found) {
            worst = worst.max((expected - f64::from(found)).abs());
            square += expected * expected;
            count += 1.0;
        }
    }
    (worst, f64::sqrt(square / count))
}

#[test]
fn errors_of_wide_relu_networks_are_as_stated() {
    for (seed, inputs) in [(1, 12), (2, 12), (3, 36)] {
        let widths = [inputs, 128, 128, 128, 128, 6];
        for (precision, bound) in [(Precision::Int8, 0.06), (Precision::Int16, 0.005), (Precision::Float, 5e-6)] {
            let (worst, rms) = error(&widths, Activation::Relu, 2.0, precision, seed);
            println!("{widths:?} {precision:?}: {worst:.2e} of {rms:.2}");
            assert!(worst < bound, "{widths:?} {precision:?}: {worst} of {rms}");
        }
    }
}

#[test]
fn errors_of_a_small_tanh_network_are_as_stated() {
    for (precision, bound) in [(Precision::Int8, 0.01), (Precision::Int16, 1e-3), (Precision::Float, 3e-7)] {
        let (worst, rms) = error(&[3, 20, 20, 1], Activation::Tanh, 1.0, precision, 1);
        println!("3-20-20-1 {precision:?}: {worst:.2e} of {rms:.2}");
        assert!(worst < bound, "{precision:?}: {worst} of {rms}");
    }
}
