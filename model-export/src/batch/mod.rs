//! A network over many rows at once, on vector registers.
//!
//! *in* a [`FloatNetwork`] or a loaded model, and rows of features in physical units; *out* for each row exactly the bits that
//! [`FloatNetwork::evaluate`] or the firmware's `Network::evaluate` give for it alone (rows must be finite; the sign of a zero may
//! differ); *never* another order of summation; *source* the products of [`matrix_kernel`], without fusing.

mod integer;
pub mod matrix_kernel;
pub mod padded_matrix;

use impromptu_firmware::model::Model;
use pulp::Arch;

use self::{
    integer::IntegerLayers,
    matrix_kernel::{Accumulate, Bias, Unfused, product},
    padded_matrix::PaddedMatrix,
};
use crate::{
    float_network::{Activation, DenseLayer, FloatNetwork},
    stored_network::{StoredLayers, StoredNetwork},
};

/// Rows that are evaluated together: the activations of two layers of 128 units stay in the second-level cache.
pub(crate) const BLOCK: usize = 128;

/// Row-major `[outputs][inputs]` to a matrix with one row for each input.
fn transposed(weights: &[f32], inputs: usize, outputs: usize) -> PaddedMatrix {
    PaddedMatrix::from_fn(inputs, outputs, |input, output| weights[output * inputs + input])
}

struct Layer {
    weights: PaddedMatrix,
    /// Padded as a row of the outputs.
    bias: PaddedMatrix,
    activation: Activation,
    outputs: PaddedMatrix,
}

impl Layer {
    fn new(layer: &DenseLayer, inputs: usize) -> Self {
        Self {
            weights: transposed(&layer.weights, inputs, layer.outputs()),
            bias: PaddedMatrix::from_fn(1, layer.outputs(), |_, output| layer.bias[output]),
            activation: layer.activation,
            outputs: PaddedMatrix::zeros(BLOCK, layer.outputs()),
        }
    }

    fn forward(&mut self, arch: Arch, rows: usize, inputs: &PaddedMatrix) {
        let (shape, bias) = ((rows, self.weights.rows), &self.bias.values[..]);
        if self.activation == Activation::Relu {
            product::<false>(arch, shape, inputs, &self.weights, &mut self.outputs, Unfused(Bias::<true>(bias)));
            return;
        }
        product::<false>(arch, shape, inputs, &self.weights, &mut self.outputs, Unfused(Bias::<false>(bias)));
        if self.activation == Activation::Tanh {
            for row in 0..rows {
                self.outputs.row_mut(row).iter_mut().for_each(|value| *value = self.activation.apply(*value));
            }
        }
    }
}

enum Layers {
    Float(Vec<Layer>),
    Integer(IntegerLayers),
}

/// How the inputs are normalised: both ways round differently.
enum Normalisation {
    Divide,
    Multiply,
}

/// A network laid out for batches.
pub struct Batch {
    arch: Arch,
    normalisation: Normalisation,
    input_mean: Vec<f32>,
    /// Divisors or factors.
    input_scale: Vec<f32>,
    layers: Layers,
    skip: Option<PaddedMatrix>,
    output_scale: Vec<f32>,
    output_mean: Vec<f32>,
    inputs: PaddedMatrix,
    result: PaddedMatrix,
}

impl Batch {
    /// A float network, which has passed [`FloatNetwork::check`].
    pub fn of_network(network: &FloatNetwork) -> Self {
        Self {
            arch: Arch::new(),
            normalisation: Normalisation::Divide,
            input_mean: network.input_mean.clone(),
            input_scale: network.input_scale.clone(),
            layers: Layers::Float(float_layers(&network.layers, network.inputs())),
            skip: network.skip.as_ref().map(|skip| transposed(skip, network.inputs(), network.outputs())),
            output_scale: network.output_scale.clone(),
            output_mean: network.output_mean.clone(),
            inputs: PaddedMatrix::zeros(BLOCK, network.inputs()),
            result: PaddedMatrix::zeros(BLOCK, network.outputs()),
        }
    }

