//! Jacobians as intervals, and what they bound: slopes of a network and differences between two.
//!
//! For two networks of one shape, with e the difference of what a layer gives in the second (q) and in the first (f),
//!
//! ```text
//! e' = D (W_f e + (W_q - W_f) x_q + (b_q - b_f) + δ) + η
//! ```
//!
//! where D holds values of the activation's derivative between both pre-activations (mean value theorem), δ the errors of both
//! sums, η those behind both activations and what a saturation takes off. Unrolled, the difference of the outputs is the sum over
//! the layers of (an interval Jacobian of the first network) × (what that layer adds), and both signs of the weights' differences
//! cancel as far as the Jacobian is known. Where inputs are far from zero a Jacobian says little, but then what a layer gives
//! hardly changes: so every layer's difference is bounded in turn, by its ranges too, and the unrolled sum may stop at any layer.
//! What differs from Paulsen et al. 2020 (ReluDiff): derivatives instead of cases, so that tanh fits too.

use super::{
    interval::{Interval, MARGIN},
    layered::{Dense, Layered},
    propagation::{Known, product},
    relaxation::Function,
};
use crate::float_network::Activation;

/// Matrix of intervals: centre and radius of each row.
struct Jacobian {
    centre: Vec<Vec<f64>>,
    radius: Vec<Vec<f64>>,
}

impl Jacobian {
    /// From the outputs of the last layer to themselves.
    fn identity(outputs: usize) -> Self {
        let row = |output: usize| (0..outputs).map(|other| if other == output { 1.0 } else { 0.0 }).collect();
        Self { centre: (0..outputs).map(row).collect(), radius: vec![vec![0.0; outputs]; outputs] }
    }

    /// Through the weights of a layer, from its pre-activations to its inputs.
    fn through(&self, layer: &Dense) -> Self {
        let magnitudes: Vec<f64> = layer.weights.iter().map(|weight| weight.abs()).collect();
        let centre = product(&self.centre, &layer.weights, layer.inputs);
        let absolute: Vec<Vec<f64>> = self.centre.iter().map(|row| row.iter().map(|value| value.abs()).collect()).collect();
        let rounding = product(&absolute, &magnitudes, layer.inputs);
        let mut radius = product(&self.radius, &magnitudes, layer.inputs);
        for (radius, rounding) in radius.iter_mut().zip(&rounding) {
            radius.iter_mut().zip(rounding).for_each(|(radius, rounding)| *radius = *radius * (1.0 + MARGIN) + MARGIN * rounding);
        }
        Self { centre, radius }
    }

    /// Through activations whose derivatives (not negative) lie within intervals.
    fn times(&mut self, derivatives: &[Interval]) {
        for (centres, radii) in self.centre.iter_mut().zip(&mut self.radius) {
            for ((centre, radius), derivative) in centres.iter_mut().zip(radii).zip(derivatives) {
                let (low, high) = (*centre - *radius, *centre + *radius);
                let low = (low * derivative.low).min(low * derivative.high);
                let high = (high * derivative.low).max(high * derivative.high);
                *centre = 0.5 * (low + high);
                *radius = 0.5 * (high - low) * (1.0 + MARGIN) + MARGIN * centre.abs();
            }
        }
    }

    fn magnitude(&self, row: usize, column: usize) -> f64 {
        self.centre[row][column].abs() + self.radius[row][column]
    }

    /// Σ of the magnitudes of a row, each times its weight.
    fn weighted(&self, row: usize, weights: impl Iterator<Item = f64>) -> f64 {
        weights.enumerate().map(|(column, weight)| self.magnitude(row, column) * weight).sum()
    }
}

fn derivatives(layer: &Dense, sums: impl Iterator<Item = Interval>) -> Vec<Interval> {
    sums.map(|range| layer.function().derivative(range)).collect()
}

