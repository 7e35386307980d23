//! The network as the microcontroller evaluates it.
//!
//! *in* a [`Network`], its features and training rows; *out* the firmware's model file and a module that runs the firmware's
//! kernels on it; *never* arithmetic of its own: features are rounded to f32, the rest is `Network::evaluate` of the firmware;
//! *source* none: the paper's networks ran off-board.

use impromptu_firmware::{
    model::{Interpolation, Model, Output, Refusal},
    network::Scratch,
    preview::EndRule,
};
use impromptu_model_export::{
    Description, ExportError, FloatNetwork, Precision,
    description::{ChannelDescription, Provenance, Signals, Timing},
    encode,
    float_network::{Activation, DenseLayer},
};
use nalgebra::{DMatrix, DVector};

use crate::siso::{FeatureSet, Module, Moment, Scalar, network::Network, samples::Rows};

/// The network in f32, for `model-export`.
pub fn float_network(network: &Network) -> FloatNetwork {
    let narrow = |values: &mut dyn Iterator<Item = f64>| -> Vec<f32> { values.map(|value| value as f32).collect() };
    let hidden = |weights: &DMatrix<f64>, bias: &DVector<f64>| DenseLayer {
        weights: narrow(&mut weights.transpose().iter().copied()),
        bias: narrow(&mut bias.iter().copied()),
        activation: Activation::Tanh,
    };
    let units = network.second_bias.len();
    let last = DenseLayer {
        weights: narrow(&mut network.last.iter().take(units).copied()),
        bias: narrow(&mut network.last.iter().skip(units).copied()),
        activation: Activation::Linear,
    };
    FloatNetwork {
        input_mean: narrow(&mut network.inputs.iter().map(|scaling| scaling.centre)),
        input_scale: narrow(&mut network.inputs.iter().map(|scaling| scaling.half)),
        layers: vec![hidden(&network.first, &network.first_bias), hidden(&network.second, &network.second_bias), last],
        skip: None,
        output_mean: vec![network.output.centre as f32],
        output_scale: vec![network.output.half as f32],
        notes: Default::default(),
    }
}

/// The bytes of the model file. `rows` calibrate the integers' ranges.
///
/// # Errors
/// If the firmware would refuse the file, for example for a layer that is too steep for its integers.
pub fn model_file(
    network: &Network,
    set: &FeatureSet,
    rows: &Rows,
    precision: Precision,
    period: f64,
) -> Result<Vec<u8>, ExportError> {
    let channel = |name: String| ChannelDescription { name, unit: "1".into(), frame: String::new(), end: EndRule::Hold };
    let states = set.features.len().max(2);
    let description = Description {
        name: "single-input single-output".into(),
        provenance: Provenance { software: "impromptu-reproduction".into(), ..Provenance::default() },
        signals: Signals {
            desired: vec![channel("output".into())],
            measured: (0..states).map(|index| channel(format!("state.{index}"))).collect(),
            // The firmware adapts a desired channel of the same name.
            reference: vec![channel("output".into())],
        },
        timing: Timing {
            reference_rate_hz: (1.0 / period) as f32,
            divisor: 1,
            interpolation: Interpolation::Hold,
            measurement_delay_s: 0.0,
            fade_s: 0.0,
        },
        features: set.features.clone(),
        // As good as none: the paper's loops have no limits.
        outputs: vec![Output { channel: 0, limit: 1e6, slew: 1e6 }],
        envelope: rows.envelope().iter().map(|(low, high)| (*low as f32, *high as f32)).collect(),
        feedback_lane: None,
        monitor: None,
        tie: None,
    };
    encode(&description, Some(&float_network(network)), precision, &rows.narrow())
}

/// A model file in front of a plant.
#[derive(Debug)]
pub struct FirmwareModule<'a> {
    set: &'a FeatureSet,
    model: Model<'a>,
}

impl<'a> FirmwareModule<'a> {
    /// Loads a file as the microcontroller does.
    ///
    /// # Errors
    /// If the firmware refuses it.
    pub fn new(file: &'a [u8], set: &'a FeatureSet) -> Result<Self, Refusal> {
        Ok(Self { set, model: Model::from_bytes(file)? })
    }

    /// The output for one row of features; NaN for a file without a network.
    pub fn evaluate(&self, inputs: &[f32]) -> f32 {
        let mut outputs = [f32::NAN];
        if let Some(network) = self.model.network() {
            network.evaluate(inputs, &mut outputs, &mut Scratch::new());
        }
        outputs[0]
    }
}

impl<T: Scalar> Module<T> for FirmwareModule<'_> {
    fn reference(&self, moment: &Moment<'_, T>) -> T {
        let output = self.evaluate(&self.set.narrow_inputs(moment)) + self.set.base(moment).wide() as f32;
        T::of(output.into())
    }
}
