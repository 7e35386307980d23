//! The network while it is trained: forward and backward pass over whole batches, and the Adam update.
//!
//! Weights are kept as `[inputs][outputs]`, so that every product runs along the rows of both operands; the one product
//! that needs the other order, the gradient towards the inputs, uses a copy that is transposed once a step. A layer's
//! output is overwritten by its gradient on the way back: nothing is allocated in a step.

use super::elementwise::{AdamFactors, adam, apply_tanh, column_sums, sum_of_squares};
use super::quantisation::{round_activations, round_weights};
use impromptu_model_export::{
    batch::{
        matrix_kernel::{Accumulate, Bias, Store, TimesReluDerivative, TimesTanhDerivative, product},
        padded_matrix::PaddedMatrix,
    },
    float_network::{Activation, DenseLayer},
};
use pulp::Arch;

/// A matrix of parameters with its gradient and Adam's two means.
#[derive(Debug, Clone)]
pub(super) struct Parameter {
    pub(super) value: PaddedMatrix,
    pub(super) gradient: PaddedMatrix,
    first: Vec<f32>,
    second: Vec<f32>,
}

impl Parameter {
    pub(super) fn new(value: PaddedMatrix) -> Self {
        let gradient = PaddedMatrix::zeros(value.rows, value.columns);
        let zeros = vec![0.0; value.values.len()];
        Self { value, gradient, first: zeros.clone(), second: zeros }
    }

    /// From `[outputs][inputs]`, as networks are stored.
    pub(super) fn from_rows_of_outputs(weights: &[f32], inputs: usize, outputs: usize) -> Self {
        Self::new(PaddedMatrix::from_fn(inputs, outputs, |input, output| weights[output * inputs + input]))
    }

    /// To `[outputs][inputs]`.
    pub(super) fn to_rows_of_outputs(&self) -> Vec<f32> {
        let (inputs, outputs) = (self.value.rows, self.value.columns);
        (0..outputs * inputs).map(|index| self.value.row(index % inputs)[index / inputs]).collect()
    }

    fn update(&mut self, arch: Arch, factors: AdamFactors) {
        let (value, gradient) = (&mut self.value.values, &self.gradient.values);
        adam(arch, factors, value, gradient, &mut self.first, &mut self.second);
    }
}

/// One dense layer in training.
#[derive(Debug, Clone)]
pub(super) struct TrainedLayer {
    pub(super) weights: Parameter,
    pub(super) bias: Parameter,
    activation: Activation,
    /// What the products use: the weights, rounded if quantisation is imitated.
    used: Option<PaddedMatrix>,
    transposed: PaddedMatrix,
    /// One row for each row of the batch; its gradient after the backward pass.
    output: PaddedMatrix,
    /// Scale and largest number of the rounded inputs.
    input_range: Option<(f32, f32)>,
}

/// The layers, the skip if it is trained, and the batch they work on.
#[derive(Debug, Clone)]
pub(super) struct Backpropagation {
    arch: Arch,
    pub(super) layers: Vec<TrainedLayer>,
    pub(super) skip: Option<Parameter>,
    /// Normalised inputs of the batch.
    pub(super) inputs: PaddedMatrix,
    /// The same, rounded, if the first layer's inputs are.
    rounded_inputs: Option<PaddedMatrix>,
    scales: Vec<f32>,
}

impl Backpropagation {
    /// For batches of up to `batch` rows.
    pub(super) fn new(inputs: usize, layers: &[DenseLayer], skip: Option<Parameter>, batch: usize) -> Self {
        let mut width = inputs;
        let layers = layers.iter().map(|layer| {
            let outputs = layer.outputs();
            let trained = TrainedLayer {
                weights: Parameter::from_rows_of_outputs(&layer.weights, width, outputs),
                bias: Parameter::new(PaddedMatrix::from_fn(1, outputs, |_, output| layer.bias[output])),
                activation: layer.activation,
                used: None,
                transposed: PaddedMatrix::zeros(outputs, width),
                output: PaddedMatrix::zeros(batch, outputs),
                input_range: None,
            };
            width = outputs;
            trained
        });
        let layers: Vec<TrainedLayer> = layers.collect();
        let widest = layers.iter().map(|layer| layer.weights.value.stride).max().unwrap_or(0);
        let inputs = PaddedMatrix::zeros(batch, inputs);
        let mut network = Self { arch: Arch::new(), layers, skip, inputs, rounded_inputs: None, scales: vec![0.0; widest] };
        network.prepare();
        network
    }

    /// Imitates quantisation from now on; `ranges` has the scale and largest number of each layer's inputs, if they are
    /// rounded.
    pub(super) fn quantise(&mut self, ranges: Option<Vec<(f32, f32)>>) {
        for layer in &mut self.layers {
            layer.used = Some(layer.weights.value.clone());
        }
        if let Some(ranges) = ranges {
            self.rounded_inputs = Some(self.inputs.clone());
            for (layer, range) in self.layers.iter_mut().zip(ranges) {
                layer.input_range = Some(range);
            }
        }
        self.prepare();
    }

    /// Brings rounded and transposed weights up to date.
    pub(super) fn prepare(&mut self) {
        for (index, layer) in self.layers.iter_mut().enumerate() {
            if let Some(used) = &mut layer.used {
                round_weights(self.arch, &layer.weights.value, used, &mut self.scales);
            }
            // Nobody asks for the gradient of the network's inputs.
            if index > 0 {
                layer.transposed.copy_transposed(self.arch, layer.used.as_ref().unwrap_or(&layer.weights.value));
            }
        }
    }

