//! The pen: from a path in space to a motion along it with curvature-limited speed and bounded jerk.
//!
//! - in: a polyline and limits of speed and acceleration;
//! - out: a quintic spline in time that begins and ends at rest;
//! - never: more than the limits, measured on the spline itself;
//! - source: Li et al., ICRA 2017 (points at most 0.01 m apart, curvature-limited speed). Different here: the profile is
//!   smoothed in time as a hand does, so that the acceleration has no steps.

use super::Motion;
use super::piecewise::PiecewisePolynomial;
use super::sample::distance;
use libm::{cbrt, exp};

/// How fast a path is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    /// Largest speed, m/s.
    pub max_speed: f64,
    /// Largest acceleration along and across the path together, m/s².
    pub max_acceleration: f64,
    /// Speed in a bend of 1 m radius, m/s; elsewhere it goes with the cube root of the radius, as in human drawing
    /// (Lacquaniti, Terzuolo, Viviani 1983: the two-thirds power law).
    pub bend_speed: f64,
}

impl Default for Pace {
    /// A quick, accurate hand, inside the limits of the test strokes (1.28 m/s, 4.2 m/s²).
    fn default() -> Self {
        Self { max_speed: 1.28, max_acceleration: 4.2, bend_speed: 1.0 }
    }
}

/// Largest distance of the path's points, m (Li et al. 2017).
const POINT_SPACING: f64 = 0.01;
/// Spacing of the spline's control points, s.
const CONTROL_SECONDS: f64 = 0.05;
/// Standard deviation of the smoothing in time, s: passes 1 Hz with 83 %, 2 Hz with 46 %, 3 Hz with 17 % of the amplitude.
const HAND_SECONDS: f64 = 0.1;
/// Grid on which the spline's peaks are measured, s.
const PEAK_STEP: f64 = 0.01;

/// The motion along the path, slowed down as a whole where smoothing did not keep the limits.
pub(crate) fn drawn(path: &[[f64; 3]], pace: Pace) -> PiecewisePolynomial {
    let spline = |stretch: f64| {
        let controls = controls(path, pace);
        PiecewisePolynomial::b_spline(&controls, CONTROL_SECONDS * stretch)
            .expect("the padding alone gives more than six control points")
    };
    let (speed, acceleration) = Motion::new("", spline(1.0)).peaks(PEAK_STEP);
    // Between the grid's points a peak can be a little higher, hence 0.1 %.
    let stretch = (speed / pace.max_speed).max((acceleration / pace.max_acceleration).sqrt()) * 1.001;
    spline(stretch.max(1.0))
}

/// Control points in steps of [`CONTROL_SECONDS`], the first and last ones repeated so that the spline rests there.
fn controls(path: &[[f64; 3]], pace: Pace) -> Vec<[f64; 3]> {
    let (points, spacing) = resampled(path, POINT_SPACING);
    let speed = speed_profile(&points, spacing, pace);
    let mut times = vec![0.0];
    for pair in speed.windows(2) {
        // Speed grows with constant acceleration between two points; the floor is the first step from rest.
        let mean = ((pair[0] + pair[1]) / 2.0).max(1e-3);
        times.push(times[times.len() - 1] + spacing / mean);
    }
    let last = points.len() - 1;
    let sigma = HAND_SECONDS / CONTROL_SECONDS;
    // Smoothing reaches three sigma; beyond it the spline needs five equal control points to rest exactly.
    let padding = (3.0 * sigma).ceil() as usize + 4;
    let count = (times[last] / CONTROL_SECONDS).ceil() as usize;
    let mut timed = vec![points[0]; padding];
    let mut index = 0;
    for step in 0..=count {
        let time = step as f64 * CONTROL_SECONDS;
        while index + 1 < last && times[index + 1] <= time {
            index += 1;
        }
        let part = ((time - times[index]) / (times[index + 1] - times[index])).clamp(0.0, 1.0);
        timed.push(between(points[index], points[index + 1], part));
    }
    timed.extend(std::iter::repeat_n(points[last], padding));
    smoothed(&timed, sigma)
}

