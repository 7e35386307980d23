//! A measured position that stands still although the vehicle moves.
//!
//! *in* positions and velocities at every reference tick, and the desired velocity; *out* for how long the position has been
//! frozen; *never* a verdict without evidence: a vehicle at rest, a position in whole millimetres and one that comes ten times a
//! second stand still and are true; *source* ours: a tracking system that has lost its markers, or a filter that has lost its
//! sensor, goes on sending what it knew last, with fresh stamps.
//!
//! What says that a position must have changed: the velocity, measured, or desired for so long that the vehicle must have
//! followed; and a velocity that is other than zero and itself stands still with all the rest.

use nalgebra::Vector3;

use crate::types::State;

/// A position that comes ten times a second stands still for 0.1 s.
const SHORTEST: f32 = 0.25;
/// Way, m, and mean speed, m/s, at which the measured velocity says that a position must have changed.
const WAY: f32 = 0.01;
const SPEED: f32 = 0.05;
/// Speed, m/s, at which a vehicle whose position and velocity both stand still is not at rest: noise alone is more.
const REST: f32 = 0.005;
/// Desired way, m, after which a vehicle moves, and how long it may take, s.
const DESIRED_WAY: f32 = 0.02;
const RESPONSE: f32 = 0.3;

/// One axis.
#[derive(Clone, Copy, Debug)]
struct Axis {
    /// Position, m, as it has been
    position: f32,
    /// for this time, s,
    seconds: f32,
    /// in which it must have changed by this way, m,
    way: f32,
    /// and was desired to by this one, m,
    desired: f32,
    /// far enough for this time, s.
    asked: f32,
}

impl Axis {
    const NONE: Self = Self { position: 0.0, seconds: 0.0, way: 0.0, desired: 0.0, asked: 0.0 };

    /// A tick. Returns for how long the position has stood still, s, if it must have changed since; else 0.
    // Once in flash, not once for each axis.
    #[inline(never)]
    fn observe(&mut self, position: f32, velocity: f32, desired: f32, dt: f32) -> f32 {
        if position != self.position {
            *self = Self { position, ..Self::NONE };
            return 0.0;
        }
        self.seconds += dt;
        self.way += velocity * dt;
        self.desired += desired * dt;
        self.asked += if self.desired.abs() >= DESIRED_WAY { dt } else { 0.0 };
        let moves = self.way.abs() >= WAY.max(SPEED * self.seconds);
        if self.seconds >= SHORTEST && (moves || self.asked >= RESPONSE) { self.seconds } else { 0.0 }
    }
}

/// Watches a measured position.
#[derive(Clone, Debug)]
pub(crate) struct Frozen {
    axes: [Axis; 3],
    /// Velocity, m/s, as it has been
    velocity: Vector3<f32>,
    /// with the whole position for this time, s.
    seconds: f32,
}

impl Frozen {
    /// Nothing seen yet: all zeros.
    pub(crate) const EMPTY: Self = Self { axes: [Axis::NONE; 3], velocity: Vector3::new(0.0, 0.0, 0.0), seconds: 0.0 };

    /// A reference tick at a rate, Hz, with the state as it is measured and the desired velocity, m/s. Returns for how many ticks
    /// the position has stood still, if it must have changed since; else 0.
    pub(crate) fn ticks(&mut self, state: &State, desired: &Vector3<f32>, rate_hz: f32) -> u16 {
        (self.observe(&state.position, &state.velocity, desired, 1.0 / rate_hz) * rate_hz) as u16
    }

    /// A reference tick of `dt` seconds with the measured position and velocity and the desired velocity. Returns how long the
    /// position has stood still, s, if it must have changed since; else 0.
    fn observe(&mut self, position: &Vector3<f32>, velocity: &Vector3<f32>, desired: &Vector3<f32>, dt: f32) -> f32 {
        let (mut longest, mut stands) = (0.0f32, *velocity == self.velocity);
        for (((axis, position), velocity), desired) in self.axes.iter_mut().zip(position).zip(velocity).zip(desired) {
            longest = longest.max(axis.observe(*position, *velocity, *desired, dt));
            stands &= axis.seconds > 0.0;
        }
        self.seconds = if stands { self.seconds + dt } else { 0.0 };
        self.velocity = *velocity;
        let whole = self.seconds >= SHORTEST && velocity.iter().any(|speed| speed.abs() >= REST);
        if whole { longest.max(self.seconds) } else { longest }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const DT: f32 = 0.01;

    /// When it is found, s, if it is; `at` gives position, velocity and desired velocity on one axis.
    fn found(at: impl Fn(f32) -> [f32; 3]) -> Option<f32> {
        let mut frozen = Frozen::EMPTY;
        let on_x = |value| Vector3::new(value, 0.0, 0.0);
        (0..2000).map(|tick| tick as f32 * DT).find(|t| {
            let [position, velocity, desired] = at(*t).map(on_x);
            frozen.observe(&position, &velocity, &desired, DT) > 0.0
        })
    }

    #[test]
    fn what_must_have_changed_is_found_within_three_tenths_of_a_second() {
        // The velocity says so,
        let drifts = found(|t| [t.min(5.0), 1.0, 0.0]).unwrap();
        assert!((5.0..=5.3).contains(&drifts), "{drifts}");
        // or itself stands still,
        let both = found(|t| [t.min(5.0), 0.01 + 0.001 * t.min(5.0).sin(), 0.0]).unwrap();
        assert!((5.0..=5.3).contains(&both), "{both}");
        // or the desired motion says so, when the vehicle must have followed.
        let asked = found(|t| [0.0, 0.0, if t < 5.0 { 0.0 } else { 0.5 }]).unwrap();
        assert!((5.3..=5.4).contains(&asked), "{asked}");
    }

    #[test]
    fn a_vehicle_at_rest_is_not_frozen_nor_one_that_drifts_slowly_in_whole_millimetres() {
        assert_eq!(found(|_| [1.5, 0.0, 0.0]), None);
        assert_eq!(found(|t| [(2.0 * t).round() * 1e-3, 0.002, 0.0]), None);
    }

    proptest! {
        #[test]
        fn true_positions_in_whole_millimetres_ten_times_a_second_are_never_frozen(
            amplitude in 0.0f32..2.0, hz in 0.05f32..0.8, noise in 0.0f32..0.02, seed in any::<u32>()
        ) {
            // The velocity is measured with noise, at each tick.
            let draw = |t: f32| ((seed ^ (t * 100.0) as u32).wrapping_mul(2_654_435_761) >> 8) as f32 / 16_777_216.0 - 0.5;
            let turn = core::f32::consts::TAU * hz;
            let sampled = |t: f32| (t * 10.0).floor() / 10.0;
            let seen = found(|t| {
                let position = ((amplitude * (turn * sampled(t)).sin()) * 1e3).round() * 1e-3;
                let velocity = amplitude * turn * (turn * t).cos();
                [position, velocity + noise * draw(t), velocity]
            });
            prop_assert_eq!(seen, None);
        }
    }
}
