//! A closed loop as it looks from outside: a delay and a second-order lag, identified from its log.
//!
//! *in* reference and output, evenly sampled; *out* five parameters, and the output of other references; *never* a step of the
//! search that fits worse; *source* output-error identification (Ljung, System Identification, 1999): the model runs freely
//! beside the log, it is not corrected by it at every sample, for that is how it is used afterwards.

use nalgebra::{DMatrix, DVector};

/// y″ = ω² (g r(t-d) - y) + 2 ζ ω (β r′(t-d) - y′).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lag {
    /// ω, rad/s.
    pub frequency: f64,
    /// ζ.
    pub damping: f64,
    /// g, the DC gain.
    pub gain: f64,
    /// β, the share of the reference's velocity that is fed forward.
    pub feed_forward: f64,
    /// d, s.
    pub delay: f64,
}

/// An evenly sampled log of one axis.
#[derive(Clone, Copy, Debug)]
pub struct Axis<'a> {
    /// m.
    pub reference: &'a [f64],
    /// m.
    pub output: &'a [f64],
}

const SUBSTEPS: usize = 4;
const ITERATIONS: usize = 30;

/// A sampled signal between its samples; held beyond its ends.
pub fn interpolate(samples: &[f64], position: f64) -> f64 {
    let last = samples.len().saturating_sub(1);
    let position = position.clamp(0.0, last as f64);
    let index = position as usize;
    let at = |index: usize| samples.get(index.min(last)).copied().unwrap_or(0.0);
    at(index) + (at(index + 1) - at(index)) * (position - index as f64)
}

impl Lag {
    /// Where the search starts.
    const START: Self = Self { frequency: 3.0, damping: 0.7, gain: 1.0, feed_forward: 0.1, delay: 0.1 };

    fn parameters(&self) -> DVector<f64> {
        DVector::from_column_slice(&[self.frequency, self.damping, self.gain, self.feed_forward, self.delay])
    }

    fn of(parameters: &DVector<f64>) -> Self {
        Self {
            frequency: parameters[0].clamp(0.2, 30.0),
            damping: parameters[1].clamp(0.05, 5.0),
            gain: parameters[2],
            feed_forward: parameters[3],
            delay: parameters[4].clamp(0.0, 1.0),
        }
    }

    /// The output for a reference sampled every `period` s, starting at `start` with velocity `velocity`.
    pub fn output(&self, reference: &[f64], period: f64, start: f64, velocity: f64) -> Vec<f64> {
        let step = period / SUBSTEPS as f64;
        let delay = self.delay / period;
        let (mut y, mut v) = (start, velocity);
        let mut output = Vec::with_capacity(reference.len());
        for sample in 0..reference.len() {
            output.push(y);
            for substep in 0..SUBSTEPS {
                let position = sample as f64 + substep as f64 / SUBSTEPS as f64 - delay;
                let wanted = interpolate(reference, position);
                let slope = (interpolate(reference, position + 0.5) - interpolate(reference, position - 0.5)) / period;
                let acceleration = self.frequency * self.frequency * (self.gain * wanted - y)
                    + 2.0 * self.damping * self.frequency * (self.feed_forward * slope - v);
                v += acceleration * step;
                y += v * step;
            }
        }
        output
    }

    /// The model's own run beside a log, from the log's start.
    pub fn beside(&self, axis: &Axis<'_>, period: f64) -> Vec<f64> {
        let at = |index: usize| axis.output.get(index).copied().unwrap_or(0.0);
        self.output(axis.reference, period, at(0), (at(1) - at(0)) / period)
    }

    fn residuals(&self, axes: &[Axis<'_>], period: f64) -> DVector<f64> {
        let runs = axes.iter().flat_map(|axis| {
            let run = self.beside(axis, period);
            run.into_iter().zip(axis.output).map(|(model, measured)| model - measured).collect::<Vec<_>>()
        });
        DVector::from_vec(runs.collect())
    }

    /// The model whose free runs lie closest to the logs, by Levenberg-Marquardt.
    pub fn identify(axes: &[Axis<'_>], period: f64) -> Self {
        let mut best = Self::START;
        let mut residual = best.residuals(axes, period);
        let mut damping = 1e-2;
        for _ in 0..ITERATIONS {
            let parameters = best.parameters();
            let columns: Vec<DVector<f64>> = (0..parameters.len())
                .map(|index| {
                    let mut moved = parameters.clone();
                    moved[index] += 1e-4;
                    (Self::of(&moved).residuals(axes, period) - &residual) / 1e-4
                })
                .collect();
            let jacobian = DMatrix::from_columns(&columns);
            let gram = jacobian.tr_mul(&jacobian);
            let gradient = jacobian.tr_mul(&residual);
            let mut improved = false;
            while !improved && damping < 1e6 {
                let mut damped = gram.clone();
                for index in 0..gram.nrows() {
                    damped[(index, index)] += damping * gram[(index, index)].max(1e-9);
                }
                let Some(step) = damped.cholesky().map(|factor| factor.solve(&gradient)) else { break };
                let candidate = Self::of(&(&parameters - step));
                let tried = candidate.residuals(axes, period);
                improved = tried.norm_squared() < residual.norm_squared() * (1.0 - 1e-9);
                if improved {
                    (best, residual) = (candidate, tried);
                    damping *= 0.3;
                } else {
                    damping *= 4.0;
                }
            }
            if !improved {
                break;
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parameters_of_a_loop_are_found_from_its_log() {
        let truth = Lag { frequency: 2.4, damping: 0.55, gain: 0.97, feed_forward: 0.3, delay: 0.17 };
        let reference: Vec<f64> =
            (0..900).map(|i| libm::sin(f64::from(i) * 0.05) + 0.4 * libm::sin(f64::from(i) * 0.13)).collect();
        let output = truth.output(&reference, 0.04, 0.0, 0.0);
        let found = Lag::identify(&[Axis { reference: &reference, output: &output }], 0.04);
        let difference = (found.parameters() - truth.parameters()).amax();
        assert!(difference < 0.02, "{found:?}");
    }

    #[test]
    fn between_samples_a_signal_is_straight_and_beyond_them_it_holds() {
        let samples = [1.0, 3.0, 2.0];
        assert_eq!([-4.0, 0.5, 1.0, 9.0].map(|position| interpolate(&samples, position)), [1.0, 2.0, 3.0, 2.0]);
        assert_eq!(interpolate(&[], 1.0), 0.0);
    }
}
