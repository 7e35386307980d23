//! From logs to networks: ridge regression, the network that refines it, the same fine-tuned for int8.

use impromptu_firmware::quadrotor::REFERENCE;
use impromptu_model_export::FloatNetwork;

use super::recipe::Recipe;
use crate::{
    examples::{ExampleSettings, examples},
    flight_log::FlightLog,
    training::{Dataset, DatasetError, Progress, Ridge, RidgeError, TrainingError, fine_tune, train},
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
    /// Too few logs.
    #[error("at least two logs are needed: one is kept to decide when to stop training")]
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
    /// Rows of features for calibration and probes.
    pub calibration: Vec<Vec<f32>>,
    /// Smallest and largest value of each feature.
    pub envelope: Vec<(f32, f32)>,
    /// Largest magnitude of each label.
    pub label_range: [f32; REFERENCE],
    /// CRC-32 of all rows.
    pub data_crc: u32,
    /// Number of rows.
    pub rows: usize,
}

/// Rows of calibration that are kept.
const CALIBRATION_ROWS: usize = 512;

/// Learns from logs of the baseline; every fourth log is kept for validation.
///
/// # Errors
/// If the logs hold too little or the training fails.
pub fn learn(
    recipe: &Recipe,
    logs: &[FlightLog],
    measurement_delay_s: f64,
    smoothing_s: f64,
    progress: &mut dyn FnMut(Progress),
) -> Result<Learned, LearnError> {
    if logs.len() < 2 {
        return Err(LearnError::OneLog);
    }
    let settings = ExampleSettings { measurement_delay_s, smoothing_s, divisor: recipe.divisor, stride: recipe.stride };
    let features = recipe.features();
    let held = |index: usize| index % 4 == 3 || (logs.len() < 4 && index + 1 == logs.len());
    let pick = |wanted: bool| -> Vec<&FlightLog> {
        logs.iter().enumerate().filter(|(index, _)| held(*index) == wanted).map(|(_, log)| log).collect()
    };
    let training = examples(&pick(false), &features, &settings)?;
    let validation = examples(&pick(true), &features, &settings)?;
    let ridge = Ridge::fit(&training, recipe.ridge_penalty)?.to_network();
    let network = train(&recipe.network, &training, &validation, progress)?.network;
    let quantised = fine_tune(&network, &recipe.fine_tuning, &training, &validation, progress)?.network;
    Ok(Learned {
        ridge,
        network,
        quantised,
        calibration: calibration(&training),
        envelope: envelope(&training),
        label_range: label_range(&training),
        data_crc: data_crc(&training),
        rows: training.rows(),
    })
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
