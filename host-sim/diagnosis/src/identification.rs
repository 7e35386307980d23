//! From a record to a transfer function with the covariance of its coefficients.
//!
//! *in* a record at the sub-rate; *out* [`Identified`]; *never* an unstable model; *source* Zhu and Hjalmarsson, "The Box-Jenkins
//! Steiglitz-McBride algorithm", Automatica 65 (2016): whiten with the high-order [`Arx`], then Steiglitz-McBride; here polished
//! by Levenberg-Marquardt on the same whitened output error. Consistent for noise of any colour, because the reference does not
//! depend on it. Order, length of the numerator and dead time: Schwarz's criterion (BIC), whose weights also say how sure the
//! dead time is.

use nalgebra::{DMatrix, DVector};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::{
    arx::Arx,
    least_squares::{Regression, Solution},
    polynomial::{delayed, filter, is_stable},
    record::{Record, Segment},
    transfer_function::TransferFunction,
};

/// A model with its uncertainty.
#[derive(Clone, Debug)]
pub struct Identified {
    /// The model.
    pub model: TransferFunction,
    /// Covariance of numerator, denominator without its first 1, whitened offset, in this order; larger than white errors explain
    /// where the model is not the whole truth.
    pub covariance: DMatrix<f64>,
    /// Weight of each dead time, in ticks, after the data; they sum to 1.
    pub dead_times: Vec<(usize, f64)>,
    /// Noise at the output, segment by segment: measured minus simulated, in the output's unit.
    pub noise: Vec<Vec<f64>>,
    /// Order of the whitening filter.
    pub whitening_order: usize,
}

/// Highest order of the denominator.
const HIGHEST_ORDER: usize = 4;
/// Blocks from which the errors' spread is taken, at most: fewer and longer ones where the loop settles slowly.
const MOST_BLOCKS: usize = 60;
/// A draw that leaves more than this times what the model leaves of the log, in mean square, could not be the true one: where
/// poles nearly cancel zeros, a normal distribution of coefficients reaches far out of the data's valley.
const WORSE: f64 = 1.5;
/// Longest dead time tried, ticks.
const LONGEST_DEAD_TIME: usize = 12;
/// The same of a loop that is seen to answer later.
const LATEST: usize = 100;

struct Candidate {
    model: TransferFunction,
    covariance: DMatrix<f64>,
    criterion: f64,
}

/// Whitened signals, and the rows that are scored.
struct Whitened {
    segments: Vec<Segment>,
    /// A(1): what the whitening makes of a constant.
    level: f64,
    /// Rows at the start of each segment whose past is not known.
    skipped: usize,
    rows: usize,
}

/// Dead times that are tried, ticks: [`LONGEST_DEAD_TIME`], or up to the lag at which the two columns move most alike, if that is
/// twice as late and more: a loop answers before that.
fn longest_dead_time(record: &Record) -> usize {
    let most = (record.shortest() / 6).min(LATEST);
    let alike = |lag: usize| -> f64 {
        let of = |segment: &Segment| -> f64 {
            let moved = |values: &[f64], tick: usize| values[tick + 1] - values[tick];
            let ticks = 0..segment.reference.len().saturating_sub(lag + 1);
            ticks.map(|tick| moved(&segment.reference, tick) * moved(&segment.measured, tick + lag)).sum()
        };
        record.segments.iter().map(of).sum::<f64>().abs()
    };
    let best = (0..=most).map(|lag| (lag, alike(lag))).max_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(LONGEST_DEAD_TIME, |(lag, _)| if lag >= 2 * LONGEST_DEAD_TIME { lag } else { LONGEST_DEAD_TIME })
}

