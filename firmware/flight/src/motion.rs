//! From one motion into another: how a vehicle comes to rest, and how it comes from one trajectory to the next.
//!
//! *in* setpoints and limits; *out* setpoints, as many seconds later as asked; *never* a jump of position or velocity, or more
//! speed or acceleration beside the trajectory's own than the limits say; *source* polynomials of least degree between two ends
//! (quintic Hermite; Flash and Hogan 1985 for the way from rest to rest); default limits of PX4 1.14
//! (`MPC_XY_CRUISE`, `MPC_ACC_HOR`, `MPC_JERK_MAX`).

use core::f32::consts::PI;

use impromptu_firmware::math::{abs, sqrt};
use nalgebra::Vector3;

use crate::types::Setpoint;

/// How fast a vehicle is moved by itself, beside what its trajectory asks of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionLimits {
    /// Speed, m/s.
    pub speed: f32,
    /// Acceleration, m/s².
    pub acceleration: f32,
    /// Change of the acceleration while it brakes, m/s³.
    pub jerk: f32,
}

impl MotionLimits {
    /// PX4's defaults: 5 m/s, 3 m/s², 8 m/s³.
    pub const DEFAULT: Self = Self { speed: 5.0, acceleration: 3.0, jerk: 8.0 };

    /// Whether a vehicle can be moved so: 0.01 to 100 m/s, 0.01 to 100 m/s², 0.01 to 10,000 m/s³.
    pub fn is_physical(&self) -> bool {
        let Self { speed, acceleration, jerk } = self;
        (0.01..=100.0).contains(speed) && (0.01..=100.0).contains(acceleration) && (0.01..=1e4).contains(jerk)
    }
}

impl Default for MotionLimits {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Fastest turn of the heading in a blend, rad/s.
const YAW_RATE: f32 = 1.0;

/// The angle that is left of one by whole turns, within -π and π: the shortest way.
pub fn turn(angle: f32) -> f32 {
    let turns = angle * (0.5 / PI);
    // Half away from zero; a yaw has at most some thousand turns.
    let whole = (turns + if turns < 0.0 { -0.5 } else { 0.5 }) as i32;
    angle - whole as f32 * (2.0 * PI)
}

/// A setpoint between two, the shortest way round in yaw.
pub fn between(from: &Setpoint, to: &Setpoint, share: f32) -> Setpoint {
    let yaw = from.yaw + turn(to.yaw - from.yaw) * share;
    let wrapped = abs(from.yaw) <= PI && abs(to.yaw) <= PI;
    Setpoint {
        position: from.position.lerp(&to.position, share),
        velocity: from.velocity.lerp(&to.velocity, share),
        acceleration: from.acceleration.lerp(&to.acceleration, share),
        // Whoever counts turns goes on to count them.
        yaw: if wrapped { turn(yaw) } else { yaw },
    }
}

/// The difference between two trajectories, which fades from one moment on: added to the second, it starts as the first. What
/// they differ by in position and what in velocity fade each in a time of its own, so that a long way is no reason to keep a
/// velocity for long. Accelerations, which no loop follows, change at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blend {
    /// Differences at its start: m, m/s, rad.
    position: Vector3<f32>,
    velocity: Vector3<f32>,
    yaw: f32,
    /// How long the position and the yaw take, and how long the velocity takes, s.
    durations: [f32; 2],
}

impl Blend {
    /// From the first trajectory to the second, whose setpoints at this moment these are. It adds at most the limits' speed to
    /// the difference that there is, and at most their acceleration.
    pub fn new(first: &Setpoint, second: &Setpoint, limits: &MotionLimits) -> Self {
        let (position, velocity) = (first.position - second.position, first.velocity - second.velocity);
        let yaw = turn(first.yaw - second.yaw);
        let (p, v) = (length(&position), length(&velocity));
        // The polynomial of the position has slopes up to 1.875 and second derivatives up to 5.78, that of the velocity second
        // derivatives up to 3.95. Each gets half of the acceleration.
        let MotionLimits { speed, acceleration, .. } = limits;
        let half = 0.5 * acceleration;
        let by_position = sqrt(5.78 * p / half).max(1.875 * p / speed).max(1.875 * abs(yaw) / YAW_RATE);
        Self { position, velocity, yaw, durations: [by_position, 3.95 * v / half] }
    }

    /// How long it takes, s.
    pub fn duration(&self) -> f32 {
        let [position, velocity] = self.durations;
        position.max(velocity)
    }

