//! Models of one form, fitted to whitened signals.
//!
//! *in* a record, its whitening; *out* candidates with their likelihood and covariance; *never* an unstable model; *source*
//! Steiglitz and McBride 1965; Levenberg-Marquardt; the covariance of a model that is not the whole truth: Liang and Zeger 1986.

use nalgebra::{DMatrix, DVector};

use crate::{
    arx::Arx,
    least_squares::{Regression, Solution},
    polynomial::{delayed, filter, is_stable},
    record::{Record, Segment},
    transfer_function::TransferFunction,
};

/// Blocks from which the errors' spread is taken, at most: fewer and longer ones where the loop settles slowly.
const MOST_BLOCKS: usize = 60;
/// By how much the covariance is enlarged, at most, because there are few blocks for the number of coefficients.
const MOST_FITTED: f64 = 3.0;

/// A model of one form, fitted.
pub(crate) struct Candidate {
    /// The model; its offset is the whitened one.
    pub(crate) model: TransferFunction,
    /// Covariance of its coefficients if errors are white.
    pub(crate) covariance: DMatrix<f64>,
    /// Rows times the logarithm of the errors' variance: minus twice the logarithm of the likelihood.
    pub(crate) deviance: f64,
}

impl Candidate {
    /// Number of coefficients.
    pub(crate) fn size(&self) -> f64 {
        self.covariance.nrows() as f64
    }

    /// Order, terms of the numerator, dead time.
    pub(crate) fn form(&self) -> [usize; 3] {
        [self.model.order(), self.model.numerator.len(), self.model.dead_time]
    }
}

/// Whitened signals, and the rows that are scored.
pub(crate) struct Whitened {
    segments: Vec<Segment>,
    /// A(1): what the whitening makes of a constant.
    level: f64,
    /// Rows at the start of each segment whose past is not known.
    skipped: usize,
    pub(crate) rows: usize,
}

/// Numerator, denominator without its first 1, offset.
pub(crate) fn coefficients(model: &TransferFunction) -> DVector<f64> {
    let values = model.numerator.iter().chain(&model.denominator[1..]).copied().chain([model.offset]);
    DVector::from_vec(values.collect())
}

impl TransferFunction {
    /// A model of the same form with other coefficients.
    pub(crate) fn with(&self, coefficients: &DVector<f64>) -> Self {
        let terms = self.numerator.len();
        let values = coefficients.as_slice();
        Self {
            dead_time: self.dead_time,
            numerator: values[..terms].to_vec(),
            denominator: std::iter::once(1.0).chain(values[terms..values.len() - 1].iter().copied()).collect(),
            offset: values[values.len() - 1],
        }
    }
}

impl Whitened {
    /// A record's signals through the whitening; dead times up to `longest` will be tried.
    pub(crate) fn new(record: &Record, arx: &Arx, longest: usize) -> Self {
        let shortest = record.segments.iter().map(|segment| segment.measured.len()).min().unwrap_or(0);
        let skipped = (arx.order + longest + 8).min(shortest / 4);
        let segments = record.segments.iter().map(|segment| Segment {
            reference: filter(&arx.whitening, &[1.0], &segment.reference),
            measured: filter(&arx.whitening, &[1.0], &segment.measured),
        });
        let rows = record.segments.iter().map(|segment| segment.measured.len() - skipped).sum();
        Self { segments: segments.collect(), level: arx.whitening.iter().sum(), skipped, rows }
    }

    /// The model of that form; `None` if none is stable.
    pub(crate) fn fit(&self, order: usize, terms: usize, dead_time: usize) -> Option<Candidate> {
        let form = TransferFunction { dead_time, numerator: vec![0.0; terms], denominator: vec![0.0; order + 1], offset: 0.0 };
        let mut denominator = vec![1.0];
        denominator.resize(order + 1, 0.0);
        let mut found: Option<(f64, DVector<f64>)> = None;
        for _ in 0..8 {
            let solution = self.steiglitz_mcbride(&form, &denominator)?;
            let mut model = form.with(&solution.coefficients);
            for _ in 0..200 {
                if is_stable(&model.denominator) {
                    break;
                }
                // Poles are drawn towards zero until all are inside.
                let mut factor = 1.0;
                for c in &mut model.denominator {
                    *c *= factor;
                    factor *= 0.97;
                }
            }
            if !is_stable(&model.denominator) {
                return None;
            }
            let before = std::mem::replace(&mut denominator, model.denominator.clone());
            let cost = self.cost(&model);
            if found.as_ref().is_none_or(|(least, _)| cost < *least) {
                found = Some((cost, coefficients(&model)));
            }
            if before.iter().zip(&denominator).all(|(a, b)| (a - b).abs() < 1e-5) {
                break;
            }
        }
        let (cost, start) = found?;
        let (model, solution, cost) = self.polished(form.with(&start), cost)?;
        let (rows, count) = (self.rows as f64, start.len() as f64);
        let variance = (cost / (rows - count)).max(f64::MIN_POSITIVE);
        Some(Candidate { covariance: solution.inverse * variance, model, deviance: rows * variance.ln() })
    }

    /// One step: signals filtered by 1/F of the step before, then linear least squares.
    fn steiglitz_mcbride(&self, form: &TransferFunction, denominator: &[f64]) -> Option<Solution> {
        let (terms, order) = (form.numerator.len(), denominator.len() - 1);
        let mut regression = Regression::new(terms + order + 1, 1);
        let mut row = vec![0.0; terms + order + 1];
        for segment in &self.segments {
            let input = filter(&[1.0], denominator, &delayed(&segment.reference, form.dead_time));
            let output = filter(&[1.0], denominator, &segment.measured);
            for tick in self.skipped.max(terms.max(order))..output.len() {
                for (lag, cell) in row[..terms].iter_mut().enumerate() {
                    *cell = input[tick - lag];
                }
                for (lag, cell) in row[terms..terms + order].iter_mut().enumerate() {
                    *cell = -output[tick - 1 - lag];
                }
                row[terms + order] = self.level;
                regression.push(&row, &[output[tick]]);
            }
        }
        regression.solve(1e-13)
    }

