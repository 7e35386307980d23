//! Sums of sines at random frequencies: signals to train on, and others of the same kind to test with.
//!
//! *in* a band, a number of tones, a seed; *out* a signal; *never* a tone outside of the band; *source* the tones and the smooth
//! step are those of the trajectories, here for one dimensionless signal.

use impromptu_sim::trajectory::tones::{self, Tone, smooth_step};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

/// A sum of tones and a constant.
#[derive(Clone, Debug, PartialEq)]
pub struct Multisine {
    /// The sines, in time.
    pub tones: Vec<Tone>,
    /// The constant.
    pub offset: f64,
}

impl Multisine {
    /// `count` tones, frequencies drawn evenly on a logarithmic scale from `band` (Hz), amplitudes up to `amplitude`, a constant
    /// up to `offset`.
    pub fn random(count: usize, band: [f64; 2], amplitude: f64, offset: f64, seed: u64) -> Self {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let [low, high] = band.map(libm::log);
        let mut between = |from: f64, to: f64| from + (to - from) * random.random::<f64>();
        let tones = (0..count).map(|_| Tone {
            amplitude: between(0.2 * amplitude, amplitude),
            rate: TAU * libm::exp(between(low, high)),
            phase: between(0.0, TAU),
        });
        Self { tones: tones.collect(), offset: between(-offset, offset) }
    }

    /// The signal at `seconds`.
    pub fn at(&self, seconds: f64) -> f64 {
        self.offset + tones::sum(&self.tones, seconds)[0]
    }

    /// The signal risen smoothly from zero at 0 s, in `rise` s.
    pub fn risen(&self, seconds: f64, rise: f64) -> f64 {
        smooth_step(seconds / rise)[0] * self.at(seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tones_stay_in_their_band_and_the_seed_decides() {
        let signal = |seed| Multisine::random(30, [0.1, 2.0], 1.0, 0.5, seed);
        assert!(signal(4).tones.iter().all(|tone| (0.1..=2.0).contains(&(tone.rate / TAU)) && tone.amplitude <= 1.0));
        assert_eq!(signal(4), signal(4));
        assert_ne!(signal(4), signal(5));
        assert_eq!((signal(4).risen(0.0, 1.0), signal(4).risen(1.0, 1.0)), (0.0, signal(4).at(1.0)));
    }
}
