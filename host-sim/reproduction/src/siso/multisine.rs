//! Sums of sines at random frequencies: signals to train on, and others of the same kind to test with.
//!
//! *in* a band, a number of tones, a seed; *out* a signal; *never* a tone outside of the band.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A sum of tones and a constant.
#[derive(Clone, Debug, PartialEq)]
pub struct Multisine {
    /// Amplitude, frequency in Hz, phase in rad.
    pub tones: Vec<[f64; 3]>,
    /// The constant.
    pub offset: f64,
}

impl Multisine {
    /// `count` tones, frequencies drawn evenly on a logarithmic scale from `band` (Hz), amplitudes up to `amplitude`, a constant up to
    /// `offset`.
    pub fn random(count: usize, band: [f64; 2], amplitude: f64, offset: f64, seed: u64) -> Self {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let [low, high] = band.map(libm::log);
        let mut between = |from: f64, to: f64| from + (to - from) * random.random::<f64>();
        let tones = (0..count)
            .map(|_| [between(0.2 * amplitude, amplitude), libm::exp(between(low, high)), between(0.0, std::f64::consts::TAU)])
            .collect();
        Self { tones, offset: between(-offset, offset) }
    }

    /// The signal at `seconds`.
    pub fn at(&self, seconds: f64) -> f64 {
        let tones = self
            .tones
            .iter()
            .map(|[amplitude, frequency, phase]| amplitude * libm::sin(std::f64::consts::TAU * frequency * seconds + phase));
        self.offset + tones.sum::<f64>()
    }

    /// The signal risen smoothly from zero at 0 s, in `rise` s.
    pub fn risen(&self, seconds: f64, rise: f64) -> f64 {
        smooth_step(seconds / rise) * self.at(seconds)
    }
}

/// 0 up to 0, 1 from 1 on, between them the polynomial of least jerk.
pub fn smooth_step(share: f64) -> f64 {
    let s = share.clamp(0.0, 1.0);
    s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tones_stay_in_their_band_and_the_seed_decides() {
        let signal = |seed| Multisine::random(30, [0.1, 2.0], 1.0, 0.5, seed);
        assert!(signal(4).tones.iter().all(|tone| (0.1..=2.0).contains(&tone[1]) && tone[0] <= 1.0));
        assert_eq!(signal(4), signal(4));
        assert_ne!(signal(4), signal(5));
        assert_eq!((signal(4).risen(0.0, 1.0), signal(4).risen(1.0, 1.0)), (0.0, signal(4).at(1.0)));
    }
}
