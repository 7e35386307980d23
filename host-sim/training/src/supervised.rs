//! Training from rows of inputs and labels: ridge regression in closed form, and networks that refine it.
//!
//! ```text
//! Dataset ──► Ridge::fit ──► skip ──► train (mini-batch Adam) ──► fine_tune (int8 weights imitated) ──► FloatNetwork
//! ```
//!
//! A training runs on one thread; several may run side by side. The same data, settings and seed give the same network, bit
//! for bit, on x86-64 processors with AVX2 or more and, much slower, without: see [`matrix_kernel`]. Only the ridge solution
//! may differ in its last bits between processors of different kinds.

mod backpropagation;
pub mod dataset;
mod elementwise;
mod error;
mod loss;
pub mod quantisation;
pub mod ridge;
pub mod settings;
mod standardised;
pub mod trainer;

pub use dataset::{Dataset, DatasetError, RowMatrix};
pub use error::TrainingError;
pub use impromptu_model_export::batch::{matrix_kernel, padded_matrix};
pub use ridge::{Ridge, RidgeError};
pub use settings::{FakeQuantisation, Loss, Schedule, SettingsError, Skip, TrainingSettings};
pub use trainer::NetworkTrainer;

use impromptu_model_export::float_network::{Activation, DenseLayer, FloatNetwork};
use rand::SeedableRng;
use rand_distr::{Distribution, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;
use standardised::StandardisedSet;

/// What a training reports after each epoch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Counted from 1; 0 is the state before the first epoch.
    pub epoch: usize,
    /// Epochs that the settings ask for.
    pub of: usize,
    /// Mean loss over the epoch's steps; before the first epoch that of the validation set.
    pub training_loss: f64,
    /// Mean loss on the validation set, in squared standard deviations of the labels.
    pub validation_loss: f64,
}

/// What came out of a training.
#[derive(Debug, Clone, PartialEq)]
pub struct Training {
    /// The weights with the least validation loss.
    pub network: FloatNetwork,
    /// One entry for each epoch, the first before any step.
    pub history: Vec<Progress>,
    /// The entry of `history` whose weights were kept.
    pub best: usize,
}

/// Trains a new network.
///
/// Inputs and labels are normalised with the moments of the training set; the validation set decides which epoch's weights
/// are kept and, with [`TrainingSettings::patience`], when to stop.
pub fn train(
    settings: &TrainingSettings,
    training: &Dataset,
    validation: &Dataset,
    progress: &mut dyn FnMut(Progress),
) -> Result<Training, TrainingError> {
    settings.check(training.labels().columns())?;
    let ridge = Ridge::fit(training, settings.ridge_penalty.max(f64::MIN_POSITIVE))?;
    let mut network = ridge.to_network();
    if settings.skip == Skip::Absent {
        network.skip = None;
    }
    let gain = StandardisedSet::new(&network, training, true).gain();
    network.layers = initial_layers(network.inputs(), network.outputs(), settings, gain);
    fine_tune(&network, settings, training, validation, progress)
}

/// Continues the training of a network, for instance with quantisation imitated; see [`NetworkTrainer::new`].
///
/// The weights at the start are a candidate too: on the validation set the result is never worse than they are.
pub fn fine_tune(
    network: &FloatNetwork,
    settings: &TrainingSettings,
    training: &Dataset,
    validation: &Dataset,
    progress: &mut dyn FnMut(Progress),
) -> Result<Training, TrainingError> {
    let mut trainer = NetworkTrainer::new(network, settings, training)?;
    trainer::check_columns(network, validation)?;
    let validation = trainer.standardise(validation);
    let (mut history, mut best, mut kept): (Vec<Progress>, usize, Vec<_>) = (Vec::new(), 0, Vec::new());
    for epoch in 0..=settings.epochs {
        let trained = (epoch > 0).then(|| trainer.epoch());
        let validation_loss = trainer.loss_of(&validation);
        let training_loss = trained.unwrap_or(validation_loss);
        if !(training_loss.is_finite() && validation_loss.is_finite()) {
            return Err(TrainingError::Diverged { epoch });
        }
        let record = Progress { epoch, of: settings.epochs, training_loss, validation_loss };
        progress(record);
        history.push(record);
        if epoch == 0 || validation_loss < history[best].validation_loss {
            best = epoch;
            trainer.store_values(&mut kept);
        }
        if settings.patience.is_some_and(|patience| epoch - best >= patience.max(1)) {
            break;
        }
    }
    trainer.restore_values(kept);
    Ok(Training { network: trainer.network(), history, best })
}

/// Uniform weights, for ReLU of variance 2 / inputs (He et al., ICCV 2015), else 2 / (inputs + outputs) (Glorot and Bengio,
/// AISTATS 2010); biases zero.
fn initial_layers(inputs: usize, outputs: usize, settings: &TrainingSettings, gain: f32) -> Vec<DenseLayer> {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(settings.seed);
    let hidden = settings.hidden.iter().map(|width| (*width, settings.activation, 1.0));
    let last = (outputs, Activation::Linear, settings.initial_output_gain / gain);
    let mut width = inputs;
    hidden
        .chain(std::iter::once(last))
        .map(|(outputs, activation, factor)| {
            let variance = match activation {
                Activation::Relu => 2.0 / width as f32,
                Activation::Tanh | Activation::Linear => 2.0 / (width + outputs) as f32,
            };
            let limit = (3.0 * variance).sqrt();
            let uniform = Uniform::new_inclusive(-limit, limit).expect("the limit is positive and finite");
            let weights = (0..width * outputs).map(|_| factor * uniform.sample(&mut generator)).collect();
            width = outputs;
            DenseLayer { weights, bias: vec![0.0; outputs], activation }
        })
        .collect()
}

#[cfg(test)]
mod tests;
