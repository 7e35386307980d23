//! Models of the real shape with pseudo-random numbers: nothing is learned, everything is used.

use impromptu_firmware::{
    features::{Feature, window},
    model::{Interpolation, Margins, Output},
};
use impromptu_flight::quadrotor;
use impromptu_model_export::{
    Description, FloatNetwork, Precision,
    description::{LaneAxisDescription, LaneDescription, MonitorAxisDescription, MonitorDescription, Provenance, Timing},
    encode,
    float_network::{Activation, DenseLayer},
};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Lags of the feedback lane.
const LAGS: usize = 25;
/// Typical magnitude of a feature, m: how far the desired position moves within the window.
const FEATURE_SCALE: f32 = 0.3;

/// A network's dense layers; a linear skip runs beside them.
#[derive(Clone, Copy)]
pub(crate) struct Shape {
    pub(crate) name: &'static str,
    pub(crate) hidden: &'static [usize],
    pub(crate) activation: Activation,
}

/// Two layers of 64 with tanh, and a name that needs escapes in JSON.
pub(crate) const TANH: Shape = Shape { name: "36-64x2-6 \"tanh\"", hidden: &[64, 64], activation: Activation::Tanh };
/// The paper's four layers of 128 with ReLU.
pub(crate) const RELU: Shape = Shape { name: "36-128x4-6 relu", hidden: &[128, 128, 128, 128], activation: Activation::Relu };

/// The bytes of a model file with both lanes, its network at 10 Hz.
pub(crate) fn file(shape: &Shape, precision: Precision) -> Vec<u8> {
    file_at(10, shape, precision)
}

/// The same with a network that is evaluated every `divisor` reference ticks, of 10 ms.
pub(crate) fn file_at(divisor: u16, shape: &Shape, precision: Precision) -> Vec<u8> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    let features: Vec<Feature> = window(&[0, 1, 2], -4..=8).collect();
    assert_eq!(features.len(), 36);
    let network = network(shape, features.len(), &mut random);
    let calibration: Vec<Vec<f32>> = (0..64).map(|_| uniform(&mut random, features.len(), 2.0 * FEATURE_SCALE)).collect();
    let output = |channel: u8| {
        let (limit, slew) = if channel < 3 { (0.15, 0.02) } else { (0.3, 0.05) };
        Output { channel, limit, slew }
    };
    let description = Description {
        name: shape.name.into(),
        provenance: Provenance { software: "tests".into(), remarks: "pseudo-random numbers".into(), ..Provenance::default() },
        signals: (&quadrotor::signals()).into(),
        timing: Timing {
            reference_rate_hz: 100.0,
            divisor,
            interpolation: Interpolation::Linear,
            measurement_delay_s: 0.013,
            fade_s: 0.5,
        },
        envelope: vec![(-2.0 * FEATURE_SCALE, 2.0 * FEATURE_SCALE); features.len()],
        features,
        outputs: (0..6).map(output).collect(),
        feedback_lane: Some(LaneDescription {
            axes: (0..3).map(|axis| lane_axis(axis, &mut random)).collect(),
            authority: Default::default(),
            margins: Margins::default(),
        }),
        tie: None,
        monitor: Some(MonitorDescription {
            divisor: 5,
            validated_rms: 0.01,
            axes: (0..3).map(|axis| monitored(axis, &mut random)).collect(),
        }),
    };
    encode(&description, Some(&network), precision, &calibration).unwrap()
}

/// An axis of the monitor with responses as long as there can be.
fn monitored(axis: u8, random: &mut Xoshiro256PlusPlus) -> MonitorAxisDescription {
    let taps = vec![uniform(random, 32, 0.1), uniform(random, 32, 0.1)];
    MonitorAxisDescription { error: (axis, axis), inputs: vec![axis, axis + 3], taps }
}

fn network(shape: &Shape, inputs: usize, random: &mut Xoshiro256PlusPlus) -> FloatNetwork {
    let mut width = inputs;
    let mut layer = |outputs: usize, activation: Activation| {
        let weights = uniform(random, width * outputs, 1.7 / (width as f32).sqrt());
        width = outputs;
        DenseLayer { weights, bias: uniform(random, outputs, 0.1), activation }
    };
    let mut layers: Vec<DenseLayer> = shape.hidden.iter().map(|&outputs| layer(outputs, shape.activation)).collect();
    if !layers.is_empty() {
        layers.push(layer(6, Activation::Linear));
    }
    FloatNetwork {
        input_mean: uniform(random, inputs, 0.01),
        input_scale: vec![FEATURE_SCALE; inputs],
        layers,
        skip: Some(uniform(random, inputs * 6, 0.2)),
        output_mean: uniform(random, 6, 1e-3),
        output_scale: vec![0.02, 0.02, 0.02, 0.05, 0.05, 0.05],
        notes: Default::default(),
    }
}

/// A PD of small gain on position and velocity error, with small random numbers on the older lags.
fn lane_axis(axis: u8, random: &mut Xoshiro256PlusPlus) -> LaneAxisDescription {
    let mut error_coefficients = vec![uniform(random, LAGS, 2e-3), uniform(random, LAGS, 1e-3)];
    error_coefficients[0][0] -= 0.15;
    error_coefficients[1][0] -= 0.05;
    LaneAxisDescription {
        output: axis,
        errors: vec![(axis, axis), (axis + 3, axis + 3)],
        error_coefficients,
        output_coefficients: uniform(random, LAGS, 0.02),
        integral: -0.3,
        fast_limit: 0.04,
        integral_limit: 0.1,
    }
}

fn uniform(random: &mut Xoshiro256PlusPlus, count: usize, limit: f32) -> Vec<f32> {
    (0..count).map(|_| random.random_range(-limit..limit)).collect()
}
