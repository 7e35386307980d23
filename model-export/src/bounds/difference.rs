//! Jacobians as intervals, and what they bound: slopes of a network and differences between two.
//!
//! For two networks of one shape, with e the difference of what a layer gives in the second (q) and in the first (f),
//!
//! ```text
//! e' = D (W_f e + (W_q - W_f) x_q + (b_q - b_f) + δ) + η
//! ```
//!
//! where D holds values of the activation's derivative between both pre-activations (mean value theorem), δ the errors of both sums, η
//! those behind both activations and what a saturation takes off. Unrolled, the difference of the outputs is the sum over the layers of
//! (an interval Jacobian of the first network) × (what that layer adds), and both signs of the weights' differences cancel as far as
//! the Jacobian is known. What differs from Paulsen et al. 2020 (ReluDiff): derivatives instead of cases, so that tanh fits too.

use super::{
    Interval, MARGIN,
    layered::{Dense, Layered},
    propagation::{Known, product},
};

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

/// Largest |second - first| of each output over the box, in its unit. Both have the same shape, box and normalisation but for rounding;
/// `input_rounding` bounds the difference of the normalised inputs.
pub(super) fn differences(
    (first, first_known): (&Layered, &[Known]),
    (second, second_known): (&Layered, &[Known]),
    input_rounding: &[f64],
) -> Vec<f64> {
    let outputs = first.mean.len();
    let mut total: Vec<f64> = (0..outputs)
        .map(|output| first.result_rounding(first_known, output) + second.result_rounding(second_known, output))
        .collect();
    let mut jacobian = Jacobian::identity(outputs);
    for index in (0..first.layers.len()).rev() {
        let (f, q) = (&first.layers[index], &second.layers[index]);
        let (f_known, q_known) = (&first_known[index], &second_known[index]);
        if index + 1 < first.layers.len() {
            // Behind the activation: errors of both, and what lies beyond the saturation of the second.
            let excess = q_known.sums.iter().map(|range| {
                let open = super::relaxation::Function { activation: q.activation, clip: f64::INFINITY };
                (open.range(*range).magnitude() - q.clip).max(0.0)
            });
            let errors: Vec<f64> = excess.map(|excess| excess + f.activation_error + q.activation_error).collect();
            let hull = f_known.sums.iter().zip(&q_known.sums).map(|(f, q)| f.hull(*q));
            for (row, total) in total.iter_mut().enumerate() {
                *total += jacobian.weighted(row, errors.iter().copied());
            }
            jacobian.times(&derivatives(f, hull));
        }
        let inputs = if index == 0 { second.first_inputs() } else { second_known[index - 1].values.clone() };
        let weights: Vec<f64> = q.weights.iter().zip(&f.weights).map(|(q, f)| q - f).collect();
        // The difference of the weights at the middle of the inputs, and its bias.
        let middles: Vec<f64> = weights
            .chunks_exact(f.inputs.max(1))
            .enumerate()
            .map(|(row, weights)| {
                let sum: f64 = weights.iter().zip(&inputs).map(|(weight, input)| weight * input.middle()).sum();
                sum + q.bias[row] - f.bias[row]
            })
            .collect();
        let magnitudes: Vec<f64> = weights.iter().map(|weight| weight.abs()).collect();
        let cancelled = product(&jacobian.centre, &weights, f.inputs);
        let unknown = product(&jacobian.radius, &magnitudes, f.inputs);
        for (row, total) in total.iter_mut().enumerate() {
            let middle: f64 = jacobian.centre[row].iter().zip(&middles).map(|(centre, middle)| centre * middle).sum();
            *total += middle.abs();
            *total += jacobian.radius[row].iter().zip(&middles).map(|(radius, middle)| radius * middle.abs()).sum::<f64>();
            for (column, input) in inputs.iter().enumerate() {
                *total += (cancelled[row][column].abs() + unknown[row][column]) * input.radius();
            }
            // The errors hold the margin for the rounding of the sums above as well.
            let errors = f_known.errors.iter().zip(&q_known.errors).map(|(f, q)| f + 2.0 * q);
            *total += jacobian.weighted(row, errors);
        }
        jacobian = jacobian.through(f);
    }
    let inputs = first.inputs.len();
    for (output, total) in total.iter_mut().enumerate() {
        if !first.layers.is_empty() {
            let errors = second.input_error.iter().zip(input_rounding).map(|(error, rounding)| error + rounding);
            *total += jacobian.weighted(output, errors);
        }
        if let Some(skip) = &first.skip {
            let row = &skip[output * inputs..][..inputs];
            *total += row.iter().zip(input_rounding).map(|(weight, rounding)| weight.abs() * rounding).sum::<f64>();
        }
        let largest = |network: &Layered, known: &[Known]| {
            let dense = known.last().map_or(0.0, |last| last.sums[output].magnitude());
            let straight = network.skip.as_ref().map_or(0.0, |skip| {
                let row = &skip[output * inputs..][..inputs];
                row.iter().zip(&network.inputs).map(|(weight, input)| weight.abs() * input.magnitude()).sum::<f64>()
            });
            network.denormalisation_rounding(output, dense + straight)
        };
        *total = *total * first.scale[output].abs() * (1.0 + MARGIN);
        *total += largest(first, first_known) + largest(second, second_known);
    }
    total
}
