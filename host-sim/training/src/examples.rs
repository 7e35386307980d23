//! Training examples from flight logs: what the loop was asked when it did what it did.
//!
//! *in* [`FlightLog`]s of the baseline; *out* rows of features and corrections; *never* another feature function than the
//! firmware's; *source* Zhou 2017, section III-A: the inverse is learned by putting the measured output in the place of the
//! desired one, so that the correction is reference minus output. What differs: late measurements are shifted back by the known
//! delay, and noisy logs are smoothed with zero phase, output and reference alike, which leaves a linear relation between them as
//! it is.

use impromptu_firmware::features::{self, Feature, Signals};
use impromptu_flight::quadrotor::{DESIRED, MEASURED, REFERENCE};
use impromptu_sim::flight_log::{BODY, FlightLog};

use crate::{
    bypass::Bypass,
    supervised::{Dataset, DatasetError, RowMatrix},
};

/// How examples are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExampleSettings {
    /// Age of the measurements in the log, s.
    pub measurement_delay_s: f64,
    /// Standard deviation of the zero-phase Gaussian smoothing, s; 0: none.
    pub smoothing_s: f64,
    /// Reference ticks in a sub-rate tick.
    pub divisor: u16,
    /// Every how many reference ticks a row is taken.
    pub stride: usize,
}

/// What a network shall answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Labels {
    /// Reference minus output, which is added to the desired state: difference learning.
    #[default]
    Corrections,
    /// Whole references.
    References,
}

impl Labels {
    /// What has to go past a network with these labels, as the adapter adds its outputs to the desired state.
    pub fn bypass(self) -> Option<Bypass> {
        match self {
            Self::Corrections => None,
            Self::References => Some(Bypass::Desired),
        }
    }

    /// Rows of features and these labels from `logs`.
    ///
    /// # Errors
    /// If the logs hold no usable row.
    pub fn examples(
        self,
        logs: &[&FlightLog],
        features: &[Feature],
        settings: &ExampleSettings,
    ) -> Result<Dataset, DatasetError> {
        match self {
            Self::Corrections => examples(logs, features, settings),
            // The outputs that corrections are differences to, as inputs for a moment.
            Self::References => {
                let features = [features, &Bypass::Desired.features()].concat();
                whole_references(&examples(logs, &features, settings)?)
            }
        }
    }
}

/// Rows whose labels are whole references: the last six inputs are the outputs that the labels were differences to.
fn whole_references(data: &Dataset) -> Result<Dataset, DatasetError> {
    let inputs = data.inputs().columns() - REFERENCE;
    let (mut without, mut labels) = (RowMatrix::new(inputs), RowMatrix::new(REFERENCE));
    for (input, label) in data.inputs().iter().zip(data.labels().iter()) {
        without.push(&input[..inputs]);
        let whole: Vec<f32> = label.iter().zip(&input[inputs..]).map(|(label, base)| label + base).collect();
        labels.push(&whole);
    }
    Dataset::new(without, labels)
}

/// A log as the feature function sees it in training: the output in the place of the desired trajectory.
struct Flown {
    /// Position, velocity, acceleration, yaw of the output at each reference tick.
    output: Vec<[f64; DESIRED]>,
    /// Angles, body rates, vertical acceleration as they were measured; zero where the log has none.
    body: Vec<[f64; BODY]>,
    /// Position and velocity reference.
    reference: Vec<[f64; REFERENCE]>,
}

impl Flown {
    fn at<const C: usize>(&self, rows: &[[f64; C]], tick: i32, channel: usize) -> f32 {
        let index = (tick.max(0) as usize).min(rows.len() - 1);
        rows[index].get(channel).map_or(0.0, |value| *value as f32)
    }
}

impl Signals for Flown {
    fn desired(&self, tick: i32, channel: usize) -> f32 {
        self.at(&self.output, tick, channel)
    }
    fn measured(&self, tick: i32, channel: usize) -> f32 {
        match channel.checked_sub(MEASURED - BODY) {
            None => self.at(&self.output, tick, channel),
            Some(channel) => self.at(&self.body, tick, channel),
        }
    }
    fn reference(&self, tick: i32, channel: usize) -> f32 {
        self.at(&self.reference, tick, channel)
    }
}

/// Corrections below this are not worth more than others, m.
const LEAST_CORRECTION: f64 = 0.02;

