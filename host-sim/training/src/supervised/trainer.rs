//! Mini-batch training of a network, step by step.

use super::backpropagation::{Backpropagation, Parameter};
use super::dataset::Dataset;
use super::elementwise::AdamFactors;
use super::error::TrainingError;
use super::quantisation::activation_range;
use super::settings::{Loss, Skip, TrainingSettings};
use super::standardised::StandardisedSet;
use impromptu_model_export::{
    batch::padded_matrix::PaddedMatrix,
    float_network::{Activation, FloatNetwork},
};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_xoshiro::Xoshiro256PlusPlus;

/// A network, the rows it learns from, and the state of the optimiser. One thread; independent of all others.
#[derive(Debug, Clone)]
pub struct NetworkTrainer {
    settings: TrainingSettings,
    /// Normalisations and, if it is not trained, the skip.
    frame: FloatNetwork,
    engine: Backpropagation,
    training: StandardisedSet,
    /// Targets and row weights of the batch.
    targets: PaddedMatrix,
    row_weights: Vec<f32>,
    output_weights: Vec<f32>,
    /// Factor on the targets and on everything that adds up to the output; see [`StandardisedSet::gain`].
    gain: f32,
    order: Vec<usize>,
    generator: Xoshiro256PlusPlus,
    steps: usize,
    /// beta1 and beta2 to the power of the steps.
    powers: (f64, f64),
}

impl NetworkTrainer {
    /// Continues from the weights of `network`, whose normalisations are kept and whose last layer is linear.
    ///
    /// The skip is trained if the settings say [`Skip::Joint`] and the network has one; otherwise it stays as it is.
    /// [`TrainingSettings::hidden`], `activation` and the initial values are settled by the network.
    pub fn new(network: &FloatNetwork, settings: &TrainingSettings, training: &Dataset) -> Result<Self, TrainingError> {
        network.check()?;
        settings.check(network.outputs())?;
        check_columns(network, training)?;
        if network.layers.last().is_none_or(|layer| layer.activation != Activation::Linear) {
            return Err(TrainingError::LastLayer);
        }
        let joint = settings.skip == Skip::Joint;
        let gain = StandardisedSet::new(network, training, true).gain();
        let mut training = StandardisedSet::new(network, training, !joint);
        training.multiply_targets(gain);
        let skip = network.skip.as_ref().filter(|_| joint).map(|skip| {
            let scaled: Vec<f32> = skip.iter().map(|weight| weight * gain).collect();
            Parameter::from_rows_of_outputs(&scaled, network.inputs(), network.outputs())
        });
        let mut layers = network.layers.clone();
        if let Some(last) = layers.last_mut() {
            last.weights.iter_mut().chain(&mut last.bias).for_each(|value| *value *= gain);
        }
        let batch = settings.batch.min(training.rows());
        let mut trainer = Self {
            settings: TrainingSettings { batch, ..settings.clone() },
            frame: network.clone(),
            engine: Backpropagation::new(network.inputs(), &layers, skip, batch),
            targets: PaddedMatrix::zeros(batch, network.outputs()),
            row_weights: Vec::with_capacity(batch),
            output_weights: match settings.output_weights.is_empty() {
                true => vec![1.0; network.outputs()],
                false => settings.output_weights.clone(),
            },
            gain,
            order: (0..training.rows()).collect(),
            generator: Xoshiro256PlusPlus::seed_from_u64(settings.seed),
            steps: 0,
            powers: (1.0, 1.0),
            training,
        };
        trainer.imitate_quantisation();
        Ok(trainer)
    }

    /// Calibrates the ranges of the layers' inputs on the training data and rounds from now on, if the settings ask for it.
    fn imitate_quantisation(&mut self) {
        let Some(quantisation) = self.settings.quantisation else {
            return;
        };
        let mut largest = vec![0.0; self.engine.layers.len()];
        for first in (0..self.training.rows()).step_by(self.settings.batch) {
            let rows = self.load(first);
            self.engine.forward(rows);
            self.engine.raise_to_largest_inputs(rows, &mut largest);
        }
        let ranges = |bits| largest.iter().map(|largest| activation_range(*largest, bits)).collect();
        self.engine.quantise(quantisation.activation_bits.map(ranges));
    }

    /// Copies the rows `order[first..]` into the batch; returns how many there were.
    fn load(&mut self, first: usize) -> usize {
        let last = (first + self.settings.batch).min(self.order.len());
        self.row_weights.clear();
        for (slot, row) in self.order[first..last].iter().enumerate() {
            self.engine.inputs.copy_row(slot, &self.training.inputs, *row);
            self.targets.copy_row(slot, &self.training.targets, *row);
            self.row_weights.push(self.training.row_weights[*row]);
        }
        last - first
    }

    /// The loss as the engine sees it: errors are multiplied by the gain.
    fn scaled_loss(&self) -> Loss {
        match self.settings.loss {
            Loss::MeanSquare => Loss::MeanSquare,
            Loss::Huber { delta } => Loss::Huber { delta: delta * self.gain },
        }
    }

