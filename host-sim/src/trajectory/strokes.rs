//! Hand-drawn-like strokes: the unseen test trajectories.
//!
//! - in: a seed and an index;
//! - out: one stroke, about 4 m x 2 m, in a vertical plane of random heading (every fourth one leaves its plane), 8 to 20 s
//!   long at normal speed;
//! - never: more than [`STROKE_SPEED`] or [`STROKE_ACCELERATION`] at normal speed; another path for another `count` or
//!   `speed`;
//! - source: Li et al., ICRA 2017: one stroke of a pen in a vertical plane of 4 m x 2 m, points at most 0.01 m apart,
//!   curvature-limited speed. Different here: drawn by a seeded generator, and faster (1.28 m/s, 4.2 m/s² instead of
//!   0.6 m/s, 2 m/s²).

use super::pen::{self, Pace};
use super::piecewise::PiecewisePolynomial;
use super::{Curve, Motion, Trajectory, TrajectoryError};
use libm::{cos, sin};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::{PI, TAU};

/// Largest speed of a stroke at normal speed, m/s.
pub const STROKE_SPEED: f64 = 1.28;
/// Largest acceleration of a stroke at normal speed, m/s².
pub const STROKE_ACCELERATION: f64 = 4.2;

/// Height of the strokes' centre, m.
const CENTRE_HEIGHT: f64 = 1.5;
/// Length of a stroke at normal speed, s.
const DURATION: std::ops::RangeInclusive<f64> = 8.0..=20.0;

/// The first `count` strokes of a seed, flown `speed` times as fast as normal.
///
/// # Errors
/// A rate outside 1 to 1000 Hz.
///
/// # Panics
/// When the speed is not positive and finite.
pub fn strokes(
    seed: u64,
    count: usize,
    speed: f64,
    rate_hz: f64,
) -> Result<Vec<Trajectory>, TrajectoryError> {
    (0..count as u64)
        .map(|index| stroke(seed, index).scaled(speed).sampled(rate_hz))
        .collect()
}

/// One stroke at normal speed. Seed and index alone decide.
#[must_use]
pub fn stroke(seed: u64, index: u64) -> Motion {
    let mixed = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(index);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(mixed);
    loop {
        let path = placed(&page(&mut random), index % 4 == 3, &mut random);
        let vigour = random.random_range(0.75..=1.0);
        let pace = Pace {
            max_speed: STROKE_SPEED * vigour,
            max_acceleration: STROKE_ACCELERATION,
            bend_speed: random.random_range(0.7..=0.95),
        };
        let curve = pen::drawn(&path, pace);
        if DURATION.contains(&curve.duration()) {
            return Motion::new(format!("strokes:{seed}:{index}"), curve);
        }
    }
}

/// A path on the page, in any size, of one of four ways to scribble.
fn page(random: &mut Xoshiro256PlusPlus) -> Vec<[f64; 2]> {
    match random.random_range(0..4) {
        0 => loops(random),
        1 => wander(random),
        2 => zigzag(random),
        _ => curl(random),
    }
}

/// A row of loops such as a handwritten "elele": a turning hand that moves along, with changing height.
fn loops(random: &mut Xoshiro256PlusPlus) -> Vec<[f64; 2]> {
    let turns: f64 = random.random_range(2.5..4.5);
    let width: f64 = random.random_range(0.35..0.75) * 4.0 / turns;
    let lean = random.random_range(-0.3..0.6);
    let side = if random.random_bool(0.5) { 1.0 } else { -1.0 };
    let start = random.random_range(0.0..TAU);
    let swell: [f64; 4] = std::array::from_fn(|_| random.random_range(0.0..TAU));
    (0..=4000)
        .map(|i| {
            let part = f64::from(i) / 4000.0;
            let angle = start + TAU * turns * part + 0.5 * sin(TAU * part * 1.3 + swell[0]);
            let height = 1.0
                + 0.35 * sin(TAU * part * 1.7 + swell[1])
                + 0.2 * sin(TAU * part * 3.1 + swell[2]);
            let line = 0.35 * sin(TAU * part * 0.8 + swell[3]);
            let up = line + 0.7 * height * sin(angle);
            [
                4.0 * part + width * height * cos(angle) * side + lean * up,
                up,
            ]
        })
        .collect()
}