/// Largest Σ |∂output / ∂normalised input| of each output over the box, in the output's unit.
pub(super) fn slopes(network: &Layered, known: &[Known]) -> Vec<f64> {
    let outputs = network.mean.len();
    let mut jacobian = Jacobian::identity(outputs);
    for (index, layer) in network.layers.iter().enumerate().rev() {
        if index + 1 < network.layers.len() {
            jacobian.times(&derivatives(layer, known[index].sums.iter().copied()));
        }
        jacobian = jacobian.through(layer);
    }
    let inputs = network.inputs.len();
    let slope = |output: usize| {
        let sum: f64 = (0..inputs)
            .map(|input| {
                let straight = network.skip.as_ref().map_or(0.0, |skip| skip[output * inputs + input]);
                let (centre, radius) = if network.layers.is_empty() {
                    (0.0, 0.0)
                } else {
                    (jacobian.centre[output][input], jacobian.radius[output][input])
                };
                (centre + straight).abs() + radius + MARGIN * (centre.abs() + straight.abs())
            })
            .sum();
        sum * network.scale[output].abs() * (1.0 + MARGIN)
    };
    (0..outputs).map(slope).collect()
}

/// Two networks of one shape and box, normalised alike but for rounding.
pub(super) struct Pair<'a> {
    first: (&'a Layered, &'a [Known]),
    second: (&'a Layered, &'a [Known]),
    /// Largest difference of the normalised inputs.
    input_rounding: &'a [f64],
    /// What the second network's layers add to a difference.
    steps: Vec<Step>,
}

/// What one layer adds.
struct Step {
    /// Weights of the second network less those of the first.
    weights: Vec<f64>,
    /// The same times the middle of the inputs, plus the difference of the biases.
    middles: Vec<f64>,
    /// Half widths of the second network's inputs.
    radii: Vec<f64>,
    /// Errors of both sums, with the margin for the rounding of the sums here.
    errors: Vec<f64>,
    /// Errors behind both activations, with what lies beyond the saturation of the second.
    behind: Vec<f64>,
    /// Derivatives of the activation between both pre-activations.
    derivatives: Vec<Interval>,
}

/// Largest |second - first| of values within these ranges.
fn farthest(first: Interval, second: Interval) -> f64 {
    (second.high - first.low).max(first.high - second.low).max(0.0)
}

impl<'a> Pair<'a> {
    pub(super) fn new(first: (&'a Layered, &'a [Known]), second: (&'a Layered, &'a [Known]), input_rounding: &'a [f64]) -> Self {
        let layers = first.0.layers.iter().zip(&second.0.layers).zip(first.1.iter().zip(second.1)).enumerate();
        let steps = layers.map(|(index, ((f, q), (f_known, q_known)))| {
            let inputs = if index == 0 { second.0.first_inputs() } else { second.1[index - 1].values.clone() };
            let weights: Vec<f64> = q.weights.iter().zip(&f.weights).map(|(q, f)| q - f).collect();
            let middle = |(row, weights): (usize, &[f64])| {
                let sum: f64 = weights.iter().zip(&inputs).map(|(weight, input)| weight * input.middle()).sum();
                sum + q.bias[row] - f.bias[row]
            };
            let behind = q_known.sums.iter().map(|range| {
                let open = Function { activation: q.activation, clip: f64::INFINITY };
                (open.range(*range).magnitude() - q.clip).max(0.0) + f.activation_error + q.activation_error
            });
            let hulls = f_known.sums.iter().zip(&q_known.sums).map(|(f, q)| f.hull(*q));
            Step {
                middles: weights.chunks_exact(f.inputs.max(1)).enumerate().map(middle).collect(),
                radii: inputs.iter().map(|input| input.radius()).collect(),
                weights,
                errors: f_known.errors.iter().zip(&q_known.errors).map(|(f, q)| f + 2.0 * q).collect(),
                behind: behind.collect(),
                derivatives: derivatives(f, hulls),
            }
        });
        let steps = steps.collect();
        Self { first, second, input_rounding, steps }
    }

