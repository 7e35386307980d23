//! Beyond the paper: feed-forward of a loop whose inverse is unstable, from a window of the desired output alone.
//!
//! *in* a system, or runs of it; *out* weights of y_d(t + offset); *never* anything fed back: the reference is bounded by the
//! window's [`Window::gain`] times the largest |y_d|; *source* an unstable zero has a stable inverse that looks ahead without end
//! (Devasia, Chen and Paden 1996), which a finite preview cuts off; zero-phase tracking is Tomizuka's (1987); learning the window
//! from logs is Zhou 2017's training with other features.
//!
//! u(t) is regressed on y(t + offset) of runs of the loop, as the paper trains. The loop is linear and commutes with shifts, so
//! the error which that minimises is the tracking error for desired outputs of the spectrum of the references in the runs: no
//! more is to be learned from the law.

use crate::siso::{LinearMap, Module, Moment, Rows, Run, StateSpace};

/// u(t) = Σ weight · y_d(t + offset).
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// Offsets in samples and their weights.
    pub taps: Vec<(i64, f64)>,
}

impl Window {
    /// The static gain: y_d(t) over the DC gain.
    pub fn static_inverse(system: &StateSpace) -> Self {
        Self { taps: vec![(0, 1.0 / system.dc_gain())] }
    }

    /// The stable inverse of a system with a single zero, outside of the unit circle, cut off after `preview` samples. `None` for
    /// other systems.
    pub fn truncated_inverse(system: &StateSpace, preview: usize) -> Option<Self> {
        let transfer = system.transfer_function();
        let &[first, second] = transfer.numerator.as_slice() else { return None };
        let zero = -second / first;
        if zero.abs() <= 1.0 {
            return None;
        }
        let order = transfer.order();
        let mut weights = vec![0.0; preview + 1];
        // 1/(z - zero) = -(zero⁻¹ + zero⁻² z + zero⁻³ z² + …), which converges on the unit circle.
        for (lag, coefficient) in transfer.denominator.iter().enumerate() {
            let mut weight = -coefficient / (first * zero);
            for value in weights.iter_mut().skip(order - lag) {
                *value += weight;
                weight /= zero;
            }
        }
        Some(Self { taps: (0..).zip(weights).collect() })
    }

    /// Zero-phase-error tracking control for a system all of whose zeros are taken as uninvertible: the phase of the loop is
    /// gone, the gain is right at zero frequency.
    pub fn zero_phase(system: &StateSpace) -> Self {
        let transfer = system.transfer_function();
        let order = transfer.order() as i64;
        let sum: f64 = transfer.numerator.iter().sum();
        let degree = transfer.numerator.len() as i64 - 1;
        let mut weights = std::collections::BTreeMap::new();
        for (lag, pole) in (0..).zip(&transfer.denominator) {
            for (zero_lag, zero) in (0..).zip(&transfer.numerator) {
                *weights.entry(order - lag - (degree - zero_lag)).or_insert(0.0) += pole * zero / (sum * sum);
            }
        }
        Self { taps: weights.into_iter().collect() }
    }

    /// Learned from runs of the loop: u(t) regressed on y(t + offset), every `stride` samples; `penalty` as in
    /// [`LinearMap::fit`]. `None` if the runs do not determine it.
    pub fn learn(runs: &[Run<f64>], offsets: &[i64], stride: usize, penalty: f64) -> Option<Self> {
        let (first, last) = (offsets.iter().copied().min()?.min(0), offsets.iter().copied().max()?.max(0));
        let mut rows = Vec::new();
        for run in runs {
            let samples = run.output.len() as i64;
            for sample in (-first..samples - last).step_by(stride.max(1)) {
                let inputs = offsets.iter().map(|offset| run.output[(sample + offset) as usize]).collect();
                rows.push((inputs, run.reference[sample as usize]));
            }
        }
        let map = LinearMap::fit(&Rows::new(&rows), penalty)?;
        Some(Self { taps: offsets.iter().copied().zip(map.weights.iter().copied()).collect() })
    }

    /// Σ |weight|: no bounded y_d gives a reference larger than this times its largest value.
    pub fn gain(&self) -> f64 {
        self.taps.iter().map(|tap| tap.1.abs()).sum()
    }
}

impl Module<f64> for Window {
    fn reference(&self, moment: &Moment<'_, f64>) -> f64 {
        self.taps.iter().map(|(offset, weight)| weight * moment.desired(*offset)).sum()
    }
}

/// Offsets of a window that is dense where the inverse changes fast, and half as dense where it decays: from half a second of
/// past to `preview` samples ahead. `period` is the sampling period, s.
pub fn offsets(preview: i64, period: f64) -> Vec<i64> {
    let samples = |seconds: f64| (seconds / period).round().max(1.0) as i64;
    let mut offsets = vec![-samples(0.5), -samples(0.25), 0];
    let mut offset = 0;
    while offset < preview {
        let step = if offset < samples(10.0) { 0.25 } else { 0.5 };
        offset = (offset + samples(step)).min(preview);
        offsets.push(offset);
    }
    offsets
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::siso::{Start, fixtures, multisine::Multisine, simulate};

    #[test]
    fn a_long_preview_inverts_the_non_minimum_phase_loop_and_a_short_one_loses_what_the_zero_says() {
        let system = fixtures::non_minimum_phase();
        let desired = |sample: i64| if sample < 0 { 0.0 } else { libm::sin(sample as f64 * 0.01) };
        for (preview, samples) in [(6_000, 14_000), (500, 14_000)] {
            let window = Window::truncated_inverse(&system, preview).unwrap();
            // The loop starts before the trajectory does.
            let run = simulate(&system, &window, &|sample| desired(sample - 6_500), &Start::rest(), samples);
            let rms = run.tracking_rms(6_500);
            let expected = libm::pow(1.002, -(preview as f64)) * libm::sqrt(0.5);
            assert!((rms / expected - 1.0).abs() < 0.1, "{preview}: {rms:e}, {expected:e}");
        }
        assert!(Window::truncated_inverse(&fixtures::minimum_phase(), 9).is_none());
    }

    #[test]
    fn zero_phase_tracking_is_exact_at_rest() {
        let system = fixtures::non_minimum_phase();
        for window in [Window::zero_phase(&system), Window::static_inverse(&system)] {
            let run = simulate(&system, &window, &|_| 2.0, &Start::rest(), 400);
            assert!((run.output[399] - 2.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_window_learned_from_runs_is_bounded_and_tracks_a_signal_it_never_saw() {
        let system = fixtures::non_minimum_phase();
        let runs: Vec<_> = (0..12)
            .map(|seed| {
                let signal = Multisine::random(8, [0.01, 0.3], 1.0, 2.0, seed);
                let module = move |moment: &Moment<'_, f64>| signal.risen(moment.sample as f64 * 0.01, 10.0);
                simulate(&system, &module, &|_| 0.0, &Start::rest(), 9_000)
            })
            .collect();
        let window = Window::learn(&runs, &offsets(2_000, 0.01), 20, 1e-4).unwrap();
        let test = |sample: i64| fixtures::test_trajectory((sample - 2_000) as f64 * 0.01);
        let learned = simulate(&system, &window, &test, &Start::rest(), 8_000);
        let plain = simulate(&system, &|moment: &Moment<'_, f64>| moment.desired(0), &test, &Start::rest(), 8_000);
        assert!(learned.tracking_rms(2_000) < 0.1 * plain.tracking_rms(2_000));
        assert!(learned.reference.iter().all(|value| value.abs() <= 3.0 * window.gain()));
    }
}
