//! The feedback lane of one axis as numbers: the linear map that the firmware stores and evaluates.
//!
//! in: a Riccati gain, or the two gains of a PD; out: coefficients in storage order; never: a coefficient whose sign or
//! order depends on who made it.

use nalgebra::{Complex, RowDVector};
use serde::{Deserialize, Serialize};

/// Linear map from lagged tracking errors, the lane's own past outputs and an integral to the lane's output.
///
/// At tick `k`, with `e(k)` = measured - desired at the time of the measurement,
///
/// `u(k) = sum error_coefficients[i] . e(k-i) + sum past_output_coefficients[i] u(k-1-i) + integral_coefficient I(k)`,
///
/// and after that `I(k+1) = I(k) + tick e_p(k)`. The `u` in the sums is what was really applied, after all clamps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LaneGain {
    /// `[lag][channel]`, newest first; channel 0 is position (m per m), channel 1 velocity (m per m/s).
    pub error_coefficients: Vec<[f64; 2]>,
    /// `[lag - 1]`, the output of the tick before first.
    pub past_output_coefficients: Vec<f64>,
    /// Metres per metre second of the integral of the position error.
    pub integral_coefficient: f64,
}

impl LaneGain {
    /// Proportional-derivative feedback on the position reference, the one-lag case: `u = -(kp e_p + kd e_v)`, `kd` in s.
    pub fn pd(kp: f64, kd: f64) -> Self {
        Self { error_coefficients: vec![[-kp, -kd]], past_output_coefficients: Vec::new(), integral_coefficient: 0.0 }
    }

    /// From a gain of `u = -gain x` on a state as [`super::error_model::ErrorModel`] orders it.
    pub(super) fn from_state_feedback(gain: &RowDVector<f64>, lags: usize) -> Self {
        let negative = |first: usize, index: usize| -gain[first + index];
        Self {
            error_coefficients: (0..lags).map(|lag| [negative(0, lag), negative(lags, lag)]).collect(),
            past_output_coefficients: (0..lags - 1).map(|lag| negative(2 * lags, lag)).collect(),
            integral_coefficient: negative(3 * lags - 1, 0),
        }
    }

    /// The same map on the state of an error model of `lags` lags, which must be no fewer than [`Self::lags`].
    pub(super) fn state_feedback(&self, lags: usize) -> RowDVector<f64> {
        let mut gain = RowDVector::zeros(3 * lags);
        for (lag, [position, velocity]) in self.error_coefficients.iter().enumerate() {
            gain[lag] = -position;
            gain[lags + lag] = -velocity;
        }
        for (lag, coefficient) in self.past_output_coefficients.iter().enumerate() {
            gain[2 * lags + lag] = -coefficient;
        }
        gain[3 * lags - 1] = -self.integral_coefficient;
        gain
    }

    /// Ticks that the lane looks back, the present one included.
    pub fn lags(&self) -> usize {
        self.error_coefficients.len().max(self.past_output_coefficients.len() + 1)
    }

    /// Stored numbers, which are the multiply-adds of one tick.
    pub fn coefficient_count(&self) -> usize {
        2 * self.error_coefficients.len() + self.past_output_coefficients.len() + 1
    }

    /// Coefficients in the order of the model file: the position error's lags, the velocity error's lags, then as many lags of
    /// the lane's own output (the oldest of which is zero), each newest first.
    pub fn stored_coefficients(&self) -> Vec<f64> {
        let lags = self.lags();
        let channel = |index: usize| self.error_coefficients.iter().map(move |pair| pair[index]);
        let mut stored = Vec::with_capacity(3 * lags);
        stored.extend(channel(0));
        stored.resize(lags, 0.0);
        stored.extend(channel(1));
        stored.resize(2 * lags, 0.0);
        stored.extend(&self.past_output_coefficients);
        stored.resize(3 * lags, 0.0);
        stored
    }

    /// What the integral contributes to a constant output without error: `u = sum past u + integral_coefficient I` solved
    /// for u. The firmware splits this share off as the slow part, whose clamp is its own; infinite when the
    /// past-output coefficients add up to 1.
    pub fn steady_integral_coefficient(&self) -> f64 {
        self.integral_coefficient / (1.0 - self.past_output_coefficients.iter().sum::<f64>())
    }

    /// Frequency response from the errors (position, velocity) to the output, past outputs and integral included.
    pub(super) fn response(&self, z: Complex<f64>, tick: f64) -> [Complex<f64>; 2] {
        let delay = z.inv();
        let sum = |channel: usize| {
            self.error_coefficients.iter().rev().fold(Complex::new(0.0, 0.0), |sum, pair| sum * delay + pair[channel])
        };
        let past = polynomial(&self.past_output_coefficients, delay) * delay;
        let mut position = sum(0);
        if self.integral_coefficient != 0.0 {
            position += self.integral_coefficient * tick / (z - 1.0);
        }
        [position / (1.0 - past), sum(1) / (1.0 - past)]
    }
}

/// `sum coefficients[i] delay^i`.
pub(super) fn polynomial(coefficients: &[f64], delay: Complex<f64>) -> Complex<f64> {
    coefficients.iter().rev().fold(Complex::new(0.0, 0.0), |sum, coefficient| sum * delay + coefficient)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn state_feedback_and_storage_order_are_inverse() {
        let gain = RowDVector::from_fn(12, |_, index| index as f64 + 1.0);
        let lane = LaneGain::from_state_feedback(&gain, 4);
        assert_eq!(lane.error_coefficients[1], [-2.0, -6.0]);
        assert_eq!(lane.past_output_coefficients, [-9.0, -10.0, -11.0]);
        assert_eq!(lane.integral_coefficient, -12.0);
        assert_eq!(lane.state_feedback(4), gain);
        assert_eq!(lane.coefficient_count(), 12);
        let stored = [-1.0, -2.0, -3.0, -4.0, -5.0, -6.0, -7.0, -8.0, -9.0, -10.0, -11.0, 0.0];
        assert_eq!(lane.stored_coefficients(), stored);
        assert_eq!(lane.steady_integral_coefficient(), -12.0 / 31.0);
        assert_eq!(LaneGain::pd(1.0, 0.4).stored_coefficients(), [-1.0, -0.4, 0.0]);
    }

    #[test]
    fn a_pd_is_one_lag_and_responds_alike_at_all_frequencies() {
        let lane = LaneGain::pd(1.0, 0.4);
        assert_eq!(lane.lags(), 1);
        for angle in [0.01_f64, 1.0, 3.0] {
            let [position, velocity] = lane.response(Complex::from_polar(1.0, angle), 0.01);
            assert_eq!((position, velocity), (Complex::new(-1.0, 0.0), Complex::new(-0.4, 0.0)));
        }
    }
}