    fn simulated(&self, model: &TransferFunction, segment: &Segment) -> Vec<f64> {
        filter(&model.numerator, &model.denominator, &delayed(&segment.reference, model.dead_time))
    }

    fn cost(&self, model: &TransferFunction) -> f64 {
        let of = |segment: &Segment| -> f64 {
            let simulated = self.simulated(model, segment);
            let errors = segment.measured.iter().zip(&simulated).skip(self.skipped);
            errors.map(|(y, simulated)| (y - simulated - model.offset * self.level).powi(2)).sum()
        };
        self.segments.iter().map(of).sum()
    }

    /// Levenberg-Marquardt on the whitened output error.
    fn polished(&self, mut model: TransferFunction, mut cost: f64) -> Option<(TransferFunction, Solution, f64)> {
        let mut damping = 1e-4;
        let mut last = self.linearised(&model).solve(1e-13);
        for _ in 0..12 {
            let regression = self.linearised(&model);
            let mut moved = false;
            for _ in 0..5 {
                let Some(step) = regression.solve(damping) else { break };
                let trial = model.with(&(coefficients(&model) + step.coefficients));
                let trial_cost = if is_stable(&trial.denominator) { self.cost(&trial) } else { f64::INFINITY };
                if trial_cost < cost {
                    moved = cost - trial_cost > 1e-6 * cost;
                    (model, cost) = (trial, trial_cost);
                    damping = (damping * 0.2).max(1e-12);
                    break;
                }
                damping *= 8.0;
            }
            if !moved {
                break;
            }
        }
        last = self.linearised(&model).solve(1e-13).or(last);
        Some((model, last?, cost))
    }

    /// The output error linearised in the coefficients.
    fn linearised(&self, model: &TransferFunction) -> Regression {
        let mut regression = Regression::new(coefficients(model).len(), 1);
        self.gradients(model, |_, row, error| regression.push(row, &[error]));
        regression
    }

    /// Row by row: the index of its segment and its own, what each coefficient does to the output, the output error.
    fn gradients(&self, model: &TransferFunction, mut of_row: impl FnMut([usize; 2], &[f64], f64)) {
        let (terms, order) = (model.numerator.len(), model.denominator.len() - 1);
        let mut row = vec![0.0; terms + order + 1];
        for (index, segment) in self.segments.iter().enumerate() {
            let input = delayed(&segment.reference, model.dead_time);
            let simulated = filter(&model.numerator, &model.denominator, &input);
            let by_numerator = filter(&[1.0], &model.denominator, &input);
            let by_denominator = filter(&[1.0], &model.denominator, &simulated);
            for tick in self.skipped.max(terms.max(order))..simulated.len() {
                for (lag, cell) in row[..terms].iter_mut().enumerate() {
                    *cell = by_numerator[tick - lag];
                }
                for (lag, cell) in row[terms..terms + order].iter_mut().enumerate() {
                    *cell = -by_denominator[tick - 1 - lag];
                }
                row[terms + order] = self.level;
                of_row([index, tick], &row, segment.measured[tick] - simulated[tick] - model.offset * self.level);
            }
        }
    }

    /// Covariance of coefficients of a model that is not the whole truth: from the spread of the blocks' pulls on the
    /// coefficients (Liang and Zeger, "Longitudinal data analysis using generalized linear models", Biometrika 73 (1986), blocks
    /// for subjects), where that is more than white errors explain.
    pub(crate) fn robust(&self, Candidate { model, covariance: white, .. }: &Candidate) -> DMatrix<f64> {
        let length = (2 * model.settling()).max(self.rows / MOST_BLOCKS).max(1);
        let size = white.nrows();
        let mut blocks: Vec<([usize; 2], DVector<f64>)> = Vec::new();
        self.gradients(model, |[segment, tick], row, error| {
            let block = [segment, tick / length];
            if blocks.last().is_none_or(|(last, _)| *last != block) {
                blocks.push((block, DVector::zeros(size)));
            }
            let (_, pull) = blocks.last_mut().expect("a block was just pushed");
            pull.iter_mut().zip(row).for_each(|(sum, gradient)| *sum += gradient * error);
        });
        let (rows, size) = (self.rows as f64, size as f64);
        let Some(root) = white.clone().cholesky().map(|cholesky| cholesky.l()) else { return white.clone() };
        let variance = self.cost(model) / (rows - size);
        // In coordinates in which white errors make the sum of squares of the pulls the unit matrix.
        let mut squares = DMatrix::zeros(white.nrows(), white.nrows());
        for (_, pull) in &blocks {
            let pull = root.tr_mul(pull) / variance;
            squares.ger(1.0, &pull, &pull, 1.0);
        }
        // A log without any noise leaves nothing to tell a spread from.
        if !squares.iter().all(|square: &f64| square.is_finite()) {
            return white.clone();
        }
        // White errors seen in so few blocks reach to the edge of Marchenko and Pastur's law.
        let edge = (1.0 + (size / blocks.len().max(1) as f64).sqrt()).powi(2);
        let mut eigen = squares.symmetric_eigen();
        eigen.eigenvalues.iter_mut().for_each(|value| *value = if *value > edge { *value } else { 1.0 });
        // Coefficients were fitted to the very errors whose spread this is.
        let count = blocks.len() as f64;
        let fitted = count / (count - size).max(count / MOST_FITTED);
        fitted * (&root * eigen.recompose() * root.transpose())
    }
}