/// Identifies the channel; `None` if no stable model explains anything.
pub fn identify(record: &Record) -> Option<Identified> {
    let arx = Arx::fit(record)?;
    let longest = longest_dead_time(record);
    let whitened = Whitened::new(record, &arx, longest);
    if whitened.rows < 40 {
        return None;
    }
    let mut candidates: Vec<Candidate> = Vec::new();
    // Where the dead time lies is seen with few coefficients; the rest is tried round it.
    for dead_time in (0..=LONGEST_DEAD_TIME).chain((LONGEST_DEAD_TIME + 2..=longest).step_by(2)) {
        candidates.extend([(2, 1), (2, 2), (3, 3)].into_iter().filter_map(|(n, m)| whitened.fit(n, m, dead_time)));
    }
    let near = best(&candidates)?.model.dead_time;
    for order in 1..=HIGHEST_ORDER {
        for terms in 1..=order + 1 {
            for dead_time in near.saturating_sub(2)..=near + 2 {
                if !matches!((order, terms), (2, 1) | (2, 2) | (3, 3)) {
                    candidates.extend(whitened.fit(order, terms, dead_time));
                }
            }
        }
    }
    let chosen = best(&candidates)?;
    let least = |dead_time: usize| {
        let of = candidates.iter().filter(|candidate| candidate.model.dead_time == dead_time);
        of.map(|candidate| candidate.criterion).fold(f64::INFINITY, f64::min)
    };
    let weights: Vec<(usize, f64)> = (0..=longest + 2).map(|d| (d, (0.5 * (chosen.criterion - least(d))).exp())).collect();
    let total: f64 = weights.iter().map(|(_, weight)| weight).sum();
    let mut model = chosen.model.clone();
    level(&mut model, record);
    let noise = record
        .segments
        .iter()
        .map(|segment| segment.measured.iter().zip(model.simulate(&segment.reference)).map(|(y, model)| y - model).collect());
    Some(Identified {
        noise: noise.collect(),
        dead_times: weights.into_iter().map(|(d, weight)| (d, weight / total)).filter(|(_, weight)| *weight > 1e-4).collect(),
        model,
        covariance: whitened.robust(&chosen.model, &chosen.covariance),
        whitening_order: arx.order,
    })
}

/// The offset that leaves no mean. Whitening takes slow noise away and the constant with it, so that the whitened one is
/// uncertain. Gives the mean square of what is then left.
fn level(model: &mut TransferFunction, record: &Record) -> f64 {
    let (mut sum, mut squares, mut count) = (0.0, 0.0, 0);
    for segment in &record.segments {
        for (y, simulated) in segment.measured.iter().zip(model.simulate(&segment.reference)) {
            sum += y - simulated;
            squares += (y - simulated).powi(2);
        }
        count += segment.measured.len();
    }
    let mean = sum / count.max(1) as f64;
    model.offset += mean;
    squares / count.max(1) as f64 - mean * mean
}

fn best(candidates: &[Candidate]) -> Option<&Candidate> {
    candidates.iter().min_by(|a, b| a.criterion.total_cmp(&b.criterion))
}

impl Identified {
    /// Models that could as well be the true one: stable draws from the coefficients' distribution, each with the offset that
    /// suits the record.
    pub fn draws(&self, record: &Record, count: usize, random: &mut impl Rng) -> Vec<TransferFunction> {
        let size = self.covariance.nrows();
        // A tenth of a millionth more on the diagonal: rounding may have made the matrix indefinite.
        let jittered = &self.covariance + DMatrix::from_diagonal(&self.covariance.diagonal()) * 1e-7;
        let Some(root) = jittered.cholesky().map(|cholesky| cholesky.l()) else { return vec![self.model.clone(); count] };
        let centre = coefficients(&self.model);
        let bound = WORSE * level(&mut self.model.clone(), record);
        let mut draws = Vec::with_capacity(count);
        for _ in 0..20 * count {
            if draws.len() == count {
                break;
            }
            let normal = DVector::from_fn(size, |_, _| StandardNormal.sample(random));
            let mut model = self.model.with(&(&centre + &root * normal));
            if is_stable(&model.denominator) {
                let left = level(&mut model, record);
                if left <= bound {
                    draws.push(model);
                }
            }
        }
        draws.resize(count, self.model.clone());
        draws
    }
}

fn coefficients(model: &TransferFunction) -> DVector<f64> {
    let values = model.numerator.iter().chain(&model.denominator[1..]).copied().chain([model.offset]);
    DVector::from_vec(values.collect())
}

impl TransferFunction {
    /// A model of the same form with other coefficients.
    fn with(&self, coefficients: &DVector<f64>) -> Self {
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
    fn new(record: &Record, arx: &Arx, longest: usize) -> Self {
        let shortest = record.segments.iter().map(|segment| segment.measured.len()).min().unwrap_or(0);
        let skipped = (arx.order + longest + 8).min(shortest / 4);
        let segments = record.segments.iter().map(|segment| Segment {
            reference: filter(&arx.whitening, &[1.0], &segment.reference),
            measured: filter(&arx.whitening, &[1.0], &segment.measured),
        });
        let rows = record.segments.iter().map(|segment| segment.measured.len() - skipped).sum();
        Self { segments: segments.collect(), level: arx.whitening.iter().sum(), skipped, rows }
    }

    fn fit(&self, order: usize, terms: usize, dead_time: usize) -> Option<Candidate> {
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
        Some(Candidate { covariance: solution.inverse * variance, model, criterion: rows * variance.ln() + count * rows.ln() })
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
    fn robust(&self, model: &TransferFunction, white: &DMatrix<f64>) -> DMatrix<f64> {
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
        &root * eigen.recompose() * root.transpose()
    }
}
