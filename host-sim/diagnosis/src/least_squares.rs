//! Least squares by normal equations, with the covariance of what was found.

use nalgebra::{DMatrix, DVector};

/// Sums of a linear regression: rows come in, the solution comes out.
#[derive(Clone, Debug)]
pub struct Regression {
    /// Lower triangle, column by column.
    gram: Vec<f64>,
    cross: DVector<f64>,
    square: f64,
    rows: usize,
}

/// Solution of a regression.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Coefficients.
    pub coefficients: DVector<f64>,
    /// Inverse of the normal matrix; times the residuals' variance it is the covariance of the coefficients.
    pub inverse: DMatrix<f64>,
    /// Sum of squared residuals.
    pub residual: f64,
    /// Number of rows.
    pub rows: usize,
}

impl Regression {
    /// A regression on that many columns.
    pub fn new(columns: usize) -> Self {
        Self { gram: vec![0.0; columns * (columns + 1) / 2], cross: DVector::zeros(columns), square: 0.0, rows: 0 }
    }

    /// One equation `row · coefficients = target`.
    pub fn push(&mut self, row: &[f64], target: f64) {
        let mut rest = self.gram.as_mut_slice();
        for (column, value) in row.iter().enumerate() {
            let (sums, after) = rest.split_at_mut(row.len() - column);
            for (sum, factor) in sums.iter_mut().zip(&row[column..]) {
                *sum += value * factor;
            }
            rest = after;
            self.cross[column] += value * target;
        }
        self.square += target * target;
        self.rows += 1;
    }

    /// The solution; `penalty` is relative to each column's own mean square. `None` if the columns depend on each other.
    pub fn solve(&self, penalty: f64) -> Option<Solution> {
        let columns = self.cross.len();
        let start = |column: usize| column * (2 * columns + 1 - column) / 2;
        let full = DMatrix::from_fn(columns, columns, |i, j| self.gram[start(i.min(j)) + i.abs_diff(j)]);
        // Columns of one size: the condition of the problem, not of its units.
        let scale = DVector::from_fn(columns, |i, _| if full[(i, i)] > 0.0 { full[(i, i)].sqrt().recip() } else { 1.0 });
        let scaled = DMatrix::from_fn(columns, columns, |i, j| {
            let value = full[(i, j)] * scale[i] * scale[j];
            if i == j { value + penalty } else { value }
        });
        let inverse = scaled.cholesky()?.inverse();
        let inverse = DMatrix::from_fn(columns, columns, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
        let coefficients = &inverse * &self.cross;
        let explained = 2.0 * coefficients.dot(&self.cross);
        let residual = (self.square - explained + coefficients.dot(&(full * &coefficients))).max(0.0);
        coefficients.iter().all(|c| c.is_finite()).then_some(Solution { coefficients, inverse, residual, rows: self.rows })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_equations_give_their_coefficients_whatever_the_units() {
        let mut regression = Regression::new(2);
        for tick in 0..20 {
            let (a, b) = (f64::from(tick) * 1e6, f64::from(tick * tick % 7) * 1e-6);
            regression.push(&[a, b], 3e-6 * a - 5e6 * b);
        }
        let found = regression.solve(0.0).unwrap();
        assert!((found.coefficients[0] / 3e-6 - 1.0).abs() < 1e-9 && (found.coefficients[1] / -5e6 - 1.0).abs() < 1e-9);
    }
}
