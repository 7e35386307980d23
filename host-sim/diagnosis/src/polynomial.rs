//! Polynomials in the delay operator: filtering, roots, stability.
//!
//! Coefficients are in rising powers of q⁻¹; a denominator starts with 1.

use nalgebra::{Complex, DMatrix};

/// Value at q = 1.
pub fn at_one(polynomial: &[f64]) -> f64 {
    polynomial.iter().sum()
}

/// Value at z = e^{jω}, `angle` in rad a tick.
pub fn at_angle(polynomial: &[f64], angle: f64) -> Complex<f64> {
    polynomial.iter().enumerate().map(|(power, c)| Complex::from_polar(*c, -angle * power as f64)).sum()
}

/// Output of `numerator / denominator`; before the first sample the input was `input[0]` for ever.
///
/// The denominator must be stable (see [`is_stable`]) and start with 1.
pub fn filter(numerator: &[f64], denominator: &[f64], input: &[f64]) -> Vec<f64> {
    let first = input.first().copied().unwrap_or_default();
    let rest = first * at_one(numerator) / at_one(denominator);
    let mut output: Vec<f64> = Vec::with_capacity(input.len());
    for tick in 0..input.len() {
        let mut value = 0.0;
        for (lag, c) in numerator.iter().enumerate() {
            value += c * if lag <= tick { input[tick - lag] } else { first };
        }
        for (lag, c) in denominator.iter().enumerate().skip(1) {
            value -= c * if lag <= tick { output[tick - lag] } else { rest };
        }
        output.push(value);
    }
    output
}

/// The signal `ticks` later; before its start it had its first value.
pub fn delayed(signal: &[f64], ticks: usize) -> Vec<f64> {
    let first = signal.first().copied().unwrap_or_default();
    std::iter::repeat_n(first, ticks.min(signal.len())).chain(signal.iter().copied()).take(signal.len()).collect()
}

/// Whether all poles lie inside the unit circle (Schur-Cohn recursion).
pub fn is_stable(denominator: &[f64]) -> bool {
    let mut a = denominator.to_vec();
    while a.len() > 1 {
        let last = a.len() - 1;
        let reflection = a[last] / a[0];
        if reflection.is_nan() || reflection.abs() >= 1.0 {
            return false;
        }
        a = (0..last).map(|i| a[i] - reflection * a[last - i]).collect();
    }
    true
}

/// Roots in z of `c0 zⁿ + c1 zⁿ⁻¹ + …`, by falling magnitude: eigenvalues of the companion matrix. Leading zeros are dropped; a
/// constant has no root.
pub fn roots(polynomial: &[f64]) -> Vec<Complex<f64>> {
    let start = polynomial.iter().position(|c| *c != 0.0).unwrap_or(polynomial.len());
    let Some((leading, rest)) = polynomial[start..].split_first() else { return Vec::new() };
    // Roots at zero are exact, and a companion matrix with them converges badly.
    let zeros = rest.iter().rev().take_while(|c| **c == 0.0).count();
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Coefficients from real roots.
    fn with_roots(roots: &[f64]) -> Vec<f64> {
        roots.iter().fold(vec![1.0], |polynomial, root| {
            let mut product = vec![0.0; polynomial.len() + 1];
            for (power, c) in polynomial.iter().enumerate() {
                product[power] += c;
                product[power + 1] -= root * c;
            }
            product
        })
    }

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
            let polynomial: Vec<f64> = std::iter::once(1.0).chain(tail).collect();
            for root in roots(&polynomial) {
                let value = polynomial.iter().fold(Complex::new(0.0, 0.0), |value, c| value * root + c);
                prop_assert!(value.norm() < 1e-6 * (1.0 + root.norm().powi(polynomial.len() as i32)));
            }
        }

        #[test]
        fn roots_come_back_and_decide_stability(mut wanted in proptest::collection::vec(-1.8f64..1.8, 1..4)) {
            wanted.sort_by(f64::total_cmp);
            prop_assume!(wanted.windows(2).all(|pair| pair[1] - pair[0] > 0.05));
            prop_assume!(wanted.iter().all(|root| (root.abs() - 1.0).abs() > 1e-3));
            let polynomial = with_roots(&wanted);
            let mut found: Vec<f64> = roots(&polynomial).iter().map(|root| root.re).collect();
            found.sort_by(f64::total_cmp);
            for (wanted, found) in wanted.iter().zip(&found) {
                prop_assert!((wanted - found).abs() < 1e-6);
            }
            prop_assert_eq!(is_stable(&polynomial), wanted.iter().all(|root| root.abs() < 1.0));
        }

        #[test]
        fn a_filter_undoes_its_inverse_and_keeps_a_constant(pole in -0.9f64..0.9, zero in -0.9f64..0.9, level in -5.0f64..5.0) {
            let (b, a) = ([1.0, -zero], [1.0, -pole]);
            let input: Vec<f64> = (0..40).map(|tick| level + f64::from(tick % 7)).collect();
            for (there, back) in input.iter().zip(filter(&a, &b, &filter(&b, &a, &input))) {
                prop_assert!((there - back).abs() < 1e-9);
            }
            let still = filter(&b, &a, &[level; 20]);
            prop_assert!(still.iter().all(|value| (value - level * (1.0 - zero) / (1.0 - pole)).abs() < 1e-9));
        }
    }
}
