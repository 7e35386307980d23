//! Training signals: 25 sinusoids.
//!
//! *in* the sampling period; *out* references, sample by sample; *never* a tone above half of the sampling rate, where it would
//! be another one; *source* Zhou 2017, section V-A: amplitudes 1 to 5 and five frequencies, every combination.

use serde::{Deserialize, Serialize};

/// A sine that starts at zero.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tone {
    /// Amplitude.
    pub amplitude: f64,
    /// Hz.
    pub frequency: f64,
}

/// The paper's amplitudes.
pub const AMPLITUDES: [f64; 5] = [1.0, 2.0, 3.0, 4.0, 5.0];
/// The paper's frequencies, Hz.
pub const FREQUENCIES: [f64; 5] = [0.024, 0.032, 0.048, 0.091, 1.0];

impl Tone {
    /// The tone at a sample, with `period` s between samples.
    pub fn at(&self, sample: i64, period: f64) -> f64 {
        self.amplitude * libm::sin(std::f64::consts::TAU * self.frequency * sample as f64 * period)
    }

    /// Samples of one cycle, at least `least`.
    pub fn samples(&self, period: f64, least: usize) -> usize {
        ((1.0 / (self.frequency * period)).ceil() as usize).max(least)
    }
}

/// The paper's 25 tones.
pub fn tones() -> Vec<Tone> {
    AMPLITUDES.iter().flat_map(|&amplitude| FREQUENCIES.map(|frequency| Tone { amplitude, frequency })).collect()
}
