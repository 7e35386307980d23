//! Closed and spatial shapes flown by a clock that starts and stops smoothly, and the star.

use super::pen::{self, Pace};
use super::tones::{self, Tone, smooth_step, smooth_step_integral};
use super::{Curve, Motion, Sample};
use libm::{cos, sin};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Altitude of the shapes' centres, m.
const ALTITUDE: f64 = 1.5;
/// Time from rest to full speed and back, s.
const RAMP_SECONDS: f64 = 2.0;

/// A shape whose coordinates are sums of sinusoids and a linear term of one angle, and the clock that turns the angle.
struct Shape {
    tones: [Vec<Tone>; 3],
    centre: [f64; 3],
    /// Climb for each radian, m/rad.
    climb: f64,
    /// Angle a second at full speed, rad/s.
    rate: f64,
    /// Time that the whole shape takes at full speed, s.
    cruise: f64,
    /// Time from rest to full speed, s, at most `cruise`.
    ramp: f64,
}

impl Shape {
    /// Angle and its first two derivatives: the rate grows along a quintic step, so that acceleration is continuous.
    fn angle(&self, seconds: f64) -> [f64; 3] {
        let rising = |t: f64| {
            let x = t / self.ramp;
            if x >= 1.0 {
                return [t - self.ramp / 2.0, 1.0, 0.0];
            }
            let [rate, slope, _] = smooth_step(x);
            [self.ramp * smooth_step_integral(x.max(0.0)), rate, slope / self.ramp]
        };
        let half = self.duration() / 2.0;
        let [phase, rate, slope] = if seconds <= half {
            rising(seconds)
        } else {
            let [phase, rate, slope] = rising(self.duration() - seconds);
            [self.cruise - phase, rate, -slope]
        };
        [phase * self.rate, rate * self.rate, slope * self.rate]
    }
}

impl Curve for Shape {
    fn duration(&self) -> f64 {
        self.cruise + self.ramp
    }

    fn at(&self, seconds: f64) -> Sample {
        let [angle, rate, slope] = self.angle(seconds);
        let mut sample = Sample::default();
        for axis in 0..3 {
            let [mut value, mut first, second] = tones::sum(&self.tones[axis], angle);
            if axis == 2 {
                value += self.climb * angle;
                first += self.climb;
            }
            sample.position[axis] = self.centre[axis] + value;
            sample.velocity[axis] = first * rate;
            sample.acceleration[axis] = second * rate * rate + first * slope;
        }
        sample
    }
}

/// A shape from its sinusoids (amplitude m, whole-number rate, phase rad), seconds a lap and laps.
fn shape(name: &str, tones: [&[(f64, f64, f64)]; 3], period: f64, laps: f64) -> Shape {
    assert!(period > 0.0 && laps > 0.0 && (period * laps).is_finite(), "{name}: period and laps are positive");
    let tones = tones.map(|list| {
        let tone = |&(amplitude, rate, phase): &(f64, f64, f64)| Tone { amplitude, rate, phase };
        list.iter().map(tone).collect()
    });
    Shape {
        tones,
        centre: [0.0, 0.0, ALTITUDE],
        climb: 0.0,
        rate: TAU / period,
        cruise: period * laps,
        ramp: RAMP_SECONDS.min(period * laps),
    }
}

/// Horizontal circle: radius m, seconds a lap, laps. Speed at full rate is 2π radius / period.
///
/// # Panics
/// This and the other shapes: when the period or the number of laps is not positive and finite.
#[must_use]
pub fn circle(radius: f64, period: f64, laps: f64) -> Motion {
    let xy: [&[_]; 3] = [&[(radius, 1.0, FRAC_PI_2)], &[(radius, 1.0, 0.0)], &[]];
    Motion::new("circle", shape("circle", xy, period, laps))
}

/// Horizontal figure-8, `width` m along x and `height` m along y.
#[must_use]
pub fn figure_eight(width: f64, height: f64, period: f64, laps: f64) -> Motion {
    let xy: [&[_]; 3] = [&[(width / 2.0, 1.0, 0.0)], &[(height / 2.0, 2.0, 0.0)], &[]];
    Motion::new("figure8", shape("figure8", xy, period, laps))
}

/// Lissajous curve: size m (whole width in x, y, z) and whole numbers of swings a lap.
#[must_use]
pub fn lissajous(size: [f64; 3], swings: [u32; 3], period: f64, laps: f64) -> Motion {
    let [x, y, z]: [[(f64, f64, f64); 1]; 3] = std::array::from_fn(|axis| [(size[axis] / 2.0, f64::from(swings[axis]), 0.0)]);
    Motion::new("lissajous", shape("lissajous", [&x, &y, &z], period, laps))
}

/// Helix round the z axis that climbs `climb` m each turn, its middle at the shapes' altitude.
#[must_use]
pub fn helix(radius: f64, climb: f64, period: f64, turns: f64) -> Motion {
    let xy: [&[_]; 3] = [&[(radius, 1.0, FRAC_PI_2)], &[(radius, 1.0, 0.0)], &[]];
    let mut helix = shape("helix", xy, period, turns);
    helix.climb = climb / TAU;
    // However high it climbs, it begins half a metre above the ground at least.
    helix.centre[2] = (ALTITUDE - climb * turns / 2.0).max(0.5 - (climb * turns).min(0.0));
    Motion::new("helix", helix)
}

/// Trefoil knot, `size` m across and a quarter of that high.
#[must_use]
pub fn trefoil(size: f64, period: f64, laps: f64) -> Motion {
    let unit = size / 6.0;
    let xyz: [&[_]; 3] = [
        &[(unit, 1.0, 0.0), (2.0 * unit, 2.0, 0.0)],
        &[(unit, 1.0, FRAC_PI_2), (-2.0 * unit, 2.0, FRAC_PI_2)],
        &[(-0.75 * unit, 3.0, 0.0)],
    ];
    Motion::new("trefoil", shape("trefoil", xyz, period, laps))
}

/// Horizontal star with rounded corners: number of points, outer radius m, inner radius as a part of the outer one
/// (a regular polygon's corners lie at cos(π / points)), drawn once with curvature-limited speed.
///
/// # Panics
/// With fewer than 3 points or a radius that is not positive.
#[must_use]
pub fn star(points: u32, radius: f64, inner: f64, pace: Pace) -> Motion {
    assert!(points >= 3 && radius > 0.0, "a star has 3 points and a positive radius");
    let corner = |index: u32| {
        let angle = TAU * f64::from(index) / f64::from(2 * points);
        let reach = if index.is_multiple_of(2) { radius } else { radius * inner };
        [reach * cos(angle), reach * sin(angle), ALTITUDE]
    };
    let corners: Vec<[f64; 3]> = (0..=2 * points).map(corner).collect();
    let path = pen::rounded(&corners, 0.05 * radius);
    Motion::new("star", pen::drawn(&path, pace))
}
