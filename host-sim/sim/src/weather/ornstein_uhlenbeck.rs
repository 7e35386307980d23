//! Noise with memory: the stationary Gaussian process whose correlation decays exponentially.

use rand::RngExt;
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use super::error::{WeatherError, require};

/// Three independent Ornstein-Uhlenbeck processes, one for each world axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OrnsteinUhlenbeck {
    /// Stationary standard deviation along x, y and z, in the unit of the quantity; 0 switches an axis off.
    pub sigma: [f64; 3],
    /// Time after which the correlation has fallen to 1/e, s.
    pub correlation_time: f64,
}

impl Default for OrnsteinUhlenbeck {
    /// Nothing.
    fn default() -> Self {
        Self { sigma: [0.0; 3], correlation_time: 1.0 }
    }
}

impl OrnsteinUhlenbeck {
    /// Whether it is zero for ever.
    pub(super) fn is_still(&self) -> bool {
        self.sigma == [0.0; 3]
    }

    pub(super) fn check(&self, field: &'static str) -> Result<(), WeatherError> {
        let sigma = self.sigma.iter().all(|value| value.is_finite() && *value >= 0.0);
        require(sigma, field, "of finite sigma, zero or positive")?;
        let time = self.correlation_time;
        require(time.is_finite() && time > 0.0, field, "of positive correlation_time (s)")
    }
}

/// The running process. Its discretisation is exact: value' = decay value + sigma sqrt(1 - decay²) normal, with
/// decay = exp(-tick / correlation time), and the first value is drawn from the stationary distribution.
#[derive(Debug, Clone)]
pub(super) struct Process {
    decay: f64,
    gain: [f64; 3],
    value: [f64; 3],
    random: Xoshiro256PlusPlus,
}

impl Process {
    pub(super) fn new(settings: &OrnsteinUhlenbeck, tick: f64, mut random: Xoshiro256PlusPlus) -> Self {
        let ratio = tick / settings.correlation_time;
        let spread = (-libm::expm1(-2.0 * ratio)).sqrt();
        Self {
            decay: libm::exp(-ratio),
            gain: settings.sigma.map(|sigma| sigma * spread),
            value: settings.sigma.map(|sigma| scaled_normal(sigma, &mut random)),
            random,
        }
    }

    pub(super) fn value(&self) -> [f64; 3] {
        self.value
    }

    pub(super) fn advance(&mut self) {
        for (value, gain) in self.value.iter_mut().zip(self.gain) {
            *value = self.decay * *value + scaled_normal(gain, &mut self.random);
        }
    }
}

/// A normal number of that standard deviation; nothing is drawn for zero.
fn scaled_normal(sigma: f64, random: &mut Xoshiro256PlusPlus) -> f64 {
    if sigma == 0.0 { 0.0 } else { sigma * random.sample::<f64, _>(StandardNormal) }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    fn process(tick: f64, seed: u64) -> Process {
        let settings = OrnsteinUhlenbeck { sigma: [0.12, 0.0, 2.0], correlation_time: 0.4 };
        Process::new(&settings, tick, Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    #[test]
    fn variance_and_correlation_time_are_those_that_were_set_at_any_tick() {
        for tick in [0.01, 0.1] {
            let mut process = process(tick, 11);
            let values: Vec<[f64; 3]> = (0..400_000)
                .map(|_| {
                    process.advance();
                    process.value()
                })
                .collect();
            let lag = (0.4_f64 / tick).round() as usize;
            for (axis, sigma) in [(0, 0.12), (2, 2.0)] {
                let count = (values.len() - lag) as f64;
                let pairs = values.iter().zip(&values[lag..]);
                let variance = values.iter().map(|value| value[axis].powi(2)).sum::<f64>() / values.len() as f64;
                let covariance = pairs.map(|(a, b)| a[axis] * b[axis]).sum::<f64>() / count;
                assert!((variance / (sigma * sigma) - 1.0).abs() < 0.06, "{variance}");
                let correlation = covariance / variance;
                assert!((correlation - (-1.0_f64).exp()).abs() < 0.04, "{correlation}");
            }
            assert!(values.iter().all(|value| value[1] == 0.0));
        }
    }

    #[test]
    fn it_starts_in_its_stationary_distribution() {
        let starts = (0..20_000).map(|seed| process(0.01, seed).value()[2].powi(2));
        let variance = starts.sum::<f64>() / 20_000.0;
        assert!((variance / 4.0 - 1.0).abs() < 0.05, "{variance}");
    }
}
