//! Solution of least-squares normal equations whose regressors differ by orders of magnitude.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Cholesky factor of normal equations whose unknowns are scaled to unit power, with a ridge relative to it.
pub(super) struct ScaledCholesky {
    scale: DVector<f64>,
    factor: Cholesky<f64, Dyn>,
}

impl ScaledCholesky {
    pub(super) fn new(matrix: &DMatrix<f64>, ridge: f64) -> Option<Self> {
        // A regressor that never moves has power zero and gets the coefficient zero.
        let scale = matrix.diagonal().map(|power| if power > 0.0 { 1.0 / power.sqrt() } else { 1.0 });
        let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |row, column| {
            let ridge = if row == column { ridge } else { 0.0 };
            matrix[(row, column)] * scale[row] * scale[column] + ridge
        });
        let factor = Cholesky::new(scaled)?;
        Some(Self { scale, factor })
    }

    pub(super) fn solve(&self, target: &DVector<f64>) -> DVector<f64> {
        self.factor.solve(&target.component_mul(&self.scale)).component_mul(&self.scale)
    }
}
