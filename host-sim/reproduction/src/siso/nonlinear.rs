//! Plants that are no linear system: one whose exact law is known, and one whose relative degree and gain depend on the region.
//!
//! *in* a state and a reference; *out* the next state; *never* a gain D(x) of zero inside of a region; *source* Zhou 2017,
//! equations (2), (6) and (7): y(t+r) = ĥ(x) + D(x) u(t) gives u = (y_d(t+r) - ĥ(x)) / D(x). The plants are ours; the paper shows
//! none.

use crate::siso::{Module, Moment, Plant};

/// Relative degree 1, two states, stable zero dynamics (pole 0.6), a gain that varies with the hidden state by a factor of three.
///
/// x₁⁺ = 0.5 x₁ + 0.3 tanh x₂ + D(x) u, x₂⁺ = 0.4 x₁ + 0.6 x₂, y = x₁, D(x) = 0.3 + 0.15 cos x₂.
#[derive(Clone, Copy, Debug, Default)]
pub struct InputAffine;

impl InputAffine {
    /// ĥ(x).
    pub fn drift(state: &[f64]) -> f64 {
        0.5 * state[0] + 0.3 * libm::tanh(state[1])
    }

    /// D(x), 0.15 to 0.45.
    pub fn gain(state: &[f64]) -> f64 {
        0.3 + 0.15 * libm::cos(state[1])
    }
}

impl Plant<f64> for InputAffine {
    fn order(&self) -> usize {
        2
    }

    fn output(&self, state: &[f64]) -> f64 {
        state[0]
    }

    fn advance(&self, state: &mut [f64], reference: f64) {
        let next = Self::drift(state) + Self::gain(state) * reference;
        state[1] = 0.4 * state[0] + 0.6 * state[1];
        state[0] = next;
    }
}

/// The exact law of [`InputAffine`].
impl Module<f64> for InputAffine {
    fn reference(&self, moment: &Moment<'_, f64>) -> f64 {
        (moment.desired(1) - Self::drift(moment.state)) / Self::gain(moment.state)
    }
}

/// Below [`TwoRegions::BORDER`] the reference acts at once (r = 1, DC gain 1), above it through a delay and with more gain (r =
/// 2, DC gain 1.6); within ±[`TwoRegions::HALF_WIDTH`] of the border one becomes the other.
///
/// y⁺ = 0.7 y + 0.3 ((1 - s) u + 1.6 s w), w⁺ = u, s from 0 to 1.
#[derive(Clone, Copy, Debug, Default)]
pub struct TwoRegions;

impl TwoRegions {
    /// Output at the middle of the change.
    pub const BORDER: f64 = 1.0;
    /// Of the change.
    pub const HALF_WIDTH: f64 = 0.1;
    /// DC gain of the upper region.
    pub const UPPER_GAIN: f64 = 1.6;

    /// s.
    pub fn share(output: f64) -> f64 {
        (0.5 + 0.5 * (output - Self::BORDER) / Self::HALF_WIDTH).clamp(0.0, 1.0)
    }

    /// The exact law of the lower region.
    pub fn lower_law(moment: &Moment<'_, f64>) -> f64 {
        (moment.desired(1) - 0.7 * moment.state[0]) / 0.3
    }

    /// The exact law of the upper region.
    pub fn upper_law(moment: &Moment<'_, f64>) -> f64 {
        let gain = 0.3 * Self::UPPER_GAIN;
        (moment.desired(2) - 0.49 * moment.state[0] - 0.7 * gain * moment.state[1]) / gain
    }
}

impl Plant<f64> for TwoRegions {
    fn order(&self) -> usize {
        2
    }

    fn output(&self, state: &[f64]) -> f64 {
        state[0]
    }

    fn advance(&self, state: &mut [f64], reference: f64) {
        let share = Self::share(state[0]);
        state[0] = 0.7 * state[0] + 0.3 * ((1.0 - share) * reference + Self::UPPER_GAIN * share * state[1]);
        state[1] = reference;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::siso::{Start, fixtures, simulate};

    #[test]
    fn the_exact_laws_track_exactly() {
        let desired = |sample: i64| fixtures::test_trajectory(sample as f64 * 0.01);
        let run = simulate(&InputAffine, &InputAffine, &desired, &Start::rest(), 6_000);
        assert!(run.tracking_rms(0) < 1e-14, "{:e}", run.tracking_rms(0));
        let low = |sample: i64| 0.3 * libm::sin(sample as f64 * 0.02);
        let run = simulate(&TwoRegions, &TwoRegions::lower_law, &low, &Start::rest(), 2_000);
        assert!(run.tracking_rms(2) < 1e-14);
        let high = |sample: i64| 2.0 + low(sample);
        let start = Start { state: vec![2.0, 1.25], ..Start::rest() };
        let run = simulate(&TwoRegions, &TwoRegions::upper_law, &high, &start, 2_000);
        assert!(run.tracking_rms(3) < 1e-14);
    }

    #[test]
    fn the_relative_degree_changes_at_the_border() {
        let after = |output: f64, steps: usize, reference: f64| {
            let mut state = [output, 0.0];
            TwoRegions.advance(&mut state, reference);
            (1..steps).for_each(|_| TwoRegions.advance(&mut state, 0.0));
            state[0]
        };
        assert!(after(0.0, 1, 1.0) > after(0.0, 1, 0.0));
        assert_eq!(after(3.0, 1, 1.0), after(3.0, 1, 0.0));
        assert!(after(3.0, 2, 1.0) > after(3.0, 2, 0.0));
    }
}