    /// The second trajectory's setpoint, so many seconds after the start, with what is left of the difference.
    pub fn apply(&self, seconds: f32, setpoint: &Setpoint) -> Setpoint {
        let mut seen = *setpoint;
        let [by_position, by_velocity] = self.durations;
        // Factored, so that nothing cancels near the end.
        if seconds < by_position {
            let t = seconds.max(0.0) / by_position;
            let s = 1.0 - t;
            let fade = s * s * s * (1.0 + 3.0 * t + 6.0 * t * t);
            seen.position += self.position * fade;
            seen.velocity += self.position * (-30.0 * t * t * s * s / by_position);
            seen.acceleration += self.position * (-60.0 * t * s * (1.0 - 2.0 * t) / (by_position * by_position));
            seen.yaw += self.yaw * fade;
        }
        if seconds < by_velocity {
            let t = seconds.max(0.0) / by_velocity;
            let s = 1.0 - t;
            seen.position += self.velocity * (by_velocity * t * s * s * s * (1.0 + 3.0 * t));
            seen.velocity += self.velocity * (s * s * (1.0 + 2.0 * t - 15.0 * t * t));
            seen.acceleration += self.velocity * (-12.0 * t * s * (3.0 - 5.0 * t) / by_velocity);
        }
        seen
    }
}

/// From a setpoint to rest: the velocity goes to zero by the cubic that starts with its acceleration and ends without one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brake {
    start: Setpoint,
    duration: f32,
}

impl Brake {
    /// From this setpoint. An acceleration beyond the limit is brought back to it at once.
    pub fn new(from: &Setpoint, limits: &MotionLimits) -> Self {
        let MotionLimits { acceleration, jerk, .. } = limits;
        let excess = length(&from.acceleration) / acceleration;
        let start = Setpoint { acceleration: if excess > 1.0 { from.acceleration / excess } else { from.acceleration }, ..*from };
        let (v, a) = (length(&start.velocity), length(&start.acceleration));
        // With B = 3/2 v / T the acceleration stays below max(a, 4/3 B, B + a/3), so B may be 2/3 of the limit; the jerk is at
        // most 6 v / T² + 4 a / T.
        Self { start, duration: (2.25 * v / acceleration).max(root(*jerk, 4.0 * a, 6.0 * v)) }
    }

    /// How long it takes, s.
    pub fn duration(&self) -> f32 {
        self.duration
    }

    /// The setpoint so many seconds after the start; the last one is held.
    pub fn at(&self, seconds: f32) -> Setpoint {
        let duration = self.duration;
        let Setpoint { position: p, velocity: v, acceleration: a, yaw } = self.start;
        if seconds >= duration {
            let position = p + v * (duration * 0.5) + a * (duration * duration / 12.0);
            return Setpoint { position, yaw, ..Setpoint::ORIGIN };
        }
        let t = seconds.max(0.0) / duration;
        let (t2, t3) = (t * t, t * t * t);
        let t4 = t2 * t2;
        Setpoint {
            position: p
                + v * (duration * (t - t3 + 0.5 * t4))
                + a * (duration * duration * (0.5 * t2 - 2.0 / 3.0 * t3 + 0.25 * t4)),
            velocity: v * (1.0 - 3.0 * t2 + 2.0 * t3) + a * (duration * (t - 2.0 * t2 + t3)),
            acceleration: v * ((6.0 * t2 - 6.0 * t) / duration) + a * (1.0 - 4.0 * t + 3.0 * t2),
            yaw,
        }
    }
}

fn length(vector: &Vector3<f32>) -> f32 {
    sqrt(vector.dot(vector))
}

