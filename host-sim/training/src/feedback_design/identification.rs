//! Least-squares model of one axis of the closed baseline loop.
//!
//! in: logs of flights with a dither on the position reference; out: sums of products, from which models of any memory up
//! to the collected one are fitted; never: a model which changes when the whole flight is moved in space; source: ARX
//! prediction-error method (Ljung, System Identification, section 7.3), rows relative to the newest position.

use impromptu_diagnosis::{cholesky::Factor, least_squares::Regression};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::DesignRefusal;
use super::axis_log::{AxisLog, Columns};
use super::excitation::{self, Excitation};

/// How one measured quantity of the next tick depends on the newest `lags` samples of each signal, newest first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OutputEquation {
    /// Coefficients of the measured positions.
    pub position: Vec<f64>,
    /// Coefficients of the measured velocities.
    pub velocity: Vec<f64>,
    /// Coefficients of the position references.
    pub reference_position: Vec<f64>,
    /// Coefficients of the velocity references.
    pub reference_velocity: Vec<f64>,
}

/// Autoregressive model with external inputs of one axis of the closed baseline loop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArxModel {
    /// Predicts the measured position of the next tick, m.
    pub position: OutputEquation,
    /// Predicts the measured velocity of the next tick, m/s.
    pub velocity: OutputEquation,
    /// RMS of the one-tick prediction error over the logs: position (m), velocity (m/s).
    pub residual: [f64; 2],
}

impl ArxModel {
    /// Number of past samples of each signal which the model looks at.
    pub fn lags(&self) -> usize {
        self.position.position.len()
    }
}

/// Sums of products over all rows of all logs, collected once and shared by every design of a grid.
///
/// Build one for the horizontal axes (their logs pooled) and one for the vertical axis.
#[derive(Clone, Debug)]
pub struct IdentificationData {
    columns: Columns,
    /// Regressors and, behind them, the two targets: each of them may be regressed on others.
    products: Regression,
    excitation: Excitation,
}

/// Rows which are multiplied at a time: large enough for the matrix product, small enough for the cache.
const ROWS_AT_A_TIME: usize = 512;

impl IdentificationData {
    /// Collects the rows of all logs for models of up to `longest_lags` lags and measures their excitation.
    pub fn collect(logs: &[AxisLog], longest_lags: usize) -> Result<Self, DesignRefusal> {
        if longest_lags < 2 {
            return Err(DesignRefusal::setting("longest_lags", "at least 2"));
        }
        for (index, log) in logs.iter().enumerate() {
            check(index, log)?;
        }
        let columns = Columns { lags: longest_lags };
        let width = columns.regressors() + 2;
        let products = products(logs, columns);

        // Fewer rows than this leave more than a fifth of each coefficient to chance.
        let needed = 5 * width;
        if products.rows < needed {
            return Err(DesignRefusal::TooFewRows { rows: products.rows, needed });
        }
        let excitation = excitation::measure(logs, columns, &products)?;
        Ok(Self { columns, products, excitation })
    }

    /// Sums of products of each log by itself, for models of up to `longest_lags` lags: what [`Self::resampled`] draws from.
    pub fn sums(logs: &[AxisLog], longest_lags: usize) -> Vec<Regression> {
        logs.iter().map(|log| products(std::slice::from_ref(log), Columns { lags: longest_lags })).collect()
    }