/// Largest speed at each point such that the acceleration along and across the path together keep the limit.
fn speed_profile(points: &[[f64; 3]], spacing: f64, pace: Pace) -> Vec<f64> {
    let last = points.len() - 1;
    let curvature: Vec<f64> = (0..=last)
        .map(|i| {
            let i = i.clamp(1, last - 1);
            let bend = |k: usize| points[i + 1][k] - 2.0 * points[i][k] + points[i - 1][k];
            super::sample::norm([bend(0), bend(1), bend(2)]) / (spacing * spacing)
        })
        .collect();
    let cap = |&k: &f64| {
        let k = k.max(1e-6);
        let across = (pace.max_acceleration / k).sqrt();
        let hand = pace.bend_speed / cbrt(k);
        pace.max_speed.min(across).min(hand)
    };
    let mut speed: Vec<f64> = curvature.iter().map(cap).collect();
    speed[0] = 0.0;
    speed[last] = 0.0;
    // What the bend leaves of the acceleration is there to speed up and, backwards, to slow down.
    let reachable = |from: f64, bend: f64| {
        let across = from * from * bend;
        let along = (pace.max_acceleration.powi(2) - across * across).max(0.0).sqrt();
        (from * from + 2.0 * along * spacing).sqrt()
    };
    for i in 1..=last {
        speed[i] = speed[i].min(reachable(speed[i - 1], curvature[i - 1]));
    }
    for i in (0..last).rev() {
        speed[i] = speed[i].min(reachable(speed[i + 1], curvature[i + 1]));
    }
    speed
}

/// The polyline's points at equal distances along it, at most `spacing` apart, and that distance. At least three points.
pub(crate) fn resampled(path: &[[f64; 3]], spacing: f64) -> (Vec<[f64; 3]>, f64) {
    let mut along = vec![0.0];
    for pair in path.windows(2) {
        along.push(along[along.len() - 1] + distance(pair[0], pair[1]));
    }
    let length = along[along.len() - 1];
    let count = ((length / spacing).ceil() as usize).max(2);
    let step = (length / count as f64).max(f64::MIN_POSITIVE);
    let mut index = 0;
    let mut points = Vec::with_capacity(count + 1);
    for i in 0..=count {
        let s = i as f64 * step;
        while index + 2 < along.len() && along[index + 1] <= s {
            index += 1;
        }
        let part = (s - along[index]) / (along[index + 1] - along[index]).max(f64::MIN_POSITIVE);
        points.push(between(path[index], path[index + 1], part.clamp(0.0, 1.0)));
    }
    (points, step)
}

/// The polyline with its corners rounded: smoothed along the way by a Gaussian of `sigma` metres.
pub(crate) fn rounded(corners: &[[f64; 3]], sigma: f64) -> Vec<[f64; 3]> {
    let (points, step) = resampled(corners, POINT_SPACING / 4.0);
    smoothed(&points, sigma / step)
}

/// Gaussian smoothing, `sigma` in samples, cut off at three sigma; the ends are continued as they are.
fn smoothed(points: &[[f64; 3]], sigma: f64) -> Vec<[f64; 3]> {
    let reach = (3.0 * sigma).ceil() as isize;
    let weights: Vec<f64> = (-reach..=reach).map(|i| exp(-0.5 * (i as f64 / sigma).powi(2))).collect();
    let total: f64 = weights.iter().sum();
    let last = points.len() as isize - 1;
    (0..=last)
        .map(|centre| {
            let mut mean = [0.0; 3];
            for (weight, offset) in weights.iter().zip(-reach..) {
                let point = points[(centre + offset).clamp(0, last) as usize];
                for (sum, value) in mean.iter_mut().zip(point) {
                    *sum += weight / total * value;
                }
            }
            mean
        })
        .collect()
}

fn between(a: [f64; 3], b: [f64; 3], part: f64) -> [f64; 3] {
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * part)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory::{Curve, sample::norm};

    #[test]
    fn a_square_is_drawn_within_the_limits_and_close_to_its_corners() {
        let corners = [[0.0; 3], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0], [0.0; 3]];
        let pace = Pace::default();
        let curve = drawn(&rounded(&corners, 0.05), pace);
        let (start, end) = (curve.at(0.0), curve.at(curve.duration()));
        assert!(norm(start.velocity) < 1e-9 && norm(end.acceleration) < 1e-9);
        let motion = Motion::new("square", curve);
        let (speed, acceleration) = motion.peaks(0.001);
        assert!(speed <= pace.max_speed && acceleration <= pace.max_acceleration);
        assert!(speed > 0.8 * pace.max_speed, "the straights are drawn fast: {speed}");
        let nearest =
            (0..2000).map(|i| distance(motion.at(f64::from(i) * 0.01).position, [2.0, 2.0, 0.0])).fold(f64::MAX, f64::min);
        assert!(nearest < 0.12, "corner cut by {nearest} m");
    }

    #[test]
    fn resampling_keeps_length_and_spacing() {
        let (points, step) = resampled(&[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 0.5, 0.0]], 0.01);
        assert_eq!(points.len(), 151);
        assert!((step - 0.01).abs() < 1e-12);
        assert!(points.windows(2).all(|p| distance(p[0], p[1]) < 0.01 + 1e-12));
    }
}
