//! Loops made from a seed, whose relative degree, zeros, gain and noise are known.
//!
//! Classes in turn, by the index: minimum phase or not, gain one or not, relative degree 1 to 6. From the seed: two or three
//! poles (real ones at 0.3 to 0.85, pairs of radius 0.4 to 0.8), a zero at -0.7 to 0.85, or outside: a real one at 1.04 to 1.6,
//! or a pair of radius 1.06 to 1.4 (which shows no reversal of a lone zero's kind); gains of 0.35 to 0.8 or 1.25 to 2.5, of
//! either sign; white noise of 0.3 to 3 % and a slow disturbance of 0.2 to 2 % of the output's RMS; steps of random height held
//! for 3 to 20 ticks, or twelve tones with a small dither.

use impromptu_diagnosis::{Record, transfer_function::TransferFunction};
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::{Distribution as _, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A known loop.
pub(crate) struct Known {
    pub(crate) model: TransferFunction,
    pub(crate) minimum_phase: bool,
    pub(crate) unit_gain: bool,
    white: f64,
    slow: f64,
    steps: bool,
    level: f64,
}

/// Ticks of 20 ms.
pub(crate) const PERIOD: f64 = 0.02;

pub(crate) fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut result = vec![0.0; a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            result[i + j] += x * y;
        }
    }
    result
}

fn pair(radius: f64, angle: f64) -> Vec<f64> {
    vec![1.0, -2.0 * radius * angle.cos(), radius * radius]
}

impl Known {
    /// The loop of an index and a seed.
    pub(crate) fn new(index: usize, seed: u64) -> Self {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let (minimum_phase, unit_gain) = (index.is_multiple_of(2), (index / 2).is_multiple_of(2));
        let mut uniform = |low: f64, high: f64| random.random_range(low..high);
        let mut denominator = if uniform(0.0, 1.0) < 0.5 {
            product(&[1.0, -uniform(0.3, 0.85)], &[1.0, -uniform(0.3, 0.85)])
        } else {
            pair(uniform(0.4, 0.8), uniform(0.1, 0.8))
        };
        if uniform(0.0, 1.0) < 0.4 {
            denominator = product(&denominator, &[1.0, -uniform(0.1, 0.6)]);
        }
        let numerator = match (minimum_phase, (index / 4).is_multiple_of(2)) {
            (true, _) => vec![1.0, -uniform(-0.7, 0.85)],
            (false, true) => vec![1.0, -uniform(1.04, 1.6)],
            (false, false) => pair(uniform(1.06, 1.4), uniform(0.2, 1.0)),
        };
        let gain = match (unit_gain, uniform(0.0, 1.0) < 0.5) {
            (true, _) => 1.0,
            (false, true) => uniform(0.35, 0.8),
            (false, false) => uniform(1.25, 2.5),
        };
        let sign = if !unit_gain && uniform(0.0, 1.0) < 0.25 { -1.0 } else { 1.0 };
        let scale = sign * gain * denominator.iter().sum::<f64>() / numerator.iter().sum::<f64>();
        let model = TransferFunction {
            dead_time: 1 + (index + index / 6) % 6,
            numerator: numerator.iter().map(|c| c * scale).collect(),
            denominator,
            offset: uniform(-0.5, 0.5),
        };
        let (white, slow) = (uniform(0.003, 0.03), uniform(0.002, 0.02));
        let mut known = Self { model, minimum_phase, unit_gain, white, slow, steps: !index.is_multiple_of(3), level: 1.0 };
        let quiet = known.model.simulate(&known.signal(3000, seed ^ 0xabcd));
        let mean = quiet.iter().sum::<f64>() / quiet.len() as f64;
        known.level = (quiet.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / quiet.len() as f64).sqrt();
        known
    }

    /// References of this loop's kind.
    pub(crate) fn signal(&self, ticks: usize, seed: u64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        if self.steps {
            let mut signal = Vec::new();
            while signal.len() < ticks {
                let (height, held) = (random.random_range(-1.0..1.0), random.random_range(3..20));
                signal.extend(std::iter::repeat_n(height, held));
            }
            signal.truncate(ticks);
            return signal;
        }
        let tones: Vec<[f64; 3]> = (0..12)
            .map(|tone| {
                let angle = 0.01 * 150f64.powf((f64::from(tone) + random.random_range(0.0..1.0)) / 12.0);
                [angle, random.random_range(0.0..std::f64::consts::TAU), 0.3 / (1.0 + 3.0 * angle)]
            })
            .collect();
        (0..ticks)
            .map(|tick| {
                let sum: f64 = tones.iter().map(|[angle, phase, size]| size * (angle * tick as f64 + phase).sin()).sum();
                sum + if random.random::<bool>() { 0.03 } else { -0.03 }
            })
            .collect()
    }

    /// What is measured when the loop is given references.
    pub(crate) fn measured(&self, references: &[f64], seed: u64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let mut drift = self.slow * normal();
        let drive = self.slow * (1.0f64 - 0.95 * 0.95).sqrt();
        let mut output = self.model.simulate(references);
        for value in &mut output {
            drift = 0.95 * drift + drive * normal();
            *value += self.level * (drift + self.white * normal());
        }
        output
    }

    /// A log of that length.
    pub(crate) fn record(&self, ticks: usize, seed: u64) -> Record {
        let time: Vec<f64> = (0..ticks).map(|tick| tick as f64 * PERIOD).collect();
        let reference = self.signal(ticks, seed);
        let measured = self.measured(&reference, seed ^ 0x5eed);
        Record::new(&time, &reference, &measured).unwrap()
    }
}
