//! Ranges of every pre-activation and output, by back-substitution of straight lines.
//!
//! Zhang et al. 2018, *Efficient Neural Network Robustness Certification with General Activation Functions* (CROWN): a bound on a
//! sum of activations is a sum of lines in the pre-activations, these are sums of the activations before, and so on to the
//! inputs, where the coefficients meet those of the skip; only then is the box put in. Each pre-activation is also bounded by
//! interval arithmetic, and the tighter end counts.

use super::{
    interval::{Interval, MARGIN},
    layered::{Dense, Layered},
    relaxation::{Function, Line},
};

/// What is known of a layer once its pre-activations are bounded.
pub(super) struct Known {
    /// Of each pre-activation.
    pub(super) sums: Vec<Interval>,
    /// Of each activation, its error included.
    pub(super) values: Vec<Interval>,
    /// Largest error of each pre-activation, with the margin for the rounding of these computations.
    pub(super) errors: Vec<f64>,
    lines: Vec<[Line; 2]>,
}

impl Dense {
    pub(super) fn function(&self) -> Function {
        Function { activation: self.activation, clip: self.clip }
    }

    /// Σ |weight| × largest magnitude + |bias| of a row.
    fn magnitude(&self, row: usize, inputs: &[Interval]) -> f64 {
        let weights = &self.weights[row * self.inputs..][..self.inputs];
        let products = weights.iter().zip(inputs).map(|(weight, input)| weight.abs() * input.magnitude());
        products.sum::<f64>() + self.bias[row].abs()
    }

    /// A row by interval arithmetic.
    fn interval(&self, row: usize, inputs: &[Interval], error: f64) -> Interval {
        let weights = &self.weights[row * self.inputs..][..self.inputs];
        let mut range = Interval { low: self.bias[row] - error, high: self.bias[row] + error };
        for (weight, input) in weights.iter().zip(inputs) {
            let ends = [weight * input.low, weight * input.high];
            range.low += ends[0].min(ends[1]);
            range.high += ends[0].max(ends[1]);
        }
        range
    }
}

/// `rows` × `weights`, `weights` row-major with `columns` columns.
pub(super) fn product(rows: &[Vec<f64>], weights: &[f64], columns: usize) -> Vec<Vec<f64>> {
    let row = |coefficients: &Vec<f64>| {
        let mut sums = vec![0.0; columns];
        for (coefficient, row) in coefficients.iter().zip(weights.chunks_exact(columns.max(1))) {
            if *coefficient != 0.0 {
                sums.iter_mut().zip(row).for_each(|(sum, weight)| *sum += coefficient * weight);
            }
        }
        sums
    };
    rows.iter().map(row).collect()
}

impl Layered {
    /// What the first layer reads.
    pub(super) fn first_inputs(&self) -> Vec<Interval> {
        self.inputs.iter().zip(&self.input_error).map(|(range, error)| range.widened(*error)).collect()
    }

    /// Bounds every layer.
    pub(super) fn known(&self) -> Vec<Known> {
        let mut known: Vec<Known> = Vec::new();
        for (index, layer) in self.layers.iter().enumerate() {
            let inputs = known.last().map_or_else(|| self.first_inputs(), |previous| previous.values.clone());
            let errors: Vec<f64> =
                (0..layer.outputs()).map(|row| layer.error + (layer.relative + MARGIN) * layer.magnitude(row, &inputs)).collect();
            let rows: Vec<Vec<f64>> = layer.weights.chunks_exact(layer.inputs.max(1)).map(<[f64]>::to_vec).collect();
            let lows = self.lowest(&known, index, rows.clone(), None);
            let negative: Vec<Vec<f64>> = rows.into_iter().map(|row| row.into_iter().map(|weight| -weight).collect()).collect();
            let highs = self.lowest(&known, index, negative, None);
            let sums = (0..layer.outputs()).map(|row| {
                let plain = layer.interval(row, &inputs, errors[row]);
                let low = (lows[row] + layer.bias[row] - errors[row]).max(plain.low);
                let high = (-highs[row] + layer.bias[row] + errors[row]).min(plain.high);
                // Equal but for rounding where a range is a point.
                Interval { low: low.min(high), high: high.max(low) }
            });
            let sums: Vec<Interval> = sums.collect();
            let function = layer.function();
            let values = sums.iter().map(|range| function.range(*range).widened(layer.activation_error)).collect();
            let lines = sums.iter().map(|range| function.lines(*range)).collect();
            known.push(Known { sums, values, errors, lines });
        }
        known
    }

