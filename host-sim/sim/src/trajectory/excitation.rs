//! Training signals made of tones: the multisine, the three growing tones and the single tone.
//!
//! - in: a seed or amplitudes and periods;
//! - out: a motion that rises smoothly from rest at the centre and comes back to it;
//! - never: more than the stated peak of speed and acceleration (multisine), nor below the stated floor;
//! - source: Li et al. 2017 (three tones, amplitude growing 0.045 m per 15 s). The multisine is this project's own: one sine
//!   for each axis ruins training, twelve with incommensurate periods do not.

use super::tones::{self, Tone, product, window};
use super::{Curve, Motion, Sample};
use libm::pow;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Lowest altitude of a training signal, m.
const FLOOR: f64 = 0.5;

/// Settings of the multisine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MultisineSettings {
    /// Tones on each axis.
    pub tones: usize,
    /// Shortest and longest period, s.
    pub periods: [f64; 2],
    /// Peak speed over the whole signal, m/s.
    pub max_speed: f64,
    /// Peak acceleration over the whole signal, m/s².
    pub max_acceleration: f64,
    /// Relative amplitude of x, y and z.
    pub axis_weights: [f64; 3],
    /// Time of the smooth rise from rest and of the fall, s.
    pub fade: f64,
    /// Altitude of the centre, m; raised where the signal would come below 0.5 m.
    pub altitude: f64,
    /// Peak heading, rad: 0 keeps the nose still, otherwise six tones with periods of 8 to 30 s.
    pub yaw: f64,
}

impl Default for MultisineSettings {
    /// A little beyond the test strokes, whose inputs must lie inside what the model was trained on.
    fn default() -> Self {
        Self {
            tones: 12,
            periods: [1.5, 20.0],
            max_speed: 1.7,
            max_acceleration: 4.5,
            axis_weights: [1.0, 1.0, 0.7],
            fade: 3.0,
            altitude: 1.5,
            yaw: 0.0,
        }
    }
}

/// Sums of tones under a window.
#[derive(Clone)]
struct Tones {
    axes: [Vec<Tone>; 3],
    yaw: Vec<Tone>,
    centre: [f64; 3],
    duration: f64,
    fade: f64,
    /// Amplitude at the beginning and its growth a second.
    gain: [f64; 2],
}

impl Curve for Tones {
    fn duration(&self) -> f64 {
        self.duration
    }

    fn at(&self, seconds: f64) -> Sample {
        let [gain, growth] = self.gain;
        let envelope = product(window(seconds, self.duration, self.fade), [gain + growth * seconds, growth, 0.0]);
        let mut sample = Sample { yaw: envelope[0] * tones::sum(&self.yaw, seconds)[0], ..Sample::default() };
        for axis in 0..3 {
            let [value, first, second] = product(envelope, tones::sum(&self.axes[axis], seconds));
            sample.position[axis] = self.centre[axis] + value;
            sample.velocity[axis] = first;
            sample.acceleration[axis] = second;
        }
        sample
    }
}

impl Tones {
    /// Raises the centre until nothing is below the floor.
    fn above_floor(mut self) -> Self {
        let steps = (self.duration / GRID).ceil() as usize;
        let lowest = (0..=steps).map(|i| self.at((i as f64 * GRID).min(self.duration)).position[2]).fold(f64::MAX, f64::min);
        self.centre[2] += (FLOOR - lowest).max(0.0);
        self
    }
}

/// Grid on which peaks are found, s: thirty points in the shortest period of the default settings.
const GRID: f64 = 0.05;

