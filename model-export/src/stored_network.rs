//! The network of a model file as the firmware computes with it, its matrices unpacked.
//!
//! *in* a loaded model; *out* plain vectors for batches and bounds; *never* a number that the firmware does not use;
//! *source* the packed order in `impromptu_firmware::network`.

use impromptu_firmware::{
    model::{Arithmetic, Blob, Card, LayerLayout, Model, Section},
    network::{self, ROWS},
};

use crate::float_network::{Activation, DenseLayer};

/// Where the accumulators of an integer layer go.
#[derive(Clone, Debug, PartialEq)]
pub enum Requantisation {
    /// Hidden layers: the multiplier of each row.
    Codes(Vec<i32>),
    /// Last layer: the scale of each row.
    Floats(Vec<f32>),
}

/// One integer layer: accumulator = Σ weight × code + bias.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredIntegerLayer {
    /// Row-major `[outputs][inputs]`.
    pub weights: Vec<i32>,
    /// One for each output.
    pub bias: Vec<i32>,
    /// Of each output.
    pub requantisation: Requantisation,
    /// Activation.
    pub activation: Activation,
    /// Largest magnitude of an input's code.
    pub input_limit: i32,
}

/// The dense layers.
#[derive(Clone, Debug, PartialEq)]
pub enum StoredLayers {
    /// In f32.
    Float(Vec<DenseLayer>),
    /// In integers.
    Integer {
        /// Factor from a normalised input to its code.
        input_code: f32,
        /// Layers.
        layers: Vec<StoredIntegerLayer>,
    },
}

/// A model's network.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredNetwork {
    /// Subtracted from each input.
    pub input_mean: Vec<f32>,
    /// Factor on each input then.
    pub input_reciprocal: Vec<f32>,
    /// Dense layers.
    pub layers: StoredLayers,
    /// Row-major `[outputs][inputs]`.
    pub skip: Option<Vec<f32>>,
    /// Factor on each output.
    pub output_scale: Vec<f32>,
    /// Added to each output then.
    pub output_mean: Vec<f32>,
}

fn activation(activation: network::Activation) -> Activation {
    match activation {
        network::Activation::Linear => Activation::Linear,
        network::Activation::Relu => Activation::Relu,
        network::Activation::Tanh => Activation::Tanh,
    }
}

/// Packed `[block][input][row in block]` to row-major `[outputs][inputs]`.
fn unpacked<T: Copy>(packed: &[T], inputs: usize, outputs: usize) -> Vec<T> {
    let at = |output: usize, input: usize| packed[(output / ROWS * inputs + input) * ROWS + output % ROWS];
    (0..outputs * inputs).map(|index| at(index / inputs, index % inputs)).collect()
}

/// A section that the model's check has seen.
fn floats(blob: &Blob<'_>, section: Section, count: usize) -> Vec<f32> {
    blob.floats(section, count, "").map(|floats| floats.iter().collect()).unwrap_or_default()
}

fn integers(blob: &Blob<'_>, section: Section, count: usize) -> Vec<i32> {
    blob.integers(section, count, "").map(|integers| integers.iter().collect()).unwrap_or_default()
}

fn float_layer(blob: &Blob<'_>, layout: &LayerLayout) -> DenseLayer {
    let (inputs, outputs) = (usize::from(layout.inputs), usize::from(layout.outputs));
    let rows = network::padded(outputs);
    let mut bias = floats(blob, layout.bias, rows);
    bias.truncate(outputs);
    let weights = unpacked(&floats(blob, layout.weights, inputs * rows), inputs, outputs);
    DenseLayer { weights, bias, activation: activation(layout.activation) }
}

fn integer_layer(blob: &Blob<'_>, layout: &LayerLayout, last: bool) -> StoredIntegerLayer {
    let (inputs, outputs) = (usize::from(layout.inputs), usize::from(layout.outputs));
    let rows = network::padded(outputs);
    let bytes = blob.bytes(layout.weights, inputs * rows, "").unwrap_or_default();
    let mut bias = integers(blob, layout.bias, rows);
    bias.truncate(outputs);
    let requantisation = if last {
        let mut scales = floats(blob, layout.requantisation, rows);
        scales.truncate(outputs);
        Requantisation::Floats(scales)
    } else {
        let mut multipliers = integers(blob, layout.requantisation, rows);
        multipliers.truncate(outputs);
        Requantisation::Codes(multipliers)
    };
    StoredIntegerLayer {
        weights: unpacked(bytes, inputs, outputs).into_iter().map(|byte| i32::from(byte as i8)).collect(),
        bias,
        requantisation,
        activation: activation(layout.activation),
        input_limit: network::CODE_LIMIT,
    }
}

impl StoredNetwork {
    /// The network of a loaded model, if it has one.
    pub fn of_model(model: &Model<'_>) -> Option<Self> {
        Self::of_card(model.card(), model.blob())
    }

    /// The same out of the parts of a file that is still being made.
    pub(crate) fn of_card(card: &Card<'_>, blob: &Blob<'_>) -> Option<Self> {
        let layout = card.network.as_ref()?;
        let (inputs, outputs) = (card.features.len(), card.outputs.len());
        let mut input_mean = floats(blob, layout.input_normalisation, 2 * inputs);
        let input_reciprocal = input_mean.split_off(inputs);
        let mut output_scale = floats(blob, layout.output_normalisation, 2 * outputs);
        let output_mean = output_scale.split_off(outputs);
        let layers = match layout.arithmetic {
            Arithmetic::Float => StoredLayers::Float(layout.layers.iter().map(|layer| float_layer(blob, layer)).collect()),
            Arithmetic::Int8 => StoredLayers::Integer {
                input_code: layout.input_code,
                layers: layout
                    .layers
                    .iter()
                    .enumerate()
                    .map(|(index, layer)| integer_layer(blob, layer, index + 1 == layout.layers.len()))
                    .collect(),
            },
        };
        let skip = (layout.skip.length > 0)
            .then(|| unpacked(&floats(blob, layout.skip, inputs * network::padded(outputs)), inputs, outputs));
        Some(Self { input_mean, input_reciprocal, layers, skip, output_scale, output_mean })
    }
}
