//! From logs to networks: ridge regression, the network that refines it, the same fine-tuned for int8.

use impromptu_flight::quadrotor::REFERENCE;
use impromptu_model_export::{Batch, FloatNetwork, Precision};
use impromptu_sim::flight_log::FlightLog;

use crate::{
    breakdown::{Breakdown, sound},
    examples::{ExampleSettings, examples},
    recipe::Recipe,
    supervised::{Dataset, DatasetError, Progress, Ridge, RidgeError, TrainingError, TrainingSettings, fine_tune, train},
};

/// Why nothing was learned.
#[derive(Debug, thiserror::Error)]
pub enum LearnError {
    /// The logs hold no usable rows.
    #[error("logs: {0}")]
    Dataset(#[from] DatasetError),
    /// No linear solution.
    #[error("ridge regression: {0}")]
    Ridge(#[from] RidgeError),
    /// The training failed.
    #[error("network: {0}")]
    Training(#[from] TrainingError),
    /// The candidates could not be judged in flight.
    #[error("choosing the network in flight: {0}")]
    Judge(#[source] Box<dyn std::error::Error + Send + Sync>),
    /// The recipe asks for no network.
    #[error("recipe: `weight_decays` and `shares` name no candidate; give at least one of each")]
    NoCandidate,
    /// Too few logs.
    #[error("at least two logs in which the loop did not break down are needed: one is kept to decide when to stop training")]
    OneLog,
}

/// What was learned from a set of logs.
#[derive(Clone, Debug)]
pub struct Learned {
    /// Ridge regression: a network that is all skip.
    pub ridge: FloatNetwork,
    /// Skip and layers, f32.
    pub network: FloatNetwork,
    /// The same after fine-tuning with int8 weights imitated.
    pub quantised: FloatNetwork,
    /// What a description needs of the training rows.
    pub rows: Rows,
    /// Logs that were left out.
    pub broken: Vec<Breakdown>,
}

/// Rows of calibration that are kept.
const CALIBRATION_ROWS: usize = 512;

/// Networks to choose between, and the number format in which they shall fly.
#[derive(Clone, Copy, Debug)]
pub struct Candidates<'a> {
    /// The ridge regression, which is the bar.
    pub ridge: &'a FloatNetwork,
    /// The networks.
    pub networks: &'a [FloatNetwork],
    /// Number format of the networks' dense layers.
    pub precision: Precision,
}

/// A choice among networks: answers with the index of one, or why it cannot.
pub type Judge<'a> = dyn Fn(Candidates<'_>, &Rows) -> Result<usize, Box<dyn std::error::Error + Send + Sync>> + 'a;

/// What a description needs of the training rows.
#[derive(Clone, Debug)]
pub struct Rows {
    /// Rows of features for calibration and probes.
    pub calibration: Vec<Vec<f32>>,
    /// Smallest and largest value of each feature.
    pub envelope: Vec<(f32, f32)>,
    /// Largest magnitude of each label.
    pub label_range: [f32; REFERENCE],
    /// CRC-32 of all rows.
    pub data_crc: u32,
    /// Number of rows.
    pub count: usize,
}

impl Rows {
    /// Of a training set.
    pub fn of(training: &Dataset) -> Self {
        Self {
            calibration: calibration(training),
            envelope: envelope(training),
            label_range: label_range(training),
            data_crc: data_crc(training),
            count: training.rows(),
        }
    }
}

/// Learns from logs of the baseline; every fourth log is kept to decide when a training has been long enough. `judge` chooses between
/// the recipe's candidates, which should be done in flight; without it the kept logs decide by rows.
///
/// # Errors
/// If the logs hold too little or the training fails.
pub fn learn(
    recipe: &Recipe,
    logs: &[FlightLog],
    measurement_delay_s: f64,
    smoothing_s: f64,
    judge: Option<&Judge<'_>>,
    progress: &mut dyn FnMut(Progress),
) -> Result<Learned, LearnError> {
    let (logs, broken) = sound(logs);
    if logs.len() < 2 {
        return Err(LearnError::OneLog);
    }
    let settings = ExampleSettings { measurement_delay_s, smoothing_s, divisor: recipe.divisor, stride: recipe.stride };
    let features = recipe.features();
    let held = |index: usize| index % 4 == 3 || (logs.len() < 4 && index + 1 == logs.len());
    let pick = |wanted: bool| -> Vec<&FlightLog> {
        logs.iter().enumerate().filter(|(index, _)| held(*index) == wanted).map(|(_, log)| *log).collect()
    };
    let training = examples(&pick(false), &features, &settings)?;
    let validation = examples(&pick(true), &features, &settings)?;
    let rows = Rows::of(&training);
    let ridge = Ridge::fit(&training, recipe.ridge_penalty)?.to_network();
    let mut candidates = Vec::new();
    for &weight_decay in &recipe.weight_decays {
        let settings = TrainingSettings { weight_decay, ..recipe.network.clone() };
        let network = train(&settings, &training, &validation, progress)?.network;
        candidates.extend(recipe.shares.iter().map(|&share| shared(&network, share)));
    }
    let choose = |networks: Vec<FloatNetwork>, precision| {
        let index = match judge {
            Some(judge) => {
                judge(Candidates { ridge: &ridge, networks: &networks, precision }, &rows).map_err(LearnError::Judge)?
            }
            None => best_on_rows(&networks, &validation),
        };
        networks.into_iter().nth(index).ok_or(LearnError::NoCandidate)
    };
    let network = choose(candidates, Precision::Float)?;
    // The exporter rounds with the error of one weight made good by the others, which training cannot imitate: whether the fine-tuning
    // helps is seen in flight.
    let tuned = fine_tune(&network, &recipe.fine_tuning, &training, &validation, progress)?.network;
    let quantised = choose(vec![network.clone(), tuned], Precision::Int8)?;
    Ok(Learned { ridge, network, quantised, rows, broken })
}

/// The candidate with the least squared error on rows that it has not seen, each output by its own scale.
fn best_on_rows(candidates: &[FloatNetwork], data: &Dataset) -> usize {
    let loss = |network: &FloatNetwork| -> f64 {
        let mut sum = 0.0;
        Batch::of_network(network).evaluate(data.inputs().iter(), |row, found| {
            let errors = found.iter().zip(data.labels().row(row)).zip(&network.output_scale);
            sum += errors.map(|((found, label), scale)| f64::from((found - label) / scale).powi(2)).sum::<f64>();
        });
        sum
    };
    let losses = candidates.iter().map(loss).enumerate();
    losses.min_by(|(_, a), (_, b)| a.total_cmp(b)).map_or(0, |(index, _)| index)
}

/// The network with `share` of what its layers add to the skip.
fn shared(network: &FloatNetwork, share: f32) -> FloatNetwork {
    let mut network = network.clone();
    if let Some(last) = network.layers.last_mut() {
        last.weights.iter_mut().chain(&mut last.bias).for_each(|value| *value *= share);
    }
    network
}

fn calibration(data: &Dataset) -> Vec<Vec<f32>> {
    let step = (data.rows() / CALIBRATION_ROWS).max(1);
    data.inputs().iter().step_by(step).map(<[f32]>::to_vec).collect()
}

fn envelope(data: &Dataset) -> Vec<(f32, f32)> {
    let mut envelope = vec![(f32::INFINITY, f32::NEG_INFINITY); data.inputs().columns()];
    for row in data.inputs().iter() {
        for ((low, high), &value) in envelope.iter_mut().zip(row) {
            *low = low.min(value);
            *high = high.max(value);
        }
    }
    envelope
}

fn label_range(data: &Dataset) -> [f32; REFERENCE] {
    let mut range = [0.0f32; REFERENCE];
    for row in data.labels().iter() {
        for (range, value) in range.iter_mut().zip(row) {
            *range = range.max(value.abs());
        }
    }
    range
}

fn data_crc(data: &Dataset) -> u32 {
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let mut digest = crc.digest();
    for values in [data.inputs().values(), data.labels().values()] {
        for value in values {
            digest.update(&value.to_le_bytes());
        }
    }
    digest.finalize()
}
