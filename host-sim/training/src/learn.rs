//! From logs to networks: ridge regression, the network that refines it, the same fine-tuned for int8.
//!
//! *in* settings, logs of the baseline; *out* networks, and what a description needs of their rows; *never* a row of a log that
//! is held out; *source* Zhou 2017, section III-A.

use impromptu_flight::quadrotor::REFERENCE;
use impromptu_model_export::{Batch, Description, ExportError, FloatNetwork, Precision, encode};
use impromptu_sim::flight_log::FlightLog;

use crate::{
    breakdown::{Breakdown, sound},
    bypass::Bypass,
    examples::{ExampleSettings, Labels},
    hold_out::split,
    recipe::Recipe,
    supervised::{Dataset, DatasetError, Progress, Ridge, RidgeError, TrainingError, TrainingSettings, fine_tune, train},
    turned::quarter_turns,
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
    /// Too few rows for what shall be learned from them.
    #[error(
        "{found} rows to train on and {held_out} held out are too few for {features} features and {parameters} parameters: \
         {needed} and {needed_held_out} are needed; log about {seconds:.0} s more, or train a smaller network on fewer features"
    )]
    FewRows {
        /// Rows to train on.
        found: usize,
        /// Rows held out.
        held_out: usize,
        /// Inputs of the network.
        features: usize,
        /// Weights and biases of the network.
        parameters: usize,
        /// Rows to train on that are needed.
        needed: usize,
        /// Rows held out that are needed.
        needed_held_out: usize,
        /// Further flight that gives what is missing, s.
        seconds: f64,
    },
    /// Too few logs.
    #[error("at least two logs in which the loop did not break down are needed: one is kept to decide when to stop training")]
    OneLog,
}

/// What is learned from logs, and how.
#[derive(Clone, Debug)]
pub struct LearnSettings {
    /// Features, networks and how they are trained, with the seed in them.
    pub recipe: Recipe,
    /// Seed of everything random.
    pub seed: u64,
    /// Corrections or whole references.
    pub labels: Labels,
    /// Number format of the model file: with float nothing is fine-tuned.
    pub precision: Precision,
    /// Whether logs in which the loop broke down are used as well.
    pub keep_broken: bool,
    /// Whether fewer rows than [`LearnError::FewRows`] asks for are enough.
    pub keep_few: bool,
    /// Age of the logged measurements, s.
    pub measurement_delay_s: f64,
    /// Zero-phase smoothing of the logs, s.
    pub smoothing_s: f64,
}

impl LearnSettings {
    /// Corrections for an int8 model, from sound logs without noise of measurements without delay.
    pub fn new(recipe: &Recipe, seed: u64) -> Self {
        let mut recipe = recipe.clone();
        (recipe.network.seed, recipe.fine_tuning.seed) = (seed, seed);
        Self {
            recipe,
            seed,
            labels: Labels::Corrections,
            precision: Precision::Int8,
            keep_broken: false,
            keep_few: true,
            measurement_delay_s: 0.0,
            smoothing_s: 0.0,
        }
    }
}

/// What was learned from a set of logs.
#[derive(Clone, Debug)]
pub struct Learned {
    /// Corrections or whole references.
    pub labels: Labels,
    /// Ridge regression: a network that is all skip.
    pub ridge: FloatNetwork,
    /// Skip and layers, f32.
    pub network: FloatNetwork,
    /// What the model file holds: for int8 the network after fine-tuning with its weights imitated, or the network itself.
    pub exported: FloatNetwork,
    /// Number format of the model file.
    pub precision: Precision,
    /// What a description needs of the training rows.
    pub rows: Rows,
    /// Rows held out.
    pub held_out: usize,
    /// Coefficient of determination R² of the network over the position labels of the logs held out.
    pub determination: f64,
    /// Logs that were left out.
    pub broken: Vec<Breakdown>,
}

impl Learned {
    /// The model file of a description.
    ///
    /// # Errors
    /// If it cannot be encoded.
    pub fn encode(&self, description: &Description) -> Result<Vec<u8>, ExportError> {
        self.encode_as(description, &self.exported, self.precision, self.labels.bypass())
    }

