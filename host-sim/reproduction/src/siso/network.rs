//! A tanh network of two hidden layers and one output, in f64.
//!
//! *in* features; *out* one number; *never* another scaling in training than in flight: it is part of the network; *source* Zhou
//! 2017, section V-A (3-20-20-1). Inputs and output are scaled to within ±1 over the training rows.

use nalgebra::{DMatrix, DVector};

use crate::siso::{FeatureSet, Module, Moment, samples::Rows};

/// x ↦ (x - centre) / half.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scaling {
    /// Middle of the range.
    pub centre: f64,
    /// Half of the range, positive.
    pub half: f64,
}

impl Scaling {
    /// To within ±1. The half is a power of two and a small centre is zero, so that f32 scales without rounding.
    pub fn of(low: f64, high: f64) -> Self {
        let (middle, reach) = ((high + low) / 2.0, (high - low) / 2.0);
        let centre = if middle.abs() > reach / 4.0 { f64::from(middle as f32) } else { 0.0 };
        let largest = (high - centre).abs().max((low - centre).abs());
        Self { centre, half: if largest > 0.0 { libm::exp2(libm::ceil(libm::log2(largest))) } else { 1.0 } }
    }

    /// The scaled value.
    pub fn scale(self, value: f64) -> f64 {
        (value - self.centre) / self.half
    }
}

/// tanh(W v + b), and a linear output.
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    /// One for each feature.
    pub inputs: Vec<Scaling>,
    /// Of the output.
    pub output: Scaling,
    /// `[units][inputs]`.
    pub first: DMatrix<f64>,
    /// One for each unit.
    pub first_bias: DVector<f64>,
    /// `[units][units before]`.
    pub second: DMatrix<f64>,
    /// One for each unit.
    pub second_bias: DVector<f64>,
    /// Weights of the output, its bias at the end.
    pub last: DVector<f64>,
}

/// Activations of all rows.
pub(crate) struct Activations {
    /// `[units][rows]`.
    pub(crate) first: DMatrix<f64>,
    /// `[units + 1][rows]`; the last row is 1.
    pub(crate) second: DMatrix<f64>,
}

impl Network {
    /// Scaled inputs, `[features][rows]`.
    pub(crate) fn scaled_inputs(&self, rows: &Rows) -> DMatrix<f64> {
        DMatrix::from_fn(rows.inputs.ncols(), rows.inputs.nrows(), |feature, row| {
            self.inputs[feature].scale(rows.inputs[(row, feature)])
        })
    }

    /// Hidden layers on scaled inputs.
    pub(crate) fn activations(&self, inputs: &DMatrix<f64>) -> Activations {
        let first = layer(&self.first, &self.first_bias, inputs);
        let units = self.second_bias.len();
        let mut second = layer(&self.second, &self.second_bias, &first).insert_row(units, 1.0);
        second.row_mut(units).fill(1.0);
        Activations { first, second }
    }

    /// Outputs of all rows, in the target's unit.
    pub fn outputs(&self, rows: &Rows) -> DVector<f64> {
        let hidden = self.activations(&self.scaled_inputs(rows)).second;
        (hidden.transpose() * &self.last).map(|value| value * self.output.half + self.output.centre)
    }

    /// The output for one row of features.
    pub fn evaluate(&self, inputs: &[f64]) -> f64 {
        let scaled: Vec<f64> = inputs.iter().zip(&self.inputs).map(|(value, scaling)| scaling.scale(*value)).collect();
        let hidden = dense(&self.second, &self.second_bias, &dense(&self.first, &self.first_bias, &scaled));
        let (bias, weights) = (self.last[hidden.len()], self.last.as_slice());
        let sum = hidden.iter().zip(weights).fold(bias, |sum, (value, weight)| sum + value * weight);
        sum * self.output.half + self.output.centre
    }

    /// Largest magnitude of a weight or bias, in scaled quantities.
    pub fn largest_weight(&self) -> f64 {
        [self.first.amax(), self.first_bias.amax(), self.second.amax(), self.second_bias.amax(), self.last.amax()]
            .into_iter()
            .fold(0.0, f64::max)
    }
}

fn layer(weights: &DMatrix<f64>, bias: &DVector<f64>, inputs: &DMatrix<f64>) -> DMatrix<f64> {
    let mut sums = weights * inputs;
    for mut column in sums.column_iter_mut() {
        column += bias;
    }
    sums.apply(|value| *value = libm::tanh(*value));
    sums
}

fn dense(weights: &DMatrix<f64>, bias: &DVector<f64>, inputs: &[f64]) -> Vec<f64> {
    let sum = |(row, bias): (usize, &f64)| {
        libm::tanh(inputs.iter().enumerate().fold(*bias, |sum, (column, value)| sum + weights[(row, column)] * value))
    };
    bias.iter().enumerate().map(sum).collect()
}

/// The network in front of a plant.
#[derive(Clone, Debug)]
pub struct NetworkModule<'a> {
    /// What it reads.
    pub set: &'a FeatureSet,
    /// What it computes.
    pub network: &'a Network,
}

impl Module<f64> for NetworkModule<'_> {
    fn reference(&self, moment: &Moment<'_, f64>) -> f64 {
        self.network.evaluate(&self.set.inputs(moment)) + self.set.base(moment)
    }
}
