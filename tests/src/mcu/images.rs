//! Networks as the bytes that the emulated board holds in flash: model files for our kernels, plain words for the others.

use impromptu_model_export::{ExportError, Precision, encode, float_network::Activation};

use super::{nets::Net, quantised::quantise};

/// What a kernel reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// A model file.
    Model(Precision),
    /// Row-major f32.
    Float,
    /// Row-major int8, quantised as TensorFlow Lite does it.
    Integer,
}

impl Form {
    /// First part of an image's name.
    fn name(self) -> String {
        match self {
            Self::Model(precision) => format!("model-{precision:?}").to_lowercase(),
            Self::Float => "f32".into(),
            // The benchmark's build script knows this name.
            Self::Integer => "s8".into(),
        }
    }

    /// The name of a network's image.
    pub fn image_name(self, net: &Net) -> String {
        format!("{}-{}", self.name(), net.name)
    }

    /// The image of a network.
    ///
    /// # Errors
    /// If the network is no model that the firmware would take.
    pub fn image(self, net: &Net) -> Result<Vec<u8>, ExportError> {
        Ok(match self {
            Self::Model(precision) => encode(&net.description, Some(&net.network), precision, &net.calibration)?,
            Self::Float => float(net),
            Self::Integer => integer(net),
        })
    }
}

/// Little-endian words one after the other.
#[derive(Default)]
struct Words(Vec<u8>);

impl Words {
    fn integers(&mut self, values: impl IntoIterator<Item = i32>) {
        self.0.extend(values.into_iter().flat_map(i32::to_le_bytes));
    }

    fn floats<'v>(&mut self, values: impl IntoIterator<Item = &'v f32>) {
        self.0.extend(values.into_iter().flat_map(|value| value.to_le_bytes()));
    }
}

fn number(activation: Activation) -> i32 {
    match activation {
        Activation::Linear => 0,
        Activation::Relu => 1,
        Activation::Tanh => 2,
    }
}

/// Read by `plain.rs` of the benchmark.
fn float(net: &Net) -> Vec<u8> {
    let network = &net.network;
    let mut words = Words::default();
    let skip = i32::from(network.skip.is_some());
    words.integers([network.inputs() as i32, network.outputs() as i32, network.layers.len() as i32, skip]);
    words.floats(&network.input_mean);
    words.floats(&network.input_scale.iter().map(|scale| 1.0 / scale).collect::<Vec<_>>());
    words.floats(network.output_mean.iter().chain(&network.output_scale));
    words.floats(network.skip.iter().flatten());
    for layer in &network.layers {
        words.integers([layer.outputs() as i32, number(layer.activation)]);
        words.floats(layer.bias.iter().chain(&layer.weights));
    }
    words.0
}

/// Read by `embedded_nn.rs` and `microflow.rs` of the benchmark.
fn integer(net: &Net) -> Vec<u8> {
    let layers = quantise(&net.network, &net.calibration);
    let mut words = Words::default();
    words.integers([net.network.inputs() as i32, layers.len() as i32]);
    for layer in &layers {
        words.integers([layer.bias.len() as i32, number(layer.activation)]);
        words.integers([layer.input.zero_point, layer.output.zero_point, layer.multiplier, layer.shift]);
        words.floats(&[layer.input.scale, layer.weight_scale, layer.output.scale]);
        words.integers(layer.bias.iter().copied());
        words.0.extend(layer.weights.iter().map(|weight| *weight as u8));
        words.0.resize(words.0.len().next_multiple_of(4), 0);
    }
    words.0
}