/// A quintic spline through the neighbourhood of random points, each well away from the one before.
fn wander(random: &mut Xoshiro256PlusPlus) -> Vec<[f64; 2]> {
    let corners = apart(random.random_range(8..12), 1.2, random);
    let mut controls = vec![corners[0]; 5];
    controls.extend(&corners[1..]);
    controls.extend([corners[corners.len() - 1]; 4]);
    let curve =
        PiecewisePolynomial::b_spline(&controls, 1.0).expect("more than six control points");
    (0..=6000)
        .map(|i| {
            let [x, y, _] = curve.at(curve.duration() * f64::from(i) / 6000.0).position;
            [x, y]
        })
        .collect()
}

/// Bowed dashes to and fro with rounded corners, some of them sharp.
fn zigzag(random: &mut Xoshiro256PlusPlus) -> Vec<[f64; 2]> {
    let corners = apart(random.random_range(5..8), 1.4, random);
    let sigma = random.random_range(0.08..0.2);
    let mut bowed = vec![corners[0]];
    for pair in corners.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        let bow = random.random_range(-0.25..0.25);
        bowed.extend((1..=20).map(|i| {
            let part = f64::from(i) / 20.0;
            let aside = 4.0 * bow * part * (1.0 - part);
            let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
            [
                from[0] + part * dx - aside * dy,
                from[1] + part * dy + aside * dx,
                0.0,
            ]
        }));
    }
    let flat = |p: [f64; 3]| [p[0], p[1]];
    pen::rounded(&bowed, sigma).into_iter().map(flat).collect()
}

/// A pen whose curvature wanders: arcs, hooks, spirals and loops.
fn curl(random: &mut Xoshiro256PlusPlus) -> Vec<[f64; 2]> {
    loop {
        let tones: [(f64, f64, f64); 5] = std::array::from_fn(|k| {
            let waves = k as f64 + random.random_range(0.5..1.5);
            (
                random.random_range(0.3..1.0),
                waves,
                random.random_range(0.0..TAU),
            )
        });
        let bias = random.random_range(-4.0..4.0);
        let strength = random.random_range(6.0..13.0);
        let (mut heading, mut pen) = (0.0, [0.0; 2]);
        let path: Vec<[f64; 2]> = (0..=6000)
            .map(|i| {
                let s = f64::from(i) / 6000.0;
                let wave: f64 = tones
                    .iter()
                    .map(|&(a, n, phase)| a * sin(TAU * n * s + phase))
                    .sum();
                heading += (bias + strength * wave) / 6000.0;
                pen = [
                    pen[0] + cos(heading) / 6000.0,
                    pen[1] + sin(heading) / 6000.0,
                ];
                pen
            })
            .collect();
        // A page of the wrong format would be squeezed into ellipses.
        let path = turned(&path);
        let [width, height] = extent(&path).map(|[low, high]| high - low);
        if (1.3..3.0).contains(&(width / height)) {
            return path;
        }
    }
}

/// Random points on a page of 4 x 2, each at least `gap` from the one before.
fn apart(count: usize, gap: f64, random: &mut Xoshiro256PlusPlus) -> Vec<[f64; 3]> {
    let mut points: Vec<[f64; 3]> = Vec::with_capacity(count);
    while points.len() < count {
        let point = [
            random.random_range(0.0..4.0),
            random.random_range(0.0..2.0),
            0.0,
        ];
        if points
            .last()
            .is_none_or(|&last| super::distance(last, point) >= gap)
        {
            points.push(point);
        }
    }
    points
}

/// The page turned such that it is as wide as possible (found in steps of 5 degrees).
fn turned(path: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let turn = |step: u32| {
        let (s, c) = (
            sin(PI * f64::from(step) / 36.0),
            cos(PI * f64::from(step) / 36.0),
        );
        path.iter()
            .map(|[x, y]| [c * x - s * y, s * x + c * y])
            .collect::<Vec<_>>()
    };
    let width = |path: &[[f64; 2]]| extent(path)[0][1] - extent(path)[0][0];
    (1..36).map(turn).fold(turn(0), |widest, other| {
        if width(&other) > width(&widest) {
            other
        } else {
            widest
        }
    })
}

/// Lowest and highest value of both coordinates.
fn extent(path: &[[f64; 2]]) -> [[f64; 2]; 2] {
    std::array::from_fn(|k| {
        path.iter().fold([f64::MAX, f64::MIN], |[low, high], p| {
            [low.min(p[k]), high.max(p[k])]
        })
    })
}