    /// The same with other sums: those of logs drawn with replacement.
    #[must_use]
    pub fn resampled<'a>(&self, sums: impl Iterator<Item = &'a Regression>) -> Self {
        let mut products = Regression::new(self.products.gram.nrows(), 0);
        for sum in sums {
            products.gram += &sum.gram;
            products.rows += sum.rows;
        }
        Self { products, ..self.clone() }
    }

    /// Rows (ticks with a full past) that were collected.
    pub fn rows(&self) -> usize {
        self.products.rows
    }

    /// Longest memory, in ticks, of a model that can be fitted.
    pub fn longest_lags(&self) -> usize {
        self.columns.lags
    }

    /// What moved the position reference independently of everything else in the logs.
    pub fn excitation(&self) -> &Excitation {
        &self.excitation
    }

    /// Fits a model of `lags` lags as if the measurements had noise of standard deviation `added_noise` (m, m/s) on top of
    /// their own.
    ///
    /// The sums are those which infinitely many noisy copies of the logs would give. The newest position is the origin of
    /// its row: its noise moves every position and position reference of the row together, hence the full block rather
    /// than a diagonal. `regularisation` is relative to each regressor's own power.
    pub fn fit(&self, lags: usize, added_noise: [f64; 2], regularisation: f64) -> Result<ArxModel, DesignRefusal> {
        if !(2..=self.columns.lags).contains(&lags) {
            return Err(DesignRefusal::setting("lags", "between 2 and the lags collected"));
        }
        let columns = Columns { lags };
        let selection = self.columns.selection(lags);
        let (regressors, targets) = selection.split_at(columns.regressors());
        let plain = self.products.select(regressors, targets);

        let [position_power, velocity_power] = added_noise.map(|noise| plain.rows as f64 * noise * noise);
        let positions: Vec<usize> = (1..lags).map(|lag| columns.position(lag)).collect();
        let moved: Vec<usize> = positions.iter().copied().chain((0..lags).map(|lag| columns.reference_position(lag))).collect();
        let mut noisy = plain.clone();
        for &row in &moved {
            for &column in &moved {
                noisy.gram[(row, column)] += position_power;
            }
            noisy.cross[(row, 0)] += position_power;
        }
        for &index in &positions {
            noisy.gram[(index, index)] += position_power;
        }
        for lag in 0..lags {
            let index = columns.velocity(lag);
            noisy.gram[(index, index)] += velocity_power;
        }

        let factor = Factor::of_unit_power(&noisy.gram, regularisation).ok_or(DesignRefusal::SingularRegression { lags })?;
        let mut residual = [0.0; 2];
        let mut solve = |output: usize| {
            let coefficients = factor.solve(&noisy.cross.column(output));
            residual[output] = (plain.residual(output, &coefficients) / plain.rows as f64).sqrt();
            coefficients
        };
        let position = equation(columns, &solve(0), 1.0);
        let velocity = equation(columns, &solve(1), 0.0);
        Ok(ArxModel { position, velocity, residual })
    }
}

/// Sums of products of all rows of all logs.
fn products(logs: &[AxisLog], columns: Columns) -> Regression {
    let width = columns.regressors() + 2;
    let mut products = Regression::new(width, 0);
    let mut block = DMatrix::zeros(width, ROWS_AT_A_TIME);
    let mut filled = 0;
    for log in logs {
        for k in columns.ticks(log.measured_position.len()) {
            columns.fill(log, k, block.column_mut(filled).as_mut_slice());
            filled += 1;
            if filled == ROWS_AT_A_TIME {
                products.push_block(block.as_view(), &DMatrix::zeros(filled, 0), None);
                filled = 0;
            }
        }
    }
    products.push_block(block.columns(0, filled), &DMatrix::zeros(filled, 0), None);
    products
}

/// Splits solved coefficients into signals and gives the newest position what translation invariance leaves to it:
/// all coefficients of positions and position references add up to `total`.
fn equation(columns: Columns, coefficients: &DVector<f64>, total: f64) -> OutputEquation {
    let take = |first: usize, count: usize| coefficients.as_slice()[first..first + count].to_vec();
    let lags = columns.lags;
    let older = take(columns.position(1), lags - 1);
    let reference_position = take(columns.reference_position(0), lags);
    let newest = total - older.iter().chain(&reference_position).sum::<f64>();
    OutputEquation {
        position: std::iter::once(newest).chain(older).collect(),
        velocity: take(columns.velocity(0), lags),
        reference_position,
        reference_velocity: take(columns.reference_velocity(0), lags),
    }
}

fn check(index: usize, log: &AxisLog) -> Result<(), DesignRefusal> {
    let length = log.measured_position.len();
    let signals = [
        ("measured_position", log.measured_position),
        ("measured_velocity", log.measured_velocity),
        ("reference_position", log.reference_position),
        ("reference_velocity", log.reference_velocity),
        ("dither", log.dither.unwrap_or(log.measured_position)),
    ];
    for (signal, values) in signals {
        if values.len() != length {
            return Err(DesignRefusal::UnequalLengths { log: index, signal, length: values.len(), expected: length });
        }
        if let Some(tick) = values.iter().position(|value| !value.is_finite()) {
            return Err(DesignRefusal::NotFinite { log: index, signal, tick });
        }
    }
    Ok(())
}