    /// The factor from a sum of scaled losses over rows to the mean loss.
    fn mean_factor(&self, rows: usize) -> f64 {
        1.0 / ((rows * self.output_weights.len()) as f64 * f64::from(self.gain).powi(2))
    }

    /// One step on the rows `order[first..]`: forward, backward, Adam. Returns the sum of the scaled losses.
    fn step_from(&mut self, first: usize) -> f64 {
        let total = self.gradient_from(first);
        let settings = &self.settings;
        let steps_per_epoch = self.order.len().div_ceil(settings.batch);
        let rate = settings.learning_rate_at(self.steps, steps_per_epoch);
        self.powers.0 *= settings.beta1;
        self.powers.1 *= settings.beta2;
        self.steps += 1;
        let gradient_factor = settings.gradient_clip.map_or(1.0, |clip| (clip / self.engine.gradient_norm()).min(1.0));
        self.engine.update(AdamFactors {
            beta1: settings.beta1 as f32,
            beta2: settings.beta2 as f32,
            rate: (rate / (1.0 - self.powers.0)) as f32,
            root_correction: (1.0 / (1.0 - self.powers.1)).sqrt() as f32,
            epsilon: settings.epsilon as f32,
            shrink: (1.0 - rate * settings.weight_decay) as f32,
            gradient_factor: gradient_factor as f32,
        });
        total
    }

    fn gradient_from(&mut self, first: usize) -> f64 {
        let rows = self.load(first);
        let loss = self.scaled_loss();
        let factor = 1.0 / (rows * self.output_weights.len()) as f32;
        let output = self.engine.forward(rows);
        let total = loss.replace_by_gradient(output, &self.targets, &self.row_weights, &self.output_weights, factor);
        self.engine.backward(rows);
        total
    }

    /// One step on the first batch of the present order; returns the batch's mean loss before the step.
    pub fn step(&mut self) -> f64 {
        let total = self.step_from(0);
        total * self.mean_factor(self.settings.batch)
    }

    /// One pass over the rows in a new random order; returns the mean loss on the way.
    pub fn epoch(&mut self) -> f64 {
        self.order.shuffle(&mut self.generator);
        let starts = (0..self.order.len()).step_by(self.settings.batch);
        let total: f64 = starts.map(|first| self.step_from(first)).sum();
        total * self.mean_factor(self.order.len())
    }

    /// The mean loss over other rows, with quantisation imitated if the settings say so.
    pub fn loss(&mut self, data: &Dataset) -> Result<f64, TrainingError> {
        check_columns(&self.frame, data)?;
        Ok(self.loss_of(&self.standardise(data)))
    }

    pub(super) fn standardise(&self, data: &Dataset) -> StandardisedSet {
        let mut set = StandardisedSet::new(&self.frame, data, self.settings.skip != Skip::Joint);
        set.multiply_targets(self.gain);
        set
    }

    pub(super) fn loss_of(&mut self, set: &StandardisedSet) -> f64 {
        let (loss, batch) = (self.scaled_loss(), self.settings.batch);
        let mut total = 0.0;
        for first in (0..set.rows()).step_by(batch) {
            let rows = batch.min(set.rows() - first);
            for slot in 0..rows {
                self.engine.inputs.copy_row(slot, &set.inputs, first + slot);
                self.targets.copy_row(slot, &set.targets, first + slot);
            }
            let row_weights = &set.row_weights[first..first + rows];
            let output = self.engine.forward(rows);
            total += loss.replace_by_gradient(output, &self.targets, row_weights, &self.output_weights, 0.0);
        }
        total * self.mean_factor(set.rows())
    }

    pub(super) fn store_values(&self, kept: &mut Vec<PaddedMatrix>) {
        self.engine.store_values(kept);
    }

    pub(super) fn restore_values(&mut self, kept: Vec<PaddedMatrix>) {
        self.engine.restore_values(kept);
    }

    /// The network as trained so far, its weights in f32 and not rounded.
    pub fn network(&self) -> FloatNetwork {
        let mut network = self.frame.clone();
        for (layer, trained) in network.layers.iter_mut().zip(&self.engine.layers) {
            layer.weights = trained.weights.to_rows_of_outputs();
            layer.bias = trained.bias.value.row(0).to_vec();
        }
        let divide = |values: &mut Vec<f32>| values.iter_mut().for_each(|value| *value /= self.gain);
        if let Some(last) = network.layers.last_mut() {
            divide(&mut last.weights);
            divide(&mut last.bias);
        }
        if let Some(skip) = &self.engine.skip {
            let mut weights = skip.to_rows_of_outputs();
            divide(&mut weights);
            network.skip = Some(weights);
        }
        network
    }
}

/// Whether the data has the network's columns.
pub(super) fn check_columns(network: &FloatNetwork, data: &Dataset) -> Result<(), TrainingError> {
    let pairs = [("inputs", data.inputs().columns(), network.inputs()), ("labels", data.labels().columns(), network.outputs())];
    match pairs.into_iter().find(|(_, found, expected)| found != expected) {
        Some((what, found, expected)) => Err(TrainingError::Columns { what, found, expected }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod gradient_check;