/// Twelve tones (by default) on each axis with random phases and jittered, logarithmically spaced periods, `duration`
/// seconds long. The amplitudes go with a power of the period, chosen such that both peaks, of speed and of
/// acceleration, are reached (to 1 %); where no power between -0.5 and 2 does that, only the tighter one is.
///
/// # Panics
/// When the settings make no signal: no tones, or a duration, period, fade, peak or weight that is not positive (z's
/// weight may be 0), or a duration shorter than two fades.
#[must_use]
pub fn multisine(seed: u64, duration: f64, settings: &MultisineSettings) -> Motion {
    let s = settings;
    let positive = [s.periods[0], s.periods[1] - s.periods[0], s.max_speed, s.max_acceleration];
    assert!(s.tones > 0 && positive.iter().all(|x| x.is_finite() && *x > 0.0), "multisine settings");
    assert!(s.fade > 0.0 && duration >= 2.0 * s.fade && s.axis_weights[0] > 0.0, "multisine settings");
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut tones = |count: usize, [shortest, longest]: [f64; 2]| -> Vec<Tone> {
        (0..count)
            .map(|index| {
                let place = (index as f64 + random.random_range(0.0..1.0)) / count as f64;
                Tone {
                    amplitude: 1.0,
                    rate: TAU / (shortest * pow(longest / shortest, place)),
                    phase: random.random_range(0.0..TAU),
                }
            })
            .collect()
    };
    let flat = Tones {
        axes: std::array::from_fn(|_| tones(s.tones, s.periods)),
        yaw: tones(6, [8.0, 30.0]),
        centre: [0.0, 0.0, s.altitude],
        duration,
        fade: s.fade,
        gain: [1.0, 0.0],
    };
    let shaped = |power: f64| {
        let mut shaped = flat.clone();
        for (axis, weight) in shaped.axes.iter_mut().zip(s.axis_weights) {
            axis.iter_mut().for_each(|t| t.amplitude = weight * pow(t.rate, -power));
        }
        let peaks = Motion::new("", shaped.clone()).peaks(GRID);
        (shaped, peaks)
    };
    // The steeper the spectrum, the less acceleration for the same speed.
    let (mut low, mut high) = (-0.5, 2.0);
    for _ in 0..12 {
        let middle = 0.5 * (low + high);
        let (_, (speed, acceleration)) = shaped(middle);
        if acceleration / speed > s.max_acceleration / s.max_speed {
            low = middle;
        } else {
            high = middle;
        }
    }
    let (mut signal, (speed, acceleration)) = shaped(0.5 * (low + high));
    // Between the points of the grid a peak can be a little higher, hence half a percent.
    let scale = 0.995 * (s.max_speed / speed).min(s.max_acceleration / acceleration);
    for tone in signal.axes.iter_mut().flatten() {
        tone.amplitude *= scale;
    }
    let count = signal.yaw.len() as f64;
    signal.yaw.iter_mut().for_each(|tone| tone.amplitude = s.yaw / count);
    Motion::new(format!("multisine:{seed}"), signal.above_floor())
}

/// The predecessor's training signal (Li et al. 2017): one sine an axis whose amplitude grows by 0.045 m every 15 s, here
/// steadily instead of in steps; 400 s there. The periods (s, x y z) are the caller's.
///
/// # Panics
/// When the periods are not positive or the duration is shorter than 6 s.
#[must_use]
pub fn growing_tones(periods: [f64; 3], duration: f64) -> Motion {
    assert!(duration >= 6.0 && periods.iter().all(|p| *p > 0.0), "periods are positive, 6 s at least");
    let signal = Tones {
        axes: periods.map(|period| vec![tone(1.0, period)]),
        yaw: Vec::new(),
        centre: [0.0, 0.0, 1.5],
        duration,
        fade: 3.0,
        gain: [0.0, 0.045 / 15.0],
    };
    Motion::new("tones", signal.above_floor())
}

/// One sine along one axis (0, 1, 2: x, y, z): amplitude m, period s, faded in and out over a period each.
///
/// # Panics
/// When the axis is above 2, the period not positive or the duration shorter than two periods.
#[must_use]
pub fn single_tone(axis: usize, amplitude: f64, period: f64, duration: f64) -> Motion {
    assert!(axis < 3 && period > 0.0 && duration >= 2.0 * period, "axis 0 to 2, two periods at least");
    let mut axes: [Vec<Tone>; 3] = std::array::from_fn(|_| Vec::new());
    axes[axis].push(tone(amplitude, period));
    let signal = Tones { axes, yaw: Vec::new(), centre: [0.0, 0.0, 1.5], duration, fade: period, gain: [1.0, 0.0] };
    Motion::new("tone", signal.above_floor())
}

/// A hover.
///
/// # Panics
/// When it is shorter than two seconds.
#[must_use]
pub fn hover(duration: f64) -> Motion {
    single_tone(2, 0.0, 1.0, duration).named("hover")
}

fn tone(amplitude: f64, period: f64) -> Tone {
    Tone { amplitude, rate: TAU / period, phase: 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn multisine_reaches_both_peaks_and_stays_above_the_floor() {
        let settings = MultisineSettings { yaw: 0.5, ..MultisineSettings::default() };
        for seed in 0..3 {
            let signal = multisine(seed, 90.0, &settings).sampled(100.0).expect("rate");
            let (speed, acceleration) = (signal.peak_speed(), signal.peak_acceleration());
            assert!(speed <= settings.max_speed && acceleration <= settings.max_acceleration);
            assert!(speed > 0.97 * settings.max_speed, "{speed}");
            assert!(acceleration > 0.97 * settings.max_acceleration, "{acceleration}");
            assert!(signal.samples.iter().all(|s| s.position[2] > 0.49 && s.yaw.abs() <= 0.5));
            assert!(signal.samples.iter().any(|s| s.yaw.abs() > 0.1));
        }
    }

    #[test]
    fn growing_tones_grow_as_stated() {
        let signal = growing_tones([6.0, 7.5, 9.0], 400.0);
        let largest = |from: f64| (0..600).map(|i| signal.at(from + f64::from(i) * 0.01).position[0].abs()).fold(0.0, f64::max);
        assert!((largest(303.0) / largest(153.0) - 2.0).abs() < 0.05);
        assert!((largest(297.0) - 0.003 * 300.0).abs() < 0.01);
    }
}
