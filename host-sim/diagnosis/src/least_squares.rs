//! Least squares by normal equations: the one regression.
//!
//! *in* rows one at a time, blocks of them, or a whole table, for one target or several; *out* sums of products, coefficients,
//! and the covariance of what was found; *never* coefficients of columns that depend on each other; *source* Ljung, "System
//! Identification", 2nd ed., 7.3; penalties: Hoerl and Kennard, "Ridge regression", 1970.

use nalgebra::{DMatrix, DMatrixView, DVector};

use crate::cholesky::Factor;

/// Sums of products of a linear regression.
#[derive(Clone, Debug)]
pub struct Regression {
    /// Columns times columns; only the lower triangle counts.
    pub gram: DMatrix<f64>,
    /// Columns times targets, `columns × targets`.
    pub cross: DMatrix<f64>,
    /// Each target times itself.
    pub squares: DVector<f64>,
    /// Number of rows.
    pub rows: usize,
}

/// Solution of a regression for one target.
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
    /// Nothing summed up yet.
    pub fn new(columns: usize, targets: usize) -> Self {
        Self {
            gram: DMatrix::zeros(columns, columns),
            cross: DMatrix::zeros(columns, targets),
            squares: DVector::zeros(targets),
            rows: 0,
        }
    }

    /// The sums of a whole table, `rows × columns`, and its targets, `rows × targets`.
    ///
    /// # Panics
    /// If they have different numbers of rows.
    pub fn of_table(table: &DMatrix<f64>, targets: &DMatrix<f64>) -> Self {
        let squares = DVector::from_iterator(targets.ncols(), targets.column_iter().map(|target| target.norm_squared()));
        Self { gram: table.tr_mul(table), cross: table.tr_mul(targets), squares, rows: table.nrows() }
    }

    /// One equation `row · coefficients = target` for each target.
    pub fn push(&mut self, row: &[f64], targets: &[f64]) {
        for (column, (sums, value)) in self.gram.as_mut_slice().chunks_exact_mut(row.len()).zip(row).enumerate() {
            for (sum, factor) in sums[column..].iter_mut().zip(&row[column..]) {
                *sum += value * factor;
            }
        }
        for (index, target) in targets.iter().enumerate() {
            self.cross.column_mut(index).iter_mut().zip(row).for_each(|(sum, value)| *sum += value * target);
            self.squares[index] += target * target;
        }
        self.rows += 1;
    }

    /// Many equations at once, as products of matrices: `block` has one *column* for each row of the regression, in the order of
    /// memory, `targets` is `rows × targets`; each equation counts with its weight, 1 without weights.
    ///
    /// # Panics
    /// If shapes do not fit together.
    pub fn push_block(&mut self, block: DMatrixView<'_, f64>, targets: &DMatrix<f64>, weights: Option<&[f64]>) {
        let mut weighted = block.clone_owned();
        if let Some(weights) = weights {
            weighted.column_iter_mut().zip(weights).for_each(|(mut column, weight)| column *= *weight);
        }
        self.gram.gemm(1.0, &weighted, &block.transpose(), 1.0);
        self.cross.gemm(1.0, &weighted, targets, 1.0);
        for (square, target) in self.squares.iter_mut().zip(targets.column_iter()) {
            let weight = |row: usize| weights.map_or(1.0, |weights| weights[row]);
            *square += target.iter().enumerate().map(|(row, value)| weight(row) * value * value).sum::<f64>();
        }
        self.rows += block.ncols();
    }

    /// The regression of some columns of this one on others of them.
    pub fn select(&self, columns: &[usize], targets: &[usize]) -> Self {
        let sum = |i: usize, j: usize| self.gram[(i.max(j), i.min(j))];
        Self {
            gram: DMatrix::from_fn(columns.len(), columns.len(), |i, j| sum(columns[i], columns[j])),
            cross: DMatrix::from_fn(columns.len(), targets.len(), |i, j| sum(columns[i], targets[j])),
            squares: DVector::from_fn(targets.len(), |i, _| sum(targets[i], targets[i])),
            rows: self.rows,
        }
    }

    /// Adds to the square of each coefficient the penalty that its column's sum of squares deserves.
    pub fn penalise(&mut self, penalty: impl Fn(f64) -> f64) {
        for index in 0..self.gram.nrows() {
            let power = &mut self.gram[(index, index)];
            *power += penalty(*power);
        }
    }

    /// Sum of squared residuals that coefficients leave of a target.
    pub fn residual(&self, target: usize, coefficients: &DVector<f64>) -> f64 {
        let (columns, cross) = (self.gram.nrows(), self.cross.column(target));
        let gram = DMatrix::from_fn(columns, columns, |i, j| self.gram[(i.max(j), i.min(j))]);
        let explained = 2.0 * coefficients.dot(&cross);
        (self.squares[target] - explained + coefficients.dot(&(gram * coefficients))).max(0.0)
    }

    /// The solution for the first target, with its covariance; `penalty` is relative to each column's own mean square. `None` if
    /// the columns depend on each other.
    pub fn solve(&self, penalty: f64) -> Option<Solution> {
        let inverse = Factor::of_unit_power(&self.gram, penalty)?.inverse();
        let coefficients = &inverse * self.cross.column(0);
        let residual = self.residual(0, &coefficients);
        coefficients.iter().all(|c| c.is_finite()).then_some(Solution { coefficients, inverse, residual, rows: self.rows })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_equations_give_their_coefficients_whatever_the_units() {
        let mut regression = Regression::new(2, 1);
        for tick in 0..20 {
            let (a, b) = (f64::from(tick) * 1e6, f64::from(tick * tick % 7) * 1e-6);
            regression.push(&[a, b], &[3e-6 * a - 5e6 * b]);
        }
        let found = regression.solve(0.0).unwrap();
        assert!((found.coefficients[0] / 3e-6 - 1.0).abs() < 1e-9 && (found.coefficients[1] / -5e6 - 1.0).abs() < 1e-9);
    }

    #[test]
    fn rows_blocks_a_table_and_a_selection_give_the_same_sums() {
        let table = DMatrix::from_fn(40, 7, |row, column| ((row * row + 3 * column * row + column) % 13) as f64 - 5.0);
        let (columns, targets) = (table.columns(0, 5).into_owned(), table.columns(5, 2).into_owned());
        let whole = Regression::of_table(&columns, &targets);
        let mut rows = Regression::new(5, 2);
        for row in table.row_iter().map(|row| row.iter().copied().collect::<Vec<_>>()) {
            rows.push(&row[..5], &row[5..]);
        }
        let (mut blocks, mut all) = (Regression::new(5, 2), Regression::new(7, 0));
        for first in [0, 20] {
            let block = table.rows(first, 20).transpose();
            let targets = targets.rows(first, 20).into_owned();
            blocks.push_block(block.rows(0, 5).into_owned().as_view(), &targets, Some(&[1.0; 20]));
            all.push_block(block.as_view(), &DMatrix::zeros(20, 0), None);
        }
        for other in [rows, blocks, all.select(&[0, 1, 2, 3, 4], &[5, 6])] {
            assert_eq!(other.gram.lower_triangle(), whole.gram.lower_triangle());
            assert_eq!((other.cross, other.squares, other.rows), (whole.cross.clone(), whole.squares.clone(), 40));
        }
        assert!(Regression::of_table(&columns, &columns).residual(1, &DVector::from_fn(5, |i, _| f64::from(i == 1))) < 1e-9);
    }
}
