//! Discrete algebraic Riccati equation.
//!
//! in: dynamics with one input, state weight, input weight; out: the stabilising solution and its gain; never: a gain whose
//! equation is not solved; source: structure-preserving doubling algorithm (Chu, Fan, Lin, Wang 2004, International
//! Journal of Control 77), X = A'XA - A'XB (R + B'XB)^-1 B'XA + Q.

use nalgebra::{DMatrix, DVector, RowDVector};

/// Solution of the Riccati equation for one input.
#[derive(Clone, Debug)]
pub struct RiccatiSolution {
    /// Optimal feedback: `u = -gain * x`.
    pub gain: RowDVector<f64>,
    /// Cost-to-go matrix X.
    pub cost: DMatrix<f64>,
    /// Frobenius norm of the equation's residual relative to that of X.
    pub residual: f64,
}

/// Doublings after which a solvable equation has converged: 2^40 steps of the recursion.
const DOUBLINGS: usize = 40;

/// Solves the equation for `x(k+1) = dynamics x + input u` and the cost `x' state_weight x + input_weight u^2`.
///
/// Returns nothing when the recursion meets a singular matrix, does not converge, or leaves a residual above 1e-6: then
/// (dynamics, input) cannot be stabilised, or not in this arithmetic.
pub fn solve(
    dynamics: &DMatrix<f64>,
    input: &DVector<f64>,
    state_weight: &DMatrix<f64>,
    input_weight: f64,
) -> Option<RiccatiSolution> {
    let size = dynamics.nrows();
    let mut transition = dynamics.clone();
    let mut control = input * input.transpose() / input_weight;
    let mut cost = state_weight.clone();
    let mut converged = false;
    for _ in 0..DOUBLINGS {
        let factor = (DMatrix::identity(size, size) + &control * &cost).lu();
        let next_transition = factor.solve(&transition)?;
        let next_control = factor.solve(&control)?;
        let growth = transition.transpose() * &cost * &next_transition;
        control += &transition * next_control * transition.transpose();
        transition = &transition * next_transition;
        cost += &growth;
        // Both are symmetric; rounding must not be allowed to say otherwise, it would be doubled too.
        symmetrise(&mut control);
        symmetrise(&mut cost);
        if !cost.norm().is_finite() {
            return None;
        }
        if growth.norm() <= 1e-14 * cost.norm() {
            converged = true;
            break;
        }
    }
    let (gain, residual) = gain_and_residual(dynamics, input, state_weight, input_weight, &cost);
    (converged && residual < 1e-6).then_some(RiccatiSolution { gain, cost, residual })
}

fn gain_and_residual(
    dynamics: &DMatrix<f64>,
    input: &DVector<f64>,
    state_weight: &DMatrix<f64>,
    input_weight: f64,
    cost: &DMatrix<f64>,
) -> (RowDVector<f64>, f64) {
    let cost_of_input = input.transpose() * cost;
    let curvature = input_weight + (&cost_of_input * input)[0];
    let gain: RowDVector<f64> = &cost_of_input * dynamics / curvature;
    let right = dynamics.transpose() * cost * dynamics - gain.transpose() * &gain * curvature + state_weight;
    (gain, (right - cost).norm() / cost.norm())
}

fn symmetrise(matrix: &mut DMatrix<f64>) {
    *matrix = (&*matrix + matrix.transpose()) * 0.5;
}

/// Largest absolute eigenvalue, by repeated squaring (Gelfand's formula), exact to about 1e-6.
///
/// One product of matrices a step: at a hundred states far cheaper than all eigenvalues.
pub fn spectral_radius(matrix: &DMatrix<f64>) -> f64 {
    let mut power = matrix.clone();
    let mut logarithm = 0.0;
    let mut weight = 1.0;
    let mut previous = f64::INFINITY;
    for _ in 0..32 {
        let norm = power.norm();
        if norm == 0.0 {
            return 0.0;
        }
        if !norm.is_finite() {
            return f64::INFINITY;
        }
        logarithm += weight * norm.ln();
        if (logarithm - previous).abs() < 1e-7 {
            break;
        }
        previous = logarithm;
        power /= norm;
        power = &power * &power;
        weight *= 0.5;
    }
    logarithm.exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scalar_equation_has_its_known_solution() {
        // x = a²x - a²b²x²/(r + b²x) + q with a = 1.2, b = 0.5, q = 1, r = 2, as a quadratic in x.
        let (a, b, q, r) = (1.2_f64, 0.5_f64, 1.0, 2.0);
        let (square, linear, constant) = (b * b, r - a * a * r - q * b * b, -q * r);
        let expected = (-linear + (linear * linear - 4.0 * square * constant).sqrt()) / (2.0 * square);
        let one = |value: f64| DMatrix::from_element(1, 1, value);
        let solution = solve(&one(a), &DVector::from_element(1, b), &one(q), r).unwrap();
        assert!((solution.cost[0] - expected).abs() < 1e-10 * expected);
        assert!((a - b * solution.gain[0]).abs() < 1.0);
    }

    #[test]
    fn what_cannot_be_stabilised_has_no_solution() {
        let dynamics = DMatrix::from_diagonal(&DVector::from_vec(vec![1.1, 0.5]));
        let input = DVector::from_vec(vec![0.0, 1.0]);
        assert!(solve(&dynamics, &input, &DMatrix::identity(2, 2), 1.0).is_none());
    }

    #[test]
    fn spectral_radius_of_rotation_shift_and_growth() {
        let rotation = DMatrix::from_row_slice(2, 2, &[0.6, 0.75, -0.75, 0.6]);
        assert!((spectral_radius(&rotation) - 0.6_f64.hypot(0.75)).abs() < 1e-6);
        let shift = DMatrix::from_fn(30, 30, |row, column| if row == column + 1 { 1.0 } else { 0.0 });
        assert_eq!(spectral_radius(&shift), 0.0);
        let growing = DMatrix::from_row_slice(2, 2, &[1.001, 500.0, 0.0, 0.2]);
        assert!((spectral_radius(&growing) - 1.001).abs() < 1e-5);
    }
}