    /// The network of a loaded model, if it has one.
    pub fn of_model(model: &Model<'_>) -> Option<Self> {
        let network = StoredNetwork::of_model(model)?;
        let (inputs, outputs) = (network.input_mean.len(), network.output_mean.len());
        Some(Self {
            arch: Arch::new(),
            normalisation: Normalisation::Multiply,
            layers: match &network.layers {
                StoredLayers::Float(layers) => Layers::Float(float_layers(layers, inputs)),
                StoredLayers::Integer { input_code, layers } => Layers::Integer(IntegerLayers::new(*input_code, layers)),
            },
            input_mean: network.input_mean,
            input_scale: network.input_reciprocal,
            skip: network.skip.map(|skip| transposed(&skip, inputs, outputs)),
            output_scale: network.output_scale,
            output_mean: network.output_mean,
            inputs: PaddedMatrix::zeros(BLOCK, inputs),
            result: PaddedMatrix::zeros(BLOCK, outputs),
        })
    }

    /// Calls `each` with every row's index and outputs, in the outputs' units and in order; `rows` have one value for each feature.
    pub fn evaluate<'r>(&mut self, rows: impl IntoIterator<Item = &'r [f32]>, mut each: impl FnMut(usize, &[f32])) {
        let mut first = 0;
        self.blocks(rows, |batch, rows| {
            batch.finish(rows);
            for row in 0..rows {
                each(first + row, batch.result.row(row));
            }
            first += rows;
        });
    }

    /// Largest magnitude of the normalised inputs, then of each layer's outputs, over the rows: what calibration asks for. A model's
    /// integer layers give none.
    pub fn largest_magnitudes<'r>(&mut self, rows: impl IntoIterator<Item = &'r [f32]>) -> Vec<f32> {
        let layers = if let Layers::Float(layers) = &self.layers { layers.len() } else { 0 };
        let mut largest = vec![0.0f32; 1 + layers];
        self.blocks(rows, |batch, rows| {
            let outputs = if let Layers::Float(layers) = &batch.layers { &layers[..] } else { &[] };
            let matrices = std::iter::once(&batch.inputs).chain(outputs.iter().map(|layer| &layer.outputs));
            for (largest, matrix) in largest.iter_mut().zip(matrices) {
                let values = (0..rows).flat_map(|row| matrix.row(row));
                *largest = values.fold(*largest, |largest, value| largest.max(value.abs()));
            }
        });
        largest
    }

    /// Runs the dense layers over blocks of rows.
    fn blocks<'r>(&mut self, rows: impl IntoIterator<Item = &'r [f32]>, mut each: impl FnMut(&mut Self, usize)) {
        let mut filled = 0;
        for row in rows {
            self.load(filled, row);
            filled += 1;
            if filled == BLOCK {
                self.forward(filled);
                each(self, filled);
                filled = 0;
            }
        }
        if filled > 0 {
            self.forward(filled);
            each(self, filled);
        }
    }

    fn load(&mut self, slot: usize, row: &[f32]) {
        let normalisation = self.input_mean.iter().zip(&self.input_scale);
        for ((value, input), (mean, scale)) in self.inputs.row_mut(slot).iter_mut().zip(row).zip(normalisation) {
            *value = match self.normalisation {
                Normalisation::Divide => (input - mean) / scale,
                Normalisation::Multiply => (input - mean) * scale,
            };
        }
    }

    fn forward(&mut self, rows: usize) {
        match &mut self.layers {
            Layers::Float(layers) => {
                for index in 0..layers.len() {
                    let (before, from_here) = layers.split_at_mut(index);
                    let inputs = before.last().map_or(&self.inputs, |previous| &previous.outputs);
                    from_here[0].forward(self.arch, rows, inputs);
                }
            }
            Layers::Integer(layers) => layers.forward(self.arch, rows, &self.inputs, &mut self.result),
        }
    }

    /// Skip and denormalisation.
    fn finish(&mut self, rows: usize) {
        if let Layers::Float(layers) = &self.layers {
            match layers.last() {
                Some(last) => (0..rows).for_each(|row| self.result.copy_row(row, &last.outputs, row)),
                None => self.result.values.fill(0.0),
            }
        }
        if let Some(skip) = &self.skip {
            let shape = (rows, skip.rows);
            product::<false>(self.arch, shape, &self.inputs, skip, &mut self.result, Unfused(Accumulate));
        }
        for row in 0..rows {
            let denormalisation = self.output_scale.iter().zip(&self.output_mean);
            for (value, (scale, mean)) in self.result.row_mut(row).iter_mut().zip(denormalisation) {
                *value = *value * scale + mean;
            }
        }
    }
}

fn float_layers(layers: &[DenseLayer], inputs: usize) -> Vec<Layer> {
    let mut width = inputs;
    let layers = layers.iter().map(|layer| {
        let laid_out = Layer::new(layer, width);
        width = layer.outputs();
        laid_out
    });
    layers.collect()
}