    /// The outputs for the first `rows` rows of the inputs.
    pub(super) fn forward(&mut self, rows: usize) -> &mut PaddedMatrix {
        let arch = self.arch;
        if let (Some(rounded), Some(range)) = (&mut self.rounded_inputs, self.layers[0].input_range) {
            rounded.values.copy_from_slice(&self.inputs.values);
            round_activations(arch, rounded, rows, range);
        }
        for index in 0..self.layers.len() {
            let next_range = self.layers.get(index + 1).and_then(|next| next.input_range);
            let (before, from_here) = self.layers.split_at_mut(index);
            let layer = &mut from_here[0];
            let first_input = self.rounded_inputs.as_ref().unwrap_or(&self.inputs);
            let input = before.last().map_or(first_input, |previous| &previous.output);
            let weights = layer.used.as_ref().unwrap_or(&layer.weights.value);
            let (shape, bias) = ((rows, weights.rows), &layer.bias.value.values[..]);
            match layer.activation {
                Activation::Relu => product::<false>(arch, shape, input, weights, &mut layer.output, Bias::<true>(bias)),
                Activation::Tanh | Activation::Linear => {
                    product::<false>(arch, shape, input, weights, &mut layer.output, Bias::<false>(bias));
                }
            }
            if layer.activation == Activation::Tanh {
                apply_tanh(arch, &mut layer.output, rows);
            }
            if let Some(range) = next_range {
                round_activations(arch, &mut layer.output, rows, range);
            }
        }
        let output = &mut self.layers.last_mut().expect("a network in training has a layer").output;
        if let Some(skip) = &self.skip {
            product::<false>(arch, (rows, skip.value.rows), &self.inputs, &skip.value, output, Accumulate);
        }
        output
    }

    /// The gradients of all parameters, once the outputs of [`Backpropagation::forward`] are replaced by the loss's
    /// gradient. Rounding counts as the identity (straight-through).
    pub(super) fn backward(&mut self, rows: usize) {
        let arch = self.arch;
        for index in (0..self.layers.len()).rev() {
            let (before, from_here) = self.layers.split_at_mut(index);
            let layer = &mut from_here[0];
            let first_input = self.rounded_inputs.as_ref().unwrap_or(&self.inputs);
            let input = before.last().map_or(first_input, |previous| &previous.output);
            let shape = (layer.weights.value.rows, rows);
            product::<true>(arch, shape, input, &layer.output, &mut layer.weights.gradient, Store);
            column_sums(arch, &layer.output, rows, &mut layer.bias.gradient);
            if let Some(previous) = before.last_mut() {
                let (shape, target) = ((rows, layer.transposed.rows), &mut previous.output);
                let (gradient, weights) = (&layer.output, &layer.transposed);
                match previous.activation {
                    Activation::Relu => product::<false>(arch, shape, gradient, weights, target, TimesReluDerivative),
                    Activation::Tanh => product::<false>(arch, shape, gradient, weights, target, TimesTanhDerivative),
                    Activation::Linear => product::<false>(arch, shape, gradient, weights, target, Store),
                }
            }
        }
        if let (Some(skip), Some(last)) = (&mut self.skip, self.layers.last()) {
            product::<true>(arch, (skip.value.rows, rows), &self.inputs, &last.output, &mut skip.gradient, Store);
        }
    }

    /// The norm of the whole gradient.
    pub(super) fn gradient_norm(&self) -> f64 {
        let parameters = self.layers.iter().flat_map(|layer| [&layer.weights, &layer.bias]).chain(&self.skip);
        parameters.map(|parameter| sum_of_squares(self.arch, &parameter.gradient.values)).sum::<f64>().sqrt()
    }

    /// One Adam step; biases are not decayed.
    pub(super) fn update(&mut self, factors: AdamFactors) {
        let arch = self.arch;
        for layer in &mut self.layers {
            layer.weights.update(arch, factors);
            layer.bias.update(arch, AdamFactors { shrink: 1.0, ..factors });
        }
        if let Some(skip) = &mut self.skip {
            skip.update(arch, factors);
        }
        self.prepare();
    }

    /// The largest magnitude of each layer's inputs over the first rows, after [`Backpropagation::forward`].
    pub(super) fn raise_to_largest_inputs(&self, rows: usize, largest: &mut [f32]) {
        let outputs = self.layers.iter().map(|layer| &layer.output);
        for (largest, matrix) in largest.iter_mut().zip(std::iter::once(&self.inputs).chain(outputs)) {
            let values = (0..rows).flat_map(|row| matrix.row(row));
            *largest = values.fold(*largest, |largest, value| largest.max(value.abs()));
        }
    }

    /// Keeps the values of all parameters in `kept`, which has the same layers.
    pub(super) fn store_values(&self, kept: &mut Vec<PaddedMatrix>) {
        let parameters = self.layers.iter().flat_map(|layer| [&layer.weights, &layer.bias]).chain(&self.skip);
        kept.clear();
        kept.extend(parameters.map(|parameter| parameter.value.clone()));
    }

    /// Takes back what [`Backpropagation::store_values`] kept.
    pub(super) fn restore_values(&mut self, kept: Vec<PaddedMatrix>) {
        let parameters = self.layers.iter_mut().flat_map(|layer| [&mut layer.weights, &mut layer.bias]);
        for (parameter, value) in parameters.chain(&mut self.skip).zip(kept) {
            parameter.value = value;
        }
        self.prepare();
    }
}