    /// The same of another network on these rows, or with other inputs past it.
    ///
    /// # Errors
    /// If it cannot be encoded.
    pub fn encode_as(
        &self,
        description: &Description,
        network: &FloatNetwork,
        precision: Precision,
        bypass: Option<Bypass>,
    ) -> Result<Vec<u8>, ExportError> {
        let Some(bypass) = bypass else {
            return encode(description, Some(network), precision, &self.rows.calibration);
        };
        let (description, network, calibration) = bypass.added(description, network, &self.rows.calibration);
        encode(&description, Some(&network), precision, &calibration)
    }
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
    /// Number of rows that were flown, each counted once.
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

/// Learns from logs of the baseline, some of which are held out to decide when a training has been long enough. `judge` chooses
/// between the recipe's candidates, which should be done in flight; without it the logs held out decide by rows.
///
/// # Errors
/// If the logs hold too little or the training fails.
pub fn learn(
    settings: &LearnSettings,
    logs: &[FlightLog],
    judge: Option<&Judge<'_>>,
    progress: &mut dyn FnMut(Progress),
) -> Result<Learned, LearnError> {
    let recipe = &settings.recipe;
    let (logs, broken) = if settings.keep_broken { (logs.iter().collect(), Vec::new()) } else { sound(logs) };
    if logs.len() < 2 {
        return Err(LearnError::OneLog);
    }
    let LearnSettings { labels, precision, measurement_delay_s, smoothing_s, .. } = *settings;
    let examples = |logs: &[&FlightLog]| {
        let settings = ExampleSettings { measurement_delay_s, smoothing_s, divisor: recipe.divisor, stride: recipe.stride };
        labels.examples(logs, &recipe.features(), &settings)
    };
    let (training_logs, held_out) = split(&logs);
    let (mut training, validation) = (examples(&training_logs)?, examples(&held_out)?);
    let flown = training.rows();
    if !settings.keep_few
        && let Some(few) = few_rows(recipe, flown, validation.rows(), logs[0].rate_hz)
    {
        return Err(few);
    }
    let mut ridge = Ridge::fit(&training, recipe.ridge_penalty)?.to_network();
    if recipe.turned {
        let turns: Vec<FlightLog> = training_logs.iter().flat_map(|log| quarter_turns(log)).collect();
        let with_turns = examples(&training_logs.iter().copied().chain(&turns).collect::<Vec<_>>())?;
        let ridges = [ridge, Ridge::fit(&with_turns, recipe.ridge_penalty)?.to_network()];
        // A vehicle that does not answer alike along x and y is answered worse with turns.
        let better = best_on_rows(&ridges, &validation);
        if better == 1 {
            training = with_turns;
        }
        let [plain, turned] = ridges;
        ridge = if better == 1 { turned } else { plain };
    }
    let rows = Rows { count: flown, ..Rows::of(&training) };
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
    // The exporter rounds with the error of one weight made good by the others, which training cannot imitate: whether the
    // fine-tuning helps is seen in flight.
    let exported = match precision {
        Precision::Float => network.clone(),
        Precision::Int8 | Precision::Int16 => {
            let tuned = fine_tune(&network, &recipe.fine_tuning, &training, &validation, progress)?.network;
            choose(vec![network.clone(), tuned], precision)?
        }
    };
    let determination = determination(&network, &validation);
    let held_out = validation.rows();
    Ok(Learned { labels, ridge, network, exported, precision, rows, held_out, determination, broken })
}

/// Rows for each coefficient of the linear map: with fewer its noise is that of the rows.
const ROWS_A_COEFFICIENT: usize = 10;

/// Whether a training set is too small: for each coefficient of the linear map ten rows, for each weight of the network a label,
/// and held out as many rows as the linear map has coefficients.
pub fn few_rows(recipe: &Recipe, found: usize, held_out: usize, rate_hz: f64) -> Option<LearnError> {
    let features = recipe.features().len();
    let widths: Vec<usize> = [features].into_iter().chain(recipe.network.hidden.iter().copied()).chain([REFERENCE]).collect();
    let parameters = widths.windows(2).map(|pair| (pair[0] + 1) * pair[1]).sum::<usize>();
    let (needed, needed_held_out) = ((ROWS_A_COEFFICIENT * (features + 1)).max(parameters.div_ceil(REFERENCE)), features + 1);
    let missing = needed.saturating_sub(found) + needed_held_out.saturating_sub(held_out);
    (missing > 0).then(|| LearnError::FewRows {
        found,
        held_out,
        features,
        parameters,
        needed,
        needed_held_out,
        seconds: (missing * recipe.stride) as f64 / rate_hz,
    })
}

/// R² over the position labels.
fn determination(network: &FloatNetwork, data: &Dataset) -> f64 {
    let (mut left, mut sum, mut squares) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    for (input, label) in data.inputs().iter().zip(data.labels().iter()) {
        let found = network.evaluate(input);
        for axis in 0..3 {
            let label = f64::from(label[axis]);
            left[axis] += (f64::from(found[axis]) - label).powi(2);
            sum[axis] += label;
            squares[axis] += label * label;
        }
    }
    let rows = data.rows() as f64;
    let total: f64 = (0..3).map(|axis| squares[axis] - sum[axis] * sum[axis] / rows).sum();
    1.0 - left.iter().sum::<f64>() / total
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
