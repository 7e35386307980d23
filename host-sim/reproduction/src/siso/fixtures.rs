//! The systems and the test trajectory of Zhou 2017, section V, and a loop of unit DC gain.

use crate::siso::StateSpace;

/// Sampling period that reproduces the paper's figures, s; the paper states none.
pub const PERIOD: f64 = 0.01;
/// Length of the paper's test, s.
pub const TEST_TIME: f64 = 60.0;

fn system(a: &[f64], b: &[f64], c: &[f64]) -> StateSpace {
    StateSpace::new(a, b, c).unwrap_or_else(|error| unreachable!("a fixture: {error}"))
}

/// Equation (9): poles 0.3 and 0.5, zero 0.2, DC gain 16/7.
pub fn minimum_phase() -> StateSpace {
    system(&[0.0, 1.0, -0.15, 0.8], &[0.0, 1.0], &[-0.2, 1.0])
}

/// Equation (10): the same poles, zero 1.002, DC gain -18/7.
pub fn non_minimum_phase() -> StateSpace {
    system(&[0.0, 1.0, -0.15, 0.8], &[0.0, 1.0], &[-450.9, 450.0])
}

/// Poles of [`minimum_phase`] and a DC gain of choice in the coordinates of Lemma 1: x₁ = y, and x₂ = y(t+1) - y(t) is zero in
/// steady state. The relative degree is 2.
pub fn position_and_difference(dc_gain: f64) -> StateSpace {
    // y(t+2) = 0.8 y(t+1) - 0.15 y(t) + 0.35 K₀ u(t), with y(t+1) = x₁ + x₂.
    system(&[1.0, 1.0, -0.35, -0.2], &[0.0, 0.35 * dc_gain], &[1.0, 0.0])
}

/// The test trajectory sin(2πt/15) + cos(2πt/12) - 1 at `seconds`; zero before the start, as the loop is at rest then.
pub fn test_trajectory(seconds: f64) -> f64 {
    if seconds <= 0.0 {
        return 0.0;
    }
    libm::sin(std::f64::consts::TAU * seconds / 15.0) + libm::cos(std::f64::consts::TAU * seconds / 12.0) - 1.0
}

/// Samples of the paper's test at a period.
pub fn test_samples(period: f64) -> usize {
    (TEST_TIME / period).round() as usize
}
