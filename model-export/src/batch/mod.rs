//! A network over many rows at once, on vector registers.
//!
//! *in* a [`FloatNetwork`] or a loaded model, and rows of features in physical units; *out* for each row exactly the bits that
//! [`FloatNetwork::evaluate`] or the firmware's `Network::evaluate` give for it alone (rows must be finite; the sign of a zero
//! may differ); *never* another order of summation; *source* the products of [`matrix_kernel`], without fusing.

mod integer;
pub mod matrix_kernel;
pub mod padded_matrix;

use impromptu_firmware::{model::Model, network};
use pulp::Arch;

use self::{
    integer::{BLOCK, IntegerLayers},
    matrix_kernel::{Accumulate, Bias, Unfused, product},
    padded_matrix::PaddedMatrix,
};
use crate::{
    float_network::{Activation, DenseLayer, FloatNetwork},
    stored_network::{StoredLayers, StoredNetwork},
};

/// Row-major `[outputs][inputs]` to a matrix with one row for each input.
fn transposed(weights: &[f32], inputs: usize, outputs: usize) -> PaddedMatrix {
    PaddedMatrix::from_fn(inputs, outputs, |input, output| weights[output * inputs + input])
}

fn one_row(values: &[f32]) -> PaddedMatrix {
    PaddedMatrix::from_fn(1, values.len(), |_, column| values[column])
}

struct Layer {
    weights: PaddedMatrix,
    /// Padded as a row of the outputs.
    bias: PaddedMatrix,
    activation: Activation,
    tanh: fn(f32) -> f32,
    outputs: PaddedMatrix,
}

impl Layer {
    fn new(layer: &DenseLayer, inputs: usize, tanh: fn(f32) -> f32) -> Self {
        Self {
            weights: transposed(&layer.weights, inputs, layer.outputs()),
            bias: one_row(&layer.bias),
            activation: layer.activation,
            tanh,
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
                self.outputs.row_mut(row).iter_mut().for_each(|value| *value = (self.tanh)(*value));
            }
        }
    }
}

enum Layers {
    Float(Vec<Layer>),
    Integer(IntegerLayers),
}

/// In whose order the operations are: both round differently.
#[derive(Clone, Copy, PartialEq)]
enum Order {
    /// [`FloatNetwork::evaluate`]: the input is divided by its scale, the skip's products are added to the dense layers' outputs.
    FloatNetwork,
    /// The firmware: the input is multiplied by the reciprocal, the dense layers' outputs are added to the skip's.
    Firmware,
}

/// A network laid out for batches.
pub struct Batch {
    arch: Arch,
    order: Order,
    input_mean: Vec<f32>,
    /// Divisors or factors.
    input_scale: Vec<f32>,
    layers: Layers,
    /// Weights and bias.
    skip: Option<(PaddedMatrix, PaddedMatrix)>,
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
            order: Order::FloatNetwork,
            input_mean: network.input_mean.clone(),
            input_scale: network.input_scale.clone(),
            layers: Layers::Float(float_layers(&network.layers, network.inputs(), libm::tanhf)),
            skip: network
                .skip
                .as_ref()
                .map(|skip| (transposed(skip, network.inputs(), network.outputs()), PaddedMatrix::zeros(1, network.outputs()))),
            output_scale: network.output_scale.clone(),
            output_mean: network.output_mean.clone(),
            inputs: PaddedMatrix::zeros(BLOCK, network.inputs()),
            result: PaddedMatrix::zeros(BLOCK, network.outputs()),
        }
    }

    /// The network of a loaded model, if it has one.
    pub fn of_model<const C: usize, const O: usize, const A: usize>(model: &Model<'_, C, O, A>) -> Option<Self> {
        let stored = StoredNetwork::of_model(model)?;
        let (inputs, outputs) = (stored.input_mean.len(), stored.output_mean.len());
        Some(Self {
            arch: Arch::new(),
            order: Order::Firmware,
            layers: match &stored.layers {
                StoredLayers::Float(layers) => Layers::Float(float_layers(layers, inputs, network::tanh)),
                StoredLayers::Integer { input_code, layers } => Layers::Integer(IntegerLayers::new(*input_code, layers)),
            },
            input_mean: stored.input_mean,
            input_scale: stored.input_reciprocal,
            skip: stored.skip.map(|skip| (transposed(&skip.weights, inputs, outputs), one_row(&skip.bias))),
            output_scale: stored.output_scale,
            output_mean: stored.output_mean,
            inputs: PaddedMatrix::zeros(BLOCK, inputs),
            result: PaddedMatrix::zeros(BLOCK, outputs),
        })
    }

    /// Calls `each` with every row's index and outputs, in the outputs' units and in order; `rows` have one value for each
    /// feature.
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

    /// Largest magnitude of the normalised inputs, then of each layer's outputs, over the rows: what calibration asks for. A
    /// model's integer layers give none.
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
            *value = match self.order {
                Order::FloatNetwork => (input - mean) / scale,
                Order::Firmware => (input - mean) * scale,
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
            Layers::Integer(layers) => layers.forward(self.arch, rows, &self.inputs),
        }
    }

    /// Skip and denormalisation.
    fn finish(&mut self, rows: usize) {
        let dense = match &self.layers {
            Layers::Float(layers) => layers.last().map(|last| &last.outputs),
            Layers::Integer(layers) => layers.result(),
        };
        let copied = self.order == Order::FloatNetwork && dense.is_some();
        match dense.filter(|_| copied) {
            Some(dense) => (0..rows).for_each(|row| self.result.copy_row(row, dense, row)),
            None => self.result.values.fill(0.0),
        }
        if let Some((skip, bias)) = &self.skip {
            let shape = (rows, skip.rows);
            if copied {
                product::<false>(self.arch, shape, &self.inputs, skip, &mut self.result, Unfused(Accumulate));
            } else {
                product::<false>(self.arch, shape, &self.inputs, skip, &mut self.result, Unfused(Bias::<false>(&bias.values)));
            }
        }
        if let Some(dense) = dense.filter(|_| !copied) {
            for row in 0..rows {
                self.result.row_mut(row).iter_mut().zip(dense.row(row)).for_each(|(sum, value)| *sum += value);
            }
        }
        for row in 0..rows {
            let denormalisation = self.output_scale.iter().zip(&self.output_mean);
            for (value, (scale, mean)) in self.result.row_mut(row).iter_mut().zip(denormalisation) {
                *value = *value * scale + mean;
            }
        }
    }
}

fn float_layers(layers: &[DenseLayer], inputs: usize, tanh: fn(f32) -> f32) -> Vec<Layer> {
    let mut width = inputs;
    let layers = layers.iter().map(|layer| {
        let laid_out = Layer::new(layer, width, tanh);
        width = layer.outputs();
        laid_out
    });
    layers.collect()
}