    /// Largest difference of each pre-activation of `layer`, given those of the outputs of the layers before it: the least of the
    /// bounds that stop at each of these, and of what the ranges alone say.
    fn sums(&self, layer: usize, before: &[Vec<f64>]) -> Vec<f64> {
        let ranges = self.first.1[layer].sums.iter().zip(&self.second.1[layer].sums);
        let mut least: Vec<f64> = ranges.map(|(f, q)| farthest(*f, *q)).collect();
        let mut total = vec![0.0; least.len()];
        let mut jacobian = Jacobian::identity(least.len());
        for index in (0..=layer).rev() {
            let (f, step) = (&self.first.0.layers[index], &self.steps[index]);
            if index < layer {
                for (row, total) in total.iter_mut().enumerate() {
                    least[row] = least[row].min(*total + jacobian.weighted(row, before[index].iter().copied()));
                    *total += jacobian.weighted(row, step.behind.iter().copied());
                }
                jacobian.times(&step.derivatives);
            }
            let magnitudes: Vec<f64> = step.weights.iter().map(|weight| weight.abs()).collect();
            let cancelled = product(&jacobian.centre, &step.weights, f.inputs);
            let unknown = product(&jacobian.radius, &magnitudes, f.inputs);
            for (row, total) in total.iter_mut().enumerate() {
                let middle: f64 = jacobian.centre[row].iter().zip(&step.middles).map(|(centre, middle)| centre * middle).sum();
                let radii = jacobian.radius[row].iter().zip(&step.middles).map(|(radius, middle)| radius * middle.abs());
                *total += middle.abs() + radii.sum::<f64>();
                let moves = cancelled[row].iter().zip(&unknown[row]).zip(&step.radii);
                *total += moves.map(|((cancelled, unknown), radius)| (cancelled.abs() + unknown) * radius).sum::<f64>();
                *total += jacobian.weighted(row, step.errors.iter().copied());
            }
            jacobian = jacobian.through(f);
        }
        let errors = || self.second.0.input_error.iter().zip(self.input_rounding).map(|(error, rounding)| error + rounding);
        for (row, least) in least.iter_mut().enumerate() {
            *least = least.min(total[row] + jacobian.weighted(row, errors())) * (1.0 + MARGIN);
        }
        least
    }

    /// The same behind the activation of `layer`.
    fn values(&self, layer: usize, sums: &[f64]) -> Vec<f64> {
        let step = &self.steps[layer];
        let ranges = self.first.1[layer].values.iter().zip(&self.second.1[layer].values);
        let parts = sums.iter().zip(&step.derivatives).zip(&step.behind).zip(ranges);
        parts
            .map(|(((sum, derivative), behind), (f, q))| {
                let steepest = derivative.high * sum;
                let change = match self.first.0.layers[layer].activation {
                    // tanh a - tanh b is largest for a = -b.
                    Activation::Tanh => steepest.min(2.0 * (0.5 * sum).tanh() * (1.0 + MARGIN)),
                    Activation::Relu | Activation::Linear => steepest,
                };
                (change + behind).min(farthest(*f, *q))
            })
            .collect()
    }

    /// Largest |second - first| of each output over the box, in its unit.
    pub(super) fn outputs(&self) -> Vec<f64> {
        let (first, second) = (self.first.0, self.second.0);
        let mut before: Vec<Vec<f64>> = Vec::new();
        let mut dense = vec![0.0; first.mean.len()];
        for layer in 0..first.layers.len() {
            dense = self.sums(layer, &before);
            before.push(self.values(layer, &dense));
        }
        let inputs = first.inputs.len();
        let output = |(output, dense): (usize, f64)| {
            let straight = first.skip.as_ref().map_or(0.0, |skip| {
                let row = &skip[output * inputs..][..inputs];
                row.iter().zip(self.input_rounding).map(|(weight, rounding)| weight.abs() * rounding).sum::<f64>()
            });
            let rounding = |(network, known): (&Layered, &[Known])| {
                (
                    network.result_rounding(known, output),
                    network.denormalisation_rounding(output, network.result_magnitude(known, output)),
                )
            };
            let (f, q) = (rounding(self.first), rounding((second, self.second.1)));
            (dense + straight + f.0 + q.0) * first.scale[output].abs() * (1.0 + MARGIN) + f.1 + q.1
        };
        dense.into_iter().enumerate().map(output).collect()
    }
}
