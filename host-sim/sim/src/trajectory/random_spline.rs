//! Training signal: a spline of random control points.

use super::{Motion, PiecewisePolynomial};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

/// Settings of the random spline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SplineSettings {
    /// Time between control points, s.
    pub interval: f64,
    /// Largest speed, m/s.
    pub max_speed: f64,
    /// Largest acceleration, m/s².
    pub max_acceleration: f64,
    /// Sides of the box in which the control points lie, m, before it is shrunk to keep the limits.
    pub size: [f64; 3],
    /// Altitude of the box's centre, m; the box must lie above the ground.
    pub altitude: f64,
}

impl Default for SplineSettings {
    /// The strokes' room and a little more than their limits.
    fn default() -> Self {
        Self { interval: 0.7, max_speed: 1.7, max_acceleration: 4.5, size: [5.0, 5.0, 2.4], altitude: 1.7 }
    }
}

/// A quintic spline of random control points, uniform in a box, that begins and ends at rest in its centre. The box is
/// shrunk (never enlarged) until speed and acceleration keep the limits. It lasts at least `duration` seconds, less
/// than one interval more.
///
/// # Panics
/// When a setting or the duration is not positive and finite.
#[must_use]
pub fn random_spline(seed: u64, duration: f64, settings: &SplineSettings) -> Motion {
    let s = settings;
    let positive = [duration, s.interval, s.max_speed, s.max_acceleration];
    assert!(positive.iter().all(|x| x.is_finite() && *x > 0.0), "random spline settings");
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let count = (duration / s.interval).ceil() as usize;
    // `count` pieces need five more control points; the first and last five are the centre.
    let offsets: Vec<[f64; 3]> = (0..count + 5)
        .map(|index| {
            let point = s.size.map(|side| side * random.random_range(-0.5..0.5));
            if index < 5 || index >= count { [0.0; 3] } else { point }
        })
        .collect();
    let spline = |scale: f64| {
        let place = |p: &[f64; 3]| [p[0] * scale, p[1] * scale, s.altitude + p[2] * scale];
        let controls: Vec<[f64; 3]> = offsets.iter().map(place).collect();
        let spline = PiecewisePolynomial::b_spline(&controls, s.interval).expect("at least six control points");
        Motion::new(format!("spline:{seed}"), spline)
    };
    let (speed, acceleration) = spline(1.0).peaks(s.interval / 40.0);
    let excess = (speed / s.max_speed).max(acceleration / s.max_acceleration);
    spline(if excess > 0.999 { 0.999 / excess } else { 1.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_kept_and_one_is_reached() {
        let settings = SplineSettings::default();
        for seed in 0..3 {
            let spline = random_spline(seed, 60.0, &settings).sampled(100.0).expect("rate");
            let speed = spline.peak_speed() / settings.max_speed;
            let acceleration = spline.peak_acceleration() / settings.max_acceleration;
            assert!(speed <= 1.0 && acceleration <= 1.0);
            assert!(speed.max(acceleration) > 0.99);
            assert!((60.0..60.8).contains(&spline.drawn_seconds()));
            assert!(spline.samples.iter().all(|s| s.position[2] > 0.4));
        }
    }

    #[test]
    fn even_the_shortest_is_finite() {
        let spline = random_spline(1, 0.1, &SplineSettings::default());
        assert!(spline.at(0.05).is_finite());
    }
}
