//! Training by Levenberg-Marquardt with variable projection.
//!
//! *in* rows, settings, a seed; *out* a [`Fit`]; *never* a step that makes the training error larger; *source* Zhou 2017, section V-A
//! (Levenberg-Marquardt, < 1000 iterations). Differs: the linear output layer is not a parameter but solved for at every step (Golub and
//! Pereyra 1973, with Kaufman's approximation of the Jacobian), which converges in a tenth of the steps.
//! The crate `varpro` asks for one matrix for each of the 500 derivatives, `levenberg-marquardt` decomposes the whole Jacobian at each step.

use impromptu_diagnosis::cholesky::Factor;
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use crate::siso::{
    network::{Activations, Network, Scaling},
    samples::Rows,
};

/// How a network is trained.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Units of each hidden layer.
    pub units: usize,
    /// Most steps.
    pub iterations: usize,
    /// It has converged when so many steps together take less than a tenth off the error.
    pub patience: usize,
    /// Standard deviation of the initial pre-activations for inputs of 1. Small ones leave the network nearly linear and the output
    /// weights large, which costs digits in f32.
    pub initial: f64,
    /// Weight of the squared output weights beside the mean squared error. Too small, and f64 gains digits that f32 loses to large
    /// weights.
    pub ridge: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { units: 20, iterations: 100, patience: 10, initial: 0.25, ridge: 1e-17 }
    }
}

/// A trained network.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// The network.
    pub network: Network,
    /// RMS of the scaled training error before each step, and after the last one.
    pub progress: Vec<f64>,
}

impl Fit {
    /// RMS of the scaled training error.
    pub fn rms(&self) -> f64 {
        self.progress.last().copied().unwrap_or(f64::INFINITY)
    }

    /// Steps that were taken.
    pub fn steps(&self) -> usize {
        self.progress.len().saturating_sub(1)
    }
}

/// Rows in the network's scale.
struct Problem<'s> {
    /// `[features][rows]`.
    inputs: DMatrix<f64>,
    targets: DVector<f64>,
    settings: &'s Settings,
}

/// Where the parameters are.
struct State {
    activations: Activations,
    /// Orthonormal basis of the output layer's columns (of the hidden units and the ridge).
    basis: DMatrix<f64>,
    /// Error of each row, and of the ridge.
    residual: DVector<f64>,
    /// Half of the squared residual.
    cost: f64,
}

impl Problem<'_> {
    fn rows(&self) -> usize {
        self.targets.len()
    }

    /// Solves for the output layer of `network`.
    fn project(&self, network: &mut Network) -> Option<State> {
        let activations = network.activations(&self.inputs);
        let (rows, columns) = (self.rows(), activations.second.nrows());
        let ridge = libm::sqrt(self.settings.ridge * rows as f64);
        let mut design = DMatrix::zeros(rows + columns, columns);
        design.rows_mut(0, rows).tr_copy_from(&activations.second);
        design.rows_mut(rows, columns).fill_diagonal(ridge);
        let mut targets = DVector::zeros(rows + columns);
        targets.rows_mut(0, rows).copy_from(&self.targets);
        let decomposition = design.clone().qr();
        let basis = decomposition.q();
        network.last = decomposition.r().solve_upper_triangular(&basis.tr_mul(&targets))?;
        let residual = design * &network.last - targets;
        let cost = residual.norm_squared() / 2.0;
        cost.is_finite().then_some(State { activations, basis, residual, cost })
    }

    /// Transposed Jacobian of the projected residual, `[parameters][rows and ridge]`.
    fn jacobian(&self, network: &Network, state: &State) -> DMatrix<f64> {
        let (units, features, rows) = (self.settings.units, self.inputs.nrows(), self.rows());
        let (first, second) = (&state.activations.first, &state.activations.second);
        let mut delta = DMatrix::from_fn(units, rows, |unit, row| {
            let value = second[(unit, row)];
            network.last[unit] * (1.0 - value * value)
        });
        let mut jacobian = DMatrix::zeros(units * (features + 1) + units * (units + 1), rows + second.nrows());
        let offset = units * (features + 1);
        fill(&mut jacobian, offset, &delta, first);
        delta = network.second.transpose() * delta;
        delta.zip_apply(first, |delta, value| *delta *= 1.0 - value * value);
        fill(&mut jacobian, 0, &delta, &self.inputs);
        let along = &jacobian * &state.basis;
        jacobian.gemm(-1.0, &along, &state.basis.transpose(), 1.0);
        jacobian
    }
}

/// Derivatives to the weights and biases of a layer: `delta` times its inputs, unit by unit, the biases at the end.
fn fill(jacobian: &mut DMatrix<f64>, offset: usize, delta: &DMatrix<f64>, inputs: &DMatrix<f64>) {
    let (units, count) = (delta.nrows(), inputs.nrows());
    for row in 0..delta.ncols() {
        let mut column = jacobian.column_mut(row);
        for unit in 0..units {
            let value = delta[(unit, row)];
            for input in 0..count {
                column[offset + unit * count + input] = value * inputs[(input, row)];
            }
            column[offset + units * count + unit] = value;
        }
    }
}

/// The network with a step added to its hidden layers.
fn moved(network: &Network, step: &DVector<f64>) -> Network {
    let mut moved = network.clone();
    let mut values = step.iter();
    for (weights, bias) in [(&mut moved.first, &mut moved.first_bias), (&mut moved.second, &mut moved.second_bias)] {
        for unit in 0..weights.nrows() {
            weights.row_mut(unit).iter_mut().zip(&mut values).for_each(|(weight, step)| *weight += step);
        }
        bias.iter_mut().zip(&mut values).for_each(|(bias, step)| *bias += step);
    }
    moved
}