/// The positive root of a x² - b x - c.
fn root(a: f32, b: f32, c: f32) -> f32 {
    (b + sqrt(b * b + 4.0 * a * c)) / (2.0 * a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn three(most: f32) -> impl Strategy<Value = Vector3<f32>> {
        prop::array::uniform3(-most..most).prop_map(Vector3::from)
    }

    prop_compose! {
        fn moving()(
            position in three(50.0), velocity in three(10.0), acceleration in three(3.0), yaw in -3.2f32..3.2
        ) -> Setpoint {
            Setpoint { position, velocity, acceleration, yaw }
        }
    }

    prop_compose! {
        fn limits()(speed in 0.5f32..10.0, acceleration in 0.5f32..10.0, jerk in 1.0f32..50.0) -> MotionLimits {
            MotionLimits { speed, acceleration, jerk }
        }
    }

    /// Whether neighbours of a motion fit together: each is where the ones before lead.
    fn fits(before: &Setpoint, after: &Setpoint, dt: f32) -> bool {
        let position = before.position + (before.velocity + after.velocity) * (0.5 * dt);
        let velocity = before.velocity + (before.acceleration + after.acceleration) * (0.5 * dt);
        (after.position - position).norm() < 2e-3 && (after.velocity - velocity).norm() < 2e-2
    }

    #[test]
    fn yaw_goes_the_shortest_way() {
        let yaw = |from: f32, to: f32| {
            let setpoint = |yaw| Setpoint { yaw, ..Setpoint::ORIGIN };
            between(&setpoint(from), &setpoint(to), 0.5).yaw
        };
        assert!((yaw(3.1, -3.1).abs() - PI).abs() < 1e-5, "through π, not through 0");
        assert!((yaw(-0.1, 0.3) - 0.1).abs() < 1e-6);
        assert!((yaw(7.0, 7.2) - 7.1).abs() < 1e-5, "whoever counts turns goes on to");
    }

    #[test]
    fn who_rests_is_at_rest() {
        let here = Setpoint { position: Vector3::new(1.0, 2.0, 3.0), yaw: 0.5, ..Setpoint::ORIGIN };
        assert_eq!(Brake::new(&here, &MotionLimits::DEFAULT).at(0.0), here);
        assert_eq!(Blend::new(&here, &here, &MotionLimits::DEFAULT).apply(0.0, &here), here);
    }

    proptest! {
        #[test]
        fn the_turn_that_is_left_is_the_shortest(angle in -8192.0f32..8192.0) {
            let left = turn(angle);
            prop_assert!(left.abs() <= PI + 2e-3 && ((angle - left) / (2.0 * PI)).fract().abs().min(
                1.0 - ((angle - left) / (2.0 * PI)).fract().abs()) < 1e-3);
        }

        #[test]
        fn a_brake_ends_at_rest_within_its_limits(from in moving(), limits in limits(), dt in 0.005f32..0.02) {
            let brake = Brake::new(&from, &limits);
            let mut before = brake.at(0.0);
            prop_assert_eq!((before.position, before.velocity, before.yaw), (from.position, from.velocity, from.yaw));
            let ticks = (brake.duration() / dt) as usize + 3;
            for tick in 1..ticks {
                let after = brake.at(tick as f32 * dt);
                prop_assert!(fits(&before, &after, dt), "{before:?} {after:?}");
                prop_assert!(after.acceleration.norm() <= limits.acceleration * 1.01 + 1e-3, "{after:?}");
                let jerk = (after.acceleration - before.acceleration).norm() / dt;
                prop_assert!(jerk <= limits.jerk * 1.02 + 0.05, "{jerk}");
                before = after;
            }
            let last = brake.at(ticks as f32 * dt);
            prop_assert_eq!((last.velocity, last.acceleration), (Vector3::zeros(), Vector3::zeros()));
            prop_assert_eq!(last, brake.at(1e6), "and holds");
        }

        #[test]
        fn a_blend_starts_as_the_first_and_ends_as_the_second(
            first in moving(), second in moving(), limits in limits(), dt in 0.005f32..0.02
        ) {
            let blend = Blend::new(&first, &second, &limits);
            // The second trajectory goes on as its acceleration says; the blend knows nothing of that.
            let at = |t: f32| Setpoint {
                position: second.position + second.velocity * t,
                velocity: second.velocity,
                acceleration: Vector3::zeros(),
                yaw: second.yaw,
            };
            let seen = |t: f32| blend.apply(t, &at(t));
            let start = seen(0.0);
            prop_assert!((start.position - first.position).norm() < 1e-3 && (start.velocity - first.velocity).norm() < 1e-3);
            prop_assert!(turn(start.yaw - first.yaw).abs() < 1e-3);
            let ticks = (blend.duration() / dt) as usize + 2;
            let v = (first.velocity - second.velocity).norm();
            let mut before = start;
            for tick in 1..ticks {
                let after = seen(tick as f32 * dt);
                prop_assert!(fits(&before, &after, dt), "{before:?} {after:?}");
                let added = (after.velocity - second.velocity).norm();
                prop_assert!(added <= limits.speed + v + 1e-2, "{added} m/s");
                prop_assert!(after.acceleration.norm() <= 1.01 * limits.acceleration + 1e-3, "{after:?}");
                before = after;
            }
            prop_assert_eq!(seen(blend.duration()), at(blend.duration()));
        }
    }
}
