//! Roots of real polynomials.
//!
//! *in* coefficients, highest power first; *out* complex roots; *never* a root of a leading coefficient that is zero; *source* the
//! eigenvalues of the companion matrix, by nalgebra's Schur decomposition.

use nalgebra::{Complex, DMatrix};

/// Roots of c₀ zⁿ + c₁ zⁿ⁻¹ + … + cₙ, by falling magnitude; none of a constant.
pub fn roots(coefficients: &[f64]) -> Vec<Complex<f64>> {
    let start = coefficients.iter().position(|coefficient| *coefficient != 0.0).unwrap_or(coefficients.len());
    let Some((leading, rest)) = coefficients[start..].split_first() else { return Vec::new() };
    // Roots at zero are exact, and a companion matrix with them converges badly.
    let zeros = rest.iter().rev().take_while(|coefficient| **coefficient == 0.0).count();
    let order = rest.len() - zeros;
    let companion = DMatrix::from_fn(order, order, |row, column| match (row, column) {
        (0, column) => -rest[column] / leading,
        (row, column) if row == column + 1 => 1.0,
        _ => 0.0,
    });
    let mut roots: Vec<Complex<f64>> =
        if order == 0 { Vec::new() } else { companion.complex_eigenvalues().iter().copied().collect() };
    roots.extend(std::iter::repeat_n(Complex::new(0.0, 0.0), zeros));
    roots.sort_by(|a, b| b.norm().total_cmp(&a.norm()).then(b.im.total_cmp(&a.im)));
    roots
}

/// The polynomial at a complex number.
pub fn evaluate(coefficients: &[f64], at: Complex<f64>) -> Complex<f64> {
    coefficients.iter().fold(Complex::new(0.0, 0.0), |value, coefficient| value * at + coefficient)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn leading_and_trailing_zeros_change_the_order_and_the_roots_at_zero() {
        let found = roots(&[0.0, 1.0, -0.5, 0.0]);
        assert_eq!(found.len(), 2);
        assert!((found[0].re - 0.5).abs() < 1e-15 && found[1].norm() == 0.0);
        assert!(roots(&[3.0]).is_empty() && roots(&[]).is_empty());
    }

    proptest! {
        #[test]
        fn a_polynomial_vanishes_at_its_roots(tail in proptest::collection::vec(-2.0..2.0f64, 1..6)) {
            let coefficients: Vec<f64> = std::iter::once(1.0).chain(tail).collect();
            for root in roots(&coefficients) {
                prop_assert!(evaluate(&coefficients, root).norm() < 1e-6 * (1.0 + root.norm().powi(coefficients.len() as i32)));
            }
        }
    }
}