/// Random hidden layers.
fn start(rows: &Rows, settings: &Settings, seed: u64) -> Network {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let (features, units) = (rows.inputs.ncols(), settings.units);
    let mut matrix = |rows: usize, columns: usize, deviation: f64| {
        DMatrix::from_fn(rows, columns, |_, _| deviation * random.sample::<f64, _>(StandardNormal))
    };
    let share = |inputs: usize| settings.initial / libm::sqrt(inputs as f64);
    let envelope = rows.envelope();
    let mut first = matrix(units, features, share(features));
    // What never changed in training says nothing: in flight it must not matter.
    for (mut column, _) in first.column_iter_mut().zip(&envelope).filter(|(_, (low, high))| low == high) {
        column.fill(0.0);
    }
    Network {
        inputs: envelope.into_iter().map(|(low, high)| Scaling::of(low, high)).collect(),
        output: Scaling::of(rows.targets.min(), rows.targets.max()),
        first,
        first_bias: matrix(units, 1, settings.initial).column(0).into_owned(),
        second: matrix(units, units, share(units)),
        second_bias: matrix(units, 1, settings.initial).column(0).into_owned(),
        last: DVector::zeros(units + 1),
    }
}

/// Factors by which the damping falls after a good step and grows after a bad one.
const FALL: f64 = 0.2;
const GROWTH: f64 = 5.0;

/// Trains a network from random hidden layers.
pub fn train(rows: &Rows, settings: &Settings, seed: u64) -> Fit {
    let mut network = start(rows, settings, seed);
    let targets = rows.targets.map(|target| network.output.scale(target));
    let problem = Problem { inputs: network.scaled_inputs(rows), targets, settings };
    let mut fit = Fit { network: network.clone(), progress: Vec::new() };
    let Some(mut state) = problem.project(&mut network) else { return fit };
    let rms = |state: &State| libm::sqrt(2.0 * state.cost / problem.rows() as f64);
    fit.progress.push(rms(&state));
    let mut damping = 1e-3;
    'steps: for _ in 0..settings.iterations {
        let now = fit.progress.len();
        if now > settings.patience && fit.progress[now - 1] > 0.9 * fit.progress[now - 1 - settings.patience] {
            break;
        }
        let jacobian = problem.jacobian(&network, &state);
        let gradient = &jacobian * &state.residual;
        let hessian = &jacobian * jacobian.transpose();
        let scale = hessian.diagonal().mean();
        loop {
            let mut damped = hessian.clone();
            (0..damped.nrows()).for_each(|index| damped[(index, index)] += damping * scale);
            let next = Factor::in_blocks(damped).map(|factor| factor.solve(&gradient));
            let next = next.filter(|step| step.iter().all(|value| value.is_finite())).and_then(|step| {
                let mut next = moved(&network, &-step);
                problem.project(&mut next).filter(|found| found.cost < state.cost).map(|found| (next, found))
            });
            if let Some((better, found)) = next {
                (network, state) = (better, found);
                damping = (damping * FALL).max(1e-18);
                break;
            }
            damping *= GROWTH;
            if damping > 1e6 {
                break 'steps;
            }
        }
        fit.progress.push(rms(&state));
    }
    fit.network = network;
    fit
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::siso::{
        FeatureSet, fixtures,
        samples::{Sampling, sample_tones},
        signal::tones,
    };

    fn rows() -> Rows {
        let sampling = Sampling { rows: 6, ..Sampling::default() };
        sample_tones(&fixtures::minimum_phase(), &FeatureSet::state_space(2, 1), &tones(), &sampling)
    }

    #[test]
    fn the_projected_jacobian_predicts_what_a_small_step_does_to_the_gradient_of_the_cost() {
        let (rows, settings) = (rows(), Settings { units: 4, ..Settings::default() });
        let mut network = start(&rows, &settings, 5);
        let targets = rows.targets.map(|target| network.output.scale(target));
        let problem = Problem { inputs: network.scaled_inputs(&rows), targets, settings: &settings };
        let state = problem.project(&mut network).unwrap();
        let gradient = problem.jacobian(&network, &state) * &state.residual;
        for parameter in [0, 7, 13, 20, 35] {
            let cost = |size: f64| {
                let mut step = DVector::zeros(gradient.len());
                step[parameter] = size;
                problem.project(&mut moved(&network, &step)).unwrap().cost
            };
            let slope = (cost(1e-5) - cost(-1e-5)) / 2e-5;
            assert!((slope - gradient[parameter]).abs() < 1e-6 * (1.0 + gradient.amax()), "{slope} {}", gradient[parameter]);
        }
    }

    #[test]
    fn a_feature_that_never_changed_in_training_does_not_matter_in_flight() {
        let rows = sample_tones(
            &fixtures::position_and_difference(1.0),
            &FeatureSet::state_space(2, 2).difference(),
            &tones(),
            &Sampling { rows: 4, ..Sampling::default() },
        );
        let network = train(&rows, &Settings { units: 4, iterations: 5, ..Settings::default() }, 1).network;
        assert_eq!(network.evaluate(&[0.0, 0.1, 0.2]), network.evaluate(&[3.0, 0.1, 0.2]));
    }

    #[test]
    fn the_error_falls_with_every_step_and_the_same_seed_gives_the_same_network() {
        let (rows, settings) = (rows(), Settings { units: 6, iterations: 12, ..Settings::default() });
        let fit = train(&rows, &settings, 3);
        assert!(fit.progress.windows(2).all(|pair| pair[1] < pair[0]) && fit.progress.len() > 2, "{:?}", fit.progress);
        assert_eq!(fit, train(&rows, &settings, 3));
        assert_ne!(fit, train(&rows, &settings, 4));
    }
}