/// Every log counts by its relative error, as flights are judged: its rows weigh the reciprocal of its mean squared position
/// correction.
///
/// Rows of features and labels (position and velocity correction, m and m/s) from `logs`.
///
/// # Errors
/// If the logs hold no usable row.
pub fn examples(logs: &[&FlightLog], features: &[Feature], settings: &ExampleSettings) -> Result<Dataset, DatasetError> {
    let mut inputs = RowMatrix::new(features.len());
    let mut labels = RowMatrix::new(REFERENCE);
    let mut weights = Vec::new();
    let divisor = i32::from(settings.divisor);
    let reach = features.iter().map(|feature| i32::from(feature.offset) * divisor);
    let (past, future) = (-reach.clone().min().unwrap_or(0).min(0), reach.max().unwrap_or(0).max(0));
    let mut row = vec![0.0; features.len()];
    for log in logs {
        let flown = flown(log, settings);
        // The smoothing has no neighbours at the ends.
        let edge = (3.0 * settings.smoothing_s * log.rate_hz).ceil() as i32;
        let last = flown.output.len() as i32 - 1 - future - edge;
        let first_row = labels.rows();
        for tick in ((past + edge)..=last).step_by(settings.stride.max(1)) {
            let now = tick as usize;
            features::evaluate(features, &flown, tick, divisor, &mut row);
            inputs.push(&row);
            let label: [f32; REFERENCE] = std::array::from_fn(|i| (flown.reference[now][i] - flown.output[now][i]) as f32);
            labels.push(&label);
        }
        let rows = labels.rows() - first_row;
        let position = (first_row..labels.rows()).flat_map(|row| &labels.row(row)[..3]);
        let square = position.map(|value| f64::from(value * value)).sum::<f64>() / rows.max(1) as f64;
        weights.resize(labels.rows(), (1.0 / (square + LEAST_CORRECTION * LEAST_CORRECTION)) as f32);
    }
    Dataset::new(inputs, labels)?.with_row_weights(weights)
}

/// Output and reference of a log, in step with each other and smoothed.
fn flown(log: &FlightLog, settings: &ExampleSettings) -> Flown {
    let late = settings.measurement_delay_s * log.rate_hz;
    let last = log.rows.len() - 1;
    let mut output: Vec<[f64; DESIRED]> = (0..log.rows.len())
        .map(|tick| {
            // Received at tick + late: interpolate between the two rows around it.
            let at = (tick as f64 + late).min(last as f64);
            let (row, share) = (at as usize, at.fract());
            let next = (row + 1).min(last);
            let mut values = [0.0; DESIRED];
            for axis in 0..3 {
                let blend = |a: f64, b: f64| a + (b - a) * share;
                values[axis] = blend(log.rows[row].measured_position[axis], log.rows[next].measured_position[axis]);
                values[3 + axis] = blend(log.rows[row].measured_velocity[axis], log.rows[next].measured_velocity[axis]);
            }
            values[9] = log.rows[tick].desired.yaw;
            values
        })
        .collect();
    output.truncate((last as f64 - late).floor().max(1.0) as usize + 1);
    let mut reference: Vec<[f64; REFERENCE]> = log
        .rows
        .iter()
        .take(output.len())
        .map(|row| std::array::from_fn(|i| if i < 3 { row.reference_position[i] } else { row.reference_velocity[i - 3] }))
        .collect();
    let body = log.rows.iter().take(output.len()).map(|row| row.measured_body.unwrap_or_default()).collect::<Vec<_>>();
    let kernel = gaussian(settings.smoothing_s * log.rate_hz);
    output = smoothed(&output, &kernel);
    reference = smoothed(&reference, &kernel);
    let body = smoothed(&body, &kernel);
    for tick in 0..output.len() {
        let (before, after) = (tick.saturating_sub(1), (tick + 1).min(output.len() - 1));
        let step = (after - before).max(1) as f64 / log.rate_hz;
        for axis in 0..3 {
            output[tick][6 + axis] = (output[after][3 + axis] - output[before][3 + axis]) / step;
        }
    }
    Flown { output, body, reference }
}

/// Weights of a Gaussian of that many ticks of standard deviation, from its middle outwards; they sum to 1.
fn gaussian(sigma: f64) -> Vec<f64> {
    if sigma <= 0.0 {
        return vec![1.0];
    }
    let half: Vec<f64> = (0..=(3.0 * sigma).ceil() as usize).map(|k| (-0.5 * (k as f64 / sigma).powi(2)).exp()).collect();
    let sum = half[0] + 2.0 * half[1..].iter().sum::<f64>();
    half.into_iter().map(|weight| weight / sum).collect()
}

/// Symmetric convolution; the ends repeat.
fn smoothed<const C: usize>(rows: &[[f64; C]], half: &[f64]) -> Vec<[f64; C]> {
    let last = rows.len() - 1;
    (0..rows.len())
        .map(|tick| {
            let mut sum = rows[tick].map(|value| value * half[0]);
            for (k, weight) in half.iter().enumerate().skip(1) {
                let (before, after) = (&rows[tick.saturating_sub(k)], &rows[(tick + k).min(last)]);
                for (channel, sum) in sum.iter_mut().enumerate() {
                    *sum += weight * (before[channel] + after[channel]);
                }
            }
            sum
        })
        .collect()
}
