//! The network of a model file as the firmware computes with it, its matrices unpacked.
//!
//! *in* a loaded model; *out* plain vectors for batches and bounds; *never* a number that the firmware does not use;
//! *source* the packed orders in `impromptu_firmware::network::kernel`.

use std::ops::Range;

use impromptu_firmware::{
    model::{Arithmetic, Blob, Card, LayerLayout, Model, Section},
    network::{
        self, ROWS,
        kernel::{Width, portable},
    },
};

use crate::{
    float_network::{Activation, DenseLayer},
    packing::float_row_blocks,
};

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
    /// Effective ones, row-major `[outputs][inputs]`.
    pub weights: Vec<i32>,
    /// One for each output.
    pub bias: Vec<i32>,
    /// Of each output.
    pub requantisation: Requantisation,
    /// Activation.
    pub activation: Activation,
    /// Largest magnitude of an input's code.
    pub input_limit: u16,
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
    /// From normalised inputs to normalised outputs; its bias is usually zero.
    pub skip: Option<DenseLayer>,
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

/// A section that the model's check has seen.
fn words(blob: &Blob<'_>, section: Section) -> Vec<u32> {
    let words = blob.words(section, section.length as usize / 4, "").map(|words| words.all()).unwrap_or_default();
    words.iter().map(|word| u32::from_le_bytes(*word)).collect()
}

/// `[outputs][inputs]` of a function of output and input.
fn matrix<T>(outputs: usize, inputs: usize, at: impl Fn(usize, usize) -> T) -> Vec<T> {
    (0..outputs * inputs).map(|index| at(index / inputs, index % inputs)).collect()
}

fn float_layer(blob: &Blob<'_>, section: Section, [inputs, outputs]: [usize; 2], activation: Activation) -> DenseLayer {
    let words = words(blob, section);
    // For every block of rows the biases, then the weights of each input.
    let blocks: Vec<Range<usize>> = float_row_blocks(outputs).collect();
    let depth = words.len() / blocks.last().map_or(1, |last| last.end);
    let at = |output: usize, place: usize| {
        let block = blocks.iter().find(|block| block.contains(&output)).cloned().unwrap_or_default();
        f32::from_bits(words[block.start * depth + place * block.len() + output - block.start])
    };
    DenseLayer {
        weights: matrix(outputs, inputs, |output, input| at(output, 1 + input)),
        bias: (0..outputs).map(|output| at(output, 0)).collect(),
        activation,
    }
}

fn integer_layer(blob: &Blob<'_>, width: Width, layout: &LayerLayout, last: bool) -> StoredIntegerLayer {
    let (inputs, outputs) = (usize::from(layout.inputs), usize::from(layout.outputs));
    let words = words(blob, layout.rows);
    let pairs = inputs.next_multiple_of(network::INPUT_PADDING) / 2;
    let block = width.block(pairs);
    let weight = |output: usize, input: usize| {
        let row = output % ROWS;
        let first = output / ROWS * block + ROWS + input / 2 * width.words();
        let halves = match width {
            Width::Int8 => portable::byte_rows(words[first + row / 2])[row % 2],
            Width::Int16 => portable::halves(words[first + row]),
        };
        i32::from(halves[input % 2])
    };
    let behind = |output: usize| words[(output / ROWS + 1) * block - ROWS + output % ROWS];
    StoredIntegerLayer {
        weights: matrix(outputs, inputs, weight),
        bias: (0..outputs).map(|output| words[output / ROWS * block + output % ROWS] as i32).collect(),
        requantisation: if last {
            Requantisation::Floats((0..outputs).map(|output| f32::from_bits(behind(output))).collect())
        } else {
            Requantisation::Codes((0..outputs).map(|output| behind(output) as i32).collect())
        },
        activation: activation(layout.activation),
        input_limit: layout.input_limit,
    }
}

impl StoredNetwork {
    /// The network of a loaded model, if it has one.
    pub fn of_model<const C: usize, const O: usize, const A: usize>(model: &Model<'_, C, O, A>) -> Option<Self> {
        Self::of_card(model.card(), model.blob())
    }

    /// The same out of the parts of a file that is still being made.
    pub(crate) fn of_card<const C: usize, const O: usize, const A: usize>(
        card: &Card<'_, C, O, A>,
        blob: &Blob<'_>,
    ) -> Option<Self> {
        let layout = card.network.as_ref()?;
        let (inputs, outputs) = (card.features.len(), card.outputs.len());
        let floats = |section: Section| words(blob, section).into_iter().map(f32::from_bits).collect::<Vec<f32>>();
        let mut input_mean = floats(layout.input_normalisation);
        let input_reciprocal = input_mean.split_off(inputs);
        let mut output_scale = floats(layout.output_normalisation);
        let output_mean = output_scale.split_off(outputs);
        let float = |layer: &LayerLayout| {
            let shape = [usize::from(layer.inputs), usize::from(layer.outputs)];
            float_layer(blob, layer.rows, shape, activation(layer.activation))
        };
        let integer = |width| StoredLayers::Integer {
            input_code: layout.input_code,
            layers: (1..)
                .zip(&layout.layers)
                .map(|(n, layer)| integer_layer(blob, width, layer, n == layout.layers.len()))
                .collect(),
        };
        let layers = match layout.arithmetic {
            Arithmetic::Float => StoredLayers::Float(layout.layers.iter().map(float).collect()),
            Arithmetic::Int8 => integer(Width::Int8),
            Arithmetic::Int16 => integer(Width::Int16),
        };
        let skip = (layout.skip.length > 0).then(|| float_layer(blob, layout.skip, [inputs, outputs], Activation::Linear));
        Some(Self { input_mean, input_reciprocal, layers, skip, output_scale, output_mean })
    }
}
