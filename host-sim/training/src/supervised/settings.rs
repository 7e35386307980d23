//! Settings of the training with their defaults.

use impromptu_firmware::model::{MAX_LAYERS, MAX_WIDTH};
use impromptu_model_export::float_network::Activation;
use serde::{Deserialize, Serialize};

/// Everything that decides a training, besides the data. The same settings and data give the same bytes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrainingSettings {
    /// Widths of the hidden layers; default 64, 64, the size which a pilot found sufficient beside a skip.
    pub hidden: Vec<usize>,
    /// Of the hidden layers; default tanh. The last layer is linear.
    pub activation: Activation,
    /// The linear part beside the network; default frozen.
    pub skip: Skip,
    /// Penalty of the ridge regression that the skip starts from; default 1e-6 (see [`Ridge::fit`](super::Ridge::fit)).
    pub ridge_penalty: f64,
    /// Factor on the initial weights of the last layer; default 0.1, so that the network starts near the skip alone.
    pub initial_output_gain: f32,
    /// What is minimised; default the mean square.
    pub loss: Loss,
    /// Weight of each output in the loss; default empty: all 1.
    pub output_weights: Vec<f32>,
    /// Passes over the data; default 200.
    pub epochs: usize,
    /// Rows of a step; default 256.
    pub batch: usize,
    /// Of Adam, at the start; default 1e-3.
    pub learning_rate: f64,
    /// How the learning rate falls; default cosine to 1 %.
    pub schedule: Schedule,
    /// Adam's decay of the gradient's mean; default 0.9.
    pub beta1: f64,
    /// Adam's decay of the squared gradient's mean; default 0.999.
    pub beta2: f64,
    /// Adam's smallest divisor; default 1e-8.
    pub epsilon: f64,
    /// Decoupled decay of the weights (not of biases) per unit of learning rate; default 0.
    pub weight_decay: f64,
    /// Largest norm of the whole gradient; default none.
    pub gradient_clip: Option<f64>,
    /// Epochs without a better validation loss after which training ends; default none: all epochs. The best weights
    /// are kept either way.
    pub patience: Option<usize>,
    /// Of the initial weights and of the order of rows; default 1.
    pub seed: u64,
    /// Rounding that the forward pass imitates; default none.
    pub quantisation: Option<FakeQuantisation>,
}

impl Default for TrainingSettings {
    fn default() -> Self {
        Self {
            hidden: vec![64, 64],
            activation: Activation::Tanh,
            skip: Skip::Frozen,
            ridge_penalty: 1e-6,
            initial_output_gain: 0.1,
            loss: Loss::MeanSquare,
            output_weights: Vec::new(),
            epochs: 200,
            batch: 256,
            learning_rate: 1e-3,
            schedule: Schedule::Cosine { final_fraction: 0.01 },
            beta1: 0.9,
            beta2: 0.999,
            epsilon: 1e-8,
            weight_decay: 0.0,
            gradient_clip: None,
            patience: None,
            seed: 1,
            quantisation: None,
        }
    }
}

/// The linear map from inputs to outputs beside the layers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Skip {
    /// None in a new network. A network that has one keeps it as it is.
    Absent,
    /// The ridge solution, unchanged: the layers learn what it leaves.
    Frozen,
    /// The ridge solution at the start, then trained with the layers.
    Joint,
}

/// The loss of one normalised output error e; the total is the mean over rows and outputs, weighted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Loss {
    /// e²
    MeanSquare,
    /// e² up to |e| = delta, 2 delta |e| - delta² beyond (Huber, 1964): outliers pull less.
    Huber {
        /// In standard deviations of the label.
        delta: f32,
    },
}

/// The learning rate over the training.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Schedule {
    /// Always the same.
    Constant,
    /// Half a cosine from the initial rate down to this fraction of it, step by step.
    Cosine {
        /// Of the initial rate.
        final_fraction: f64,
    },
    /// Multiplied by `factor` after every `epochs` epochs.
    Step {
        /// Epochs between two changes.
        epochs: usize,
        /// Of each change.
        factor: f64,
    },
}

/// Rounding in the forward pass, with a straight-through gradient (Bengio, Léonard and Courville, 2013; Jacob et al.,
/// CVPR 2018): weights to int8 with one scale for each output row, biases and skip not at all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FakeQuantisation {
    /// Bits of the values that enter each layer, sign included, 2 to 24; default 16, none leaves them in f32. Each layer
    /// has one scale, such that the largest value in the training data is the largest number.
    pub activation_bits: Option<u32>,
}

impl Default for FakeQuantisation {
    fn default() -> Self {
        Self { activation_bits: Some(16) }
    }
}

/// Days of training.
const MOST_EPOCHS: usize = 100_000;

/// Why settings cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("training setting `{field}` is {found}; {expected}")]
pub struct SettingsError {
    /// The field's name.
    pub field: &'static str,
    /// Its value.
    pub found: String,
    /// What it should be.
    pub expected: &'static str,
}

