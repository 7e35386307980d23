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
use super::scribble::{extent, page};
use super::{Curve, Motion, Trajectory, TrajectoryError};
use libm::{cos, sin};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

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
pub fn strokes(seed: u64, count: usize, speed: f64, rate_hz: f64) -> Result<Vec<Trajectory>, TrajectoryError> {
    (0..count as u64).map(|index| stroke(seed, index).scaled(speed).sampled(rate_hz)).collect()
}

/// One stroke at normal speed. Seed and index alone decide.
#[must_use]
pub fn stroke(seed: u64, index: u64) -> Motion {
    let mixed = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(index);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(mixed);
    loop {
        let path = placed(&page(&mut random), index % 4 == 3, &mut random);
        let speed_share = random.random_range(0.75..=1.0);
        let pace = Pace {
            max_speed: STROKE_SPEED * speed_share,
            max_acceleration: STROKE_ACCELERATION,
            bend_speed: random.random_range(0.7..=0.95),
        };
        let curve = pen::drawn(&path, pace);
        if DURATION.contains(&curve.duration()) {
            return Motion::new(format!("strokes:{seed}:{index}"), curve);
        }
    }
}

/// The page fitted into about 4 m x 2 m and hung up in the room; with `depth` it also leaves its plane.
fn placed(path: &[[f64; 2]], depth: bool, random: &mut Xoshiro256PlusPlus) -> Vec<[f64; 3]> {
    let size = [random.random_range(3.4..4.0), random.random_range(1.5..2.0)];
    let heading = random.random_range(0.0..TAU);
    let (s, c) = (sin(heading), cos(heading));
    let amplitude = if depth { random.random_range(0.3..0.7) } else { 0.0 };
    let (waves, phase) = (random.random_range(0.6..1.6), random.random_range(0.0..TAU));
    let [[left, right], [low, high]] = extent(path);
    let count = path.len() as f64;
    path.iter()
        .enumerate()
        .map(|(index, [x, y])| {
            let along = size[0] * ((x - left) / (right - left) - 0.5);
            let up = size[1] * ((y - low) / (high - low) - 0.5);
            let across = amplitude * sin(TAU * waves * index as f64 / count + phase);
            [c * along - s * across, s * along + c * across, CENTRE_HEIGHT + up]
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
        assert_ne!(few[0].samples, stroke(10, 0).sampled(100.0).expect("rate").samples);
    }
}
