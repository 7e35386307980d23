//! Transfer functions in discrete time: of a channel that was identified, or of a system that is known.

use nalgebra::Complex;
use serde::Serialize;

use crate::polynomial::{at_angle, at_one, delayed, filter, roots};

/// y(t) = q⁻ᵈ B(q⁻¹)/F(q⁻¹) u(t) + offset.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TransferFunction {
    /// Dead time d in ticks: the relative degree in z if `numerator[0]` is not zero.
    pub dead_time: usize,
    /// B, in rising powers of q⁻¹ (falling ones of z).
    pub numerator: Vec<f64>,
    /// F, in rising powers of q⁻¹, first 1, stable.
    pub denominator: Vec<f64>,
    /// Output at zero input.
    pub offset: f64,
}

/// Lowest frequency at which a bandwidth is looked for, as a share of half the rate, and steps from there.
const SLOWEST: f64 = 1e-5;
const BANDWIDTH_STEPS: u32 = 400;
/// Steps in which a phase is followed.
const PHASE_STEPS: u32 = 24;

impl TransferFunction {
    /// Output for an input that had its first value for ever before.
    pub fn simulate(&self, input: &[f64]) -> Vec<f64> {
        let mut output = filter(&self.numerator, &self.denominator, &delayed(input, self.dead_time));
        output.iter_mut().for_each(|value| *value += self.offset);
        output
    }

    /// Order of the denominator.
    pub fn order(&self) -> usize {
        self.denominator.len() - 1
    }

    /// Steady-state gain.
    pub fn gain(&self) -> f64 {
        at_one(&self.numerator) / at_one(&self.denominator)
    }

    /// Finite zeros.
    pub fn zeros(&self) -> Vec<Complex<f64>> {
        roots(&self.numerator)
    }

    /// Poles.
    pub fn poles(&self) -> Vec<Complex<f64>> {
        roots(&self.denominator)
    }

    /// Response to a unit step at tick 0, without the offset.
    pub fn step_response(&self, ticks: usize) -> Vec<f64> {
        // The filter thinks that a signal had its first value for ever: the step comes a tick later.
        let input: Vec<f64> = std::iter::once(0.0).chain(std::iter::repeat_n(1.0, ticks)).collect();
        let response = filter(&self.numerator, &self.denominator, &delayed(&input, self.dead_time));
        response.into_iter().skip(1).collect()
    }

    /// Answer to a sine; `angle` in rad a tick.
    pub fn response(&self, angle: f64) -> Complex<f64> {
        at_angle(&self.numerator, angle) / at_angle(&self.denominator, angle)
            * Complex::from_polar(1.0, -angle * self.dead_time as f64)
    }

    /// Ticks until the step response stays within 2 % of its range round the end, at most 2,000.
    pub fn settling(&self) -> usize {
        let slowest = self.poles().iter().map(|pole| pole.norm()).fold(0.0, f64::max);
        let horizon = (self.dead_time as f64 + 10.0 + 6.0 / -slowest.clamp(1e-3, 0.9999).ln()).min(2000.0) as usize;
        let response = self.step_response(horizon);
        let gain = self.gain();
        let range = response.iter().map(|value| value.abs()).fold(gain.abs(), f64::max);
        response.iter().rposition(|value| (value - gain).abs() > 0.02 * range).map_or(1, |tick| tick + 1)
    }

    /// First tick from 1 on at which the step response is `share` of the gain in size; the horizon if there is none.
    pub fn first_above(&self, share: f64, horizon: usize) -> usize {
        let bound = share * self.gain().abs();
        let response = self.step_response(horizon + 1);
        response.iter().skip(1).position(|value| value.abs() >= bound).map_or(horizon, |tick| tick + 1)
    }

    /// Lowest frequency, in rad a tick, at which the answer has fallen by 3 dB against standing still; π if it never does.
    pub fn bandwidth(&self) -> f64 {
        let bound = self.gain().abs() * std::f64::consts::FRAC_1_SQRT_2;
        let below = |angle: f64| self.response(angle).norm() < bound;
        // Even steps of the logarithm: a loop may be a thousand times slower than its log.
        let steps = (0..=BANDWIDTH_STEPS)
            .map(|step| std::f64::consts::PI * SLOWEST.powf(1.0 - f64::from(step) / f64::from(BANDWIDTH_STEPS)));
        let mut before = 0.0;
        for angle in steps {
            if below(angle) {
                let (mut low, mut high) = (before, angle);
                for _ in 0..30 {
                    let middle = 0.5 * (low + high);
                    if below(middle) { high = middle } else { low = middle }
                }
                return high;
            }
            before = angle;
        }
        std::f64::consts::PI
    }

    /// By how many ticks a sine arrives later; `angle` in rad a tick. Not its group delay: what one sees who lays one curve over
    /// the other.
    pub fn phase_delay(&self, angle: f64) -> f64 {
        let at = |angle: f64| at_angle(&self.numerator, angle) / at_angle(&self.denominator, angle);
        // In steps, none of which is half a turn: the angle of a complex number does not tell whole turns.
        let (mut phase, mut before) = (0.0, at(1e-6 * angle));
        for step in 1..=PHASE_STEPS {
            let now = at(angle * f64::from(step) / f64::from(PHASE_STEPS));
            phase += (now / before).arg();
            before = now;
        }
        self.dead_time as f64 - phase / angle
    }

    /// Lag at low frequency in ticks: how much later a slow signal arrives. (Group delay at ω = 0.)
    pub fn lag(&self) -> f64 {
        let moment = |polynomial: &[f64]| {
            let weighted: f64 = polynomial.iter().enumerate().map(|(power, c)| power as f64 * c).sum();
            weighted / at_one(polynomial)
        };
        self.dead_time as f64 + moment(&self.numerator) - moment(&self.denominator)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_first_system_has_its_zero_gain_and_degree() {
        let system =
            TransferFunction { dead_time: 1, numerator: vec![1.0, -0.2], denominator: vec![1.0, -0.8, 0.15], offset: 0.0 };
        assert!((system.gain() - 16.0 / 7.0).abs() < 1e-12);
        assert!((system.zeros()[0].re - 0.2).abs() < 1e-12);
        let response = system.step_response(60);
        assert_eq!((response[0], response[1]), (0.0, 1.0));
        assert!((response[59] - 16.0 / 7.0).abs() < 1e-9);
        assert_eq!(system.first_above(0.1, 20), 1);
        // A slow ramp arrives `lag` ticks late.
        let ramp: Vec<f64> = (0..200).map(f64::from).collect();
        assert!((199.0 - system.simulate(&ramp)[199] / system.gain() - system.lag()).abs() < 1e-6);
    }
}