/// The page fitted into about 4 m x 2 m and hung up in the room; with `depth` it also leaves its plane.
fn placed(path: &[[f64; 2]], depth: bool, random: &mut Xoshiro256PlusPlus) -> Vec<[f64; 3]> {
    let size = [random.random_range(3.4..4.0), random.random_range(1.5..2.0)];
    let heading = random.random_range(0.0..TAU);
    let (s, c) = (sin(heading), cos(heading));
    let amplitude = if depth {
        random.random_range(0.3..0.7)
    } else {
        0.0
    };
    let (waves, phase) = (random.random_range(0.6..1.6), random.random_range(0.0..TAU));
    let [[left, right], [low, high]] = extent(path);
    let count = path.len() as f64;
    path.iter()
        .enumerate()
        .map(|(index, [x, y])| {
            let along = size[0] * ((x - left) / (right - left) - 0.5);
            let up = size[1] * ((y - low) / (high - low) - 0.5);
            let across = amplitude * sin(TAU * waves * index as f64 / count + phase);
            [
                c * along - s * across,
                s * along + c * across,
                CENTRE_HEIGHT + up,
            ]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thirty_strokes_keep_the_limits_and_nearly_reach_them() {
        let set = strokes(1, 30, 1.0, 100.0).expect("rate");
        let (mut fastest, mut hardest) = (0.0_f64, 0.0_f64);
        for trajectory in &set {
            assert!(trajectory.peak_speed() <= STROKE_SPEED);
            assert!(trajectory.peak_acceleration() <= STROKE_ACCELERATION);
            assert!((7.9..20.1).contains(&trajectory.drawn_seconds()));
            let heights = trajectory.samples.iter().map(|s| s.position[2]);
            assert!(heights.clone().all(|z| (0.4..2.6).contains(&z)));
            fastest = fastest.max(trajectory.peak_speed());
            hardest = hardest.max(trajectory.peak_acceleration());
        }
        assert!(fastest > 0.95 * STROKE_SPEED, "{fastest}");
        assert!(hardest > 0.95 * STROKE_ACCELERATION, "{hardest}");
    }

    #[test]
    fn a_hand_makes_no_fast_accelerations() {
        // Energy above 2.5 Hz by a discrete Fourier transform over the drawn part, of all strokes together.
        let (mut slow, mut fast) = (0.0, 0.0);
        for index in 0..6 {
            let trajectory = stroke(1, index).sampled(50.0).expect("rate");
            let drawn = &trajectory.samples[trajectory.scored.clone()];
            for bin in 0..(drawn.len() / 2) {
                let frequency = bin as f64 * 50.0 / drawn.len() as f64;
                let power: f64 = (0..3)
                    .map(|axis| {
                        let (mut re, mut im) = (0.0, 0.0);
                        for (n, sample) in drawn.iter().enumerate() {
                            let angle = TAU * (bin * n % drawn.len()) as f64 / drawn.len() as f64;
                            re += sample.acceleration[axis] * cos(angle);
                            im += sample.acceleration[axis] * sin(angle);
                        }
                        re * re + im * im
                    })
                    .sum();
                if frequency > 2.5 {
                    fast += power;
                } else {
                    slow += power;
                }
            }
        }
        assert!(fast < 0.01 * (slow + fast), "{}", fast / (slow + fast));
    }

    #[test]
    fn speed_is_an_exact_change_of_time() {
        let normal = stroke(3, 5);
        let fast = normal.clone().scaled(1.7);
        assert_eq!(fast.duration(), normal.duration() / 1.7);
        for i in 0..50 {
            let time = f64::from(i) * 0.13;
            let (a, b) = (normal.at(time * 1.7), fast.at(time));
            for axis in 0..3 {
                assert!((a.position[axis] - b.position[axis]).abs() < 1e-12);
                assert!((a.acceleration[axis] * 1.7 * 1.7 - b.acceleration[axis]).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn seed_and_index_alone_decide() {
        let few = strokes(9, 2, 1.0, 100.0).expect("rate");
        let more = strokes(9, 4, 1.0, 100.0).expect("rate");
        assert_eq!(few[..], more[..2]);
        assert_ne!(more[0].samples, more[1].samples);
        assert_ne!(
            few[0].samples,
            stroke(10, 0).sampled(100.0).expect("rate").samples
        );
    }
}