impl TrainingSettings {
    /// Whether each setting is in its range.
    pub fn check(&self, outputs: usize) -> Result<(), SettingsError> {
        let final_fraction = match self.schedule {
            Schedule::Constant => 1.0,
            Schedule::Cosine { final_fraction } => final_fraction,
            Schedule::Step { factor, epochs } => {
                if epochs > 0 {
                    factor
                } else {
                    -1.0
                }
            }
        };
        let delta = if let Loss::Huber { delta } = self.loss { delta } else { 1.0 };
        let weights_fit = self.output_weights.is_empty() || self.output_weights.len() == outputs;
        let weights_usable = self.output_weights.iter().all(|weight| (0.0..=1e6).contains(weight));
        let bits = self.quantisation.and_then(|quantisation| quantisation.activation_bits);
        let text = |value: &dyn std::fmt::Debug| format!("{value:?}");
        let fraction = |value: f64| (0.0..1.0).contains(&value);
        let hidden = self.hidden.len() < MAX_LAYERS && self.hidden.iter().all(|width| (1..=MAX_WIDTH).contains(width));
        let rules: [(bool, &'static str, &dyn std::fmt::Debug, &'static str); 15] = [
            (hidden, "hidden", &self.hidden, "use at most 5 layers of 1 to 256, which is what the firmware holds"),
            (self.epochs <= MOST_EPOCHS, "epochs", &self.epochs, "use 0 to 100000"),
            ((0.0..=1e6).contains(&self.ridge_penalty), "ridge_penalty", &self.ridge_penalty, "use 0 to 1e6"),
            (self.initial_output_gain.abs() <= 1e3, "initial_output_gain", &self.initial_output_gain, "use -1000 to 1000"),
            (delta > 0.0 && delta <= 1e6, "loss.huber.delta", &delta, "use more than 0, up to 1e6"),
            (weights_fit && weights_usable, "output_weights", &self.output_weights, "use none, or one per output, 0 to 1e6"),
            ((1..=1_000_000).contains(&self.batch), "batch", &self.batch, "use 1 to 1000000"),
            (
                self.learning_rate > 0.0 && self.learning_rate <= 10.0,
                "learning_rate",
                &self.learning_rate,
                "use more than 0, up to 10",
            ),
            ((0.0..=1.0).contains(&final_fraction), "schedule", &self.schedule, "fractions are 0 to 1, epochs at least 1"),
            (fraction(self.beta1), "beta1", &self.beta1, "use 0 to below 1"),
            (fraction(self.beta2), "beta2", &self.beta2, "use 0 to below 1"),
            (self.epsilon > 0.0 && self.epsilon <= 1.0, "epsilon", &self.epsilon, "use more than 0, up to 1"),
            ((0.0..=1e3).contains(&self.weight_decay), "weight_decay", &self.weight_decay, "use 0 to 1000"),
            (self.gradient_clip.is_none_or(|clip| clip > 0.0), "gradient_clip", &self.gradient_clip, "use more than zero"),
            (bits.is_none_or(|bits| (2..=24).contains(&bits)), "quantisation.activation_bits", &bits, "use 2 to 24"),
        ];
        match rules.iter().find(|(fits, ..)| !fits) {
            Some((_, field, found, expected)) => Err(SettingsError { field, found: text(found), expected }),
            None => Ok(()),
        }
    }

    /// The learning rate at a step, `steps_per_epoch` steps being one epoch.
    pub(super) fn learning_rate_at(&self, step: usize, steps_per_epoch: usize) -> f64 {
        let factor = match self.schedule {
            Schedule::Constant => 1.0,
            Schedule::Cosine { final_fraction } => {
                let steps = (self.epochs * steps_per_epoch).max(2) - 1;
                let angle = std::f64::consts::PI * (step.min(steps) as f64 / steps as f64);
                // nalgebra's cosine is libm's on every machine, unlike the standard library's.
                final_fraction + (1.0 - final_fraction) * 0.5 * (1.0 + nalgebra::ComplexField::cos(angle))
            }
            Schedule::Step { epochs, factor } => (0..step / (epochs * steps_per_epoch)).fold(1.0, |rate, _| rate * factor),
        };
        self.learning_rate * factor
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schedules_start_at_the_rate_and_fall() {
        let rate = |schedule, step| TrainingSettings { schedule, epochs: 10, ..Default::default() }.learning_rate_at(step, 5);
        let cosine = Schedule::Cosine { final_fraction: 0.1 };
        assert_eq!(rate(cosine, 0), 1e-3);
        assert!((rate(cosine, 49) - 1e-4).abs() < 1e-12 && rate(cosine, 20) > rate(cosine, 30));
        let step = Schedule::Step { epochs: 4, factor: 0.5 };
        assert_eq!([rate(step, 19), rate(step, 20), rate(step, 40)], [1e-3, 5e-4, 2.5e-4]);
        assert_eq!(rate(Schedule::Constant, 49), 1e-3);
    }

    #[test]
    fn refuses_by_field_name() {
        let settings = TrainingSettings { beta2: 1.0, ..Default::default() };
        assert_eq!(settings.check(1).unwrap_err().to_string(), "training setting `beta2` is 1.0; use 0 to below 1");
        let settings = TrainingSettings { output_weights: vec![1.0], ..Default::default() };
        assert!(settings.check(1).is_ok() && settings.check(2).unwrap_err().field == "output_weights");
        assert!(toml::from_str::<TrainingSettings>("epoch = 3").unwrap_err().to_string().contains("epoch"));
        let text = toml::to_string(&TrainingSettings::default()).unwrap();
        assert_eq!(toml::from_str::<TrainingSettings>(&text).unwrap(), TrainingSettings::default());
    }
}