    /// Lower bounds of sums of the inputs of layer `layer` (the outputs of `known[layer - 1]`), one for each row of coefficients,
    /// plus those of the normalised inputs that `skip` has for each row.
    fn lowest(&self, known: &[Known], layer: usize, mut rows: Vec<Vec<f64>>, skip: Option<&[Vec<f64>]>) -> Vec<f64> {
        let mut constants = vec![0.0; rows.len()];
        for (dense, known) in self.layers.iter().zip(known).take(layer).rev() {
            for (coefficients, constant) in rows.iter_mut().zip(&mut constants) {
                let mut margin = 0.0;
                for (unit, coefficient) in coefficients.iter_mut().enumerate() {
                    let line = known.lines[unit][usize::from(*coefficient < 0.0)];
                    margin += coefficient.abs() * (dense.activation_error + MARGIN * line.offset.abs());
                    *constant += *coefficient * line.offset;
                    *coefficient *= line.slope;
                    *constant += *coefficient * dense.bias[unit];
                    margin += coefficient.abs() * known.errors[unit];
                }
                *constant -= margin + MARGIN * constant.abs();
            }
            rows = product(&rows, &dense.weights, dense.inputs);
        }
        let lowest = rows.iter().enumerate().map(|(row, coefficients)| {
            let mut low = constants[row];
            let mut margin = MARGIN * low.abs();
            for (input, coefficient) in coefficients.iter().enumerate() {
                let range = self.inputs[input];
                let straight = skip.map_or(0.0, |skip| skip[row][input]);
                let sum = coefficient + straight;
                low += (sum * range.low).min(sum * range.high);
                margin += coefficient.abs() * self.input_error[input];
                margin += MARGIN * (coefficient.abs() + straight.abs()) * range.magnitude();
            }
            low - margin
        });
        lowest.collect()
    }

    /// Range of each output, in its unit.
    pub(super) fn output_range(&self, known: &[Known]) -> Vec<Interval> {
        let outputs = self.mean.len();
        let straight: Vec<Vec<f64>> = match &self.skip {
            Some(skip) => skip.chunks_exact(self.inputs.len().max(1)).map(<[f64]>::to_vec).collect(),
            None => vec![vec![0.0; self.inputs.len()]; outputs],
        };
        // Without layers the rows are the skip's alone.
        let (rows, bias, errors, depth) = match (self.layers.last(), known.last()) {
            (Some(last), Some(known)) => {
                let rows: Vec<Vec<f64>> = last.weights.chunks_exact(last.inputs.max(1)).map(<[f64]>::to_vec).collect();
                (rows, last.bias.clone(), known.errors.clone(), self.layers.len() - 1)
            }
            _ => (vec![vec![0.0; self.inputs.len()]; outputs], vec![0.0; outputs], vec![0.0; outputs], 0),
        };
        let negated = |rows: &[Vec<f64>]| rows.iter().map(|row| row.iter().map(|value| -value).collect()).collect::<Vec<_>>();
        let lows = self.lowest(known, depth, rows.clone(), Some(&straight));
        let highs = self.lowest(known, depth, negated(&rows), Some(&negated(&straight)));
        let ends = (0..outputs).map(|output| {
            let error = errors[output] + self.result_rounding(known, output);
            let range = Interval { low: lows[output] + bias[output] - error, high: bias[output] + error - highs[output] };
            self.denormalised(output, range)
        });
        ends.collect()
    }

    /// Largest sum of the magnitudes of an output's dense layers and skip.
    pub(super) fn result_magnitude(&self, known: &[Known], output: usize) -> f64 {
        let dense = known.last().map_or(0.0, |last| last.sums[output].magnitude());
        let straight = self.skip.as_ref().map_or(0.0, |skip| {
            let row = &skip[output * self.inputs.len()..][..self.inputs.len()];
            row.iter().zip(&self.inputs).map(|(weight, input)| weight.abs() * input.magnitude()).sum()
        });
        dense + straight
    }

    /// Rounding of an output behind its dense layers, before it is denormalised.
    pub(super) fn result_rounding(&self, known: &[Known], output: usize) -> f64 {
        (self.relative + MARGIN) * self.result_magnitude(known, output) + 1e-36
    }

    fn denormalised(&self, output: usize, range: Interval) -> Interval {
        let (scale, mean) = (self.scale[output], self.mean[output]);
        let error = self.denormalisation_rounding(output, range.magnitude());
        Interval { low: range.low * scale + mean - error, high: range.high * scale + mean + error }
    }

    /// Rounding of the last product and sum, for results of up to `magnitude`.
    pub(super) fn denormalisation_rounding(&self, output: usize, magnitude: f64) -> f64 {
        self.relative * (magnitude * self.scale[output].abs() + self.mean[output].abs()) + 1e-36
    }
}
