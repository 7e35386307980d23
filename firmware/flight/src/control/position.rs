//! Position loop.
//!
//! *in* a reference and a state; *out* a thrust vector, at the reference's rate; *never* an attitude that is undefined: the last
//! one stays; or a number that is not finite, whatever finite numbers came in; *source* Zhou 2017, section V-A.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::GRAVITY;
use impromptu_firmware::math::{self, clamp, finite_or_zero};

use crate::types::{Reference, State};

/// Largest errors, accelerations and integrals that the loop computes with, SI: far beyond what a vehicle within the limits of
/// [`crate::types`] has, so that they change no bit of a flight, and small enough that no product of them is infinite.
const LARGEST: f32 = 1e6;

/// Gains of the position loop, for each axis of the world frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PositionGains {
    /// Position error to acceleration, 1/s².
    pub kp: [f32; 3],
    /// Velocity error to acceleration, 1/s.
    pub kd: [f32; 3],
    /// Integrated position error to acceleration, 1/s³; 0 switches the integral off.
    pub ki: [f32; 3],
    /// Largest acceleration that the integral may ask for, m/s².
    pub integral_limit: f32,
}

/// What the attitude loop shall realise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThrustVector {
    /// Force, world ENU, N.
    pub force: Vector3<f32>,
    /// Attitude whose z axis is along the force and whose heading is the reference's yaw; columns are body axes in the world.
    pub attitude: Matrix3<f32>,
}

impl ThrustVector {
    /// No force, no rotation.
    pub const NONE: Self =
        Self { force: Vector3::new(0.0, 0.0, 0.0), attitude: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0) };
}

/// Position loop with its integral.
#[derive(Clone, Debug)]
pub struct PositionLoop {
    gains: PositionGains,
    mass: f32,
    dt: f32,
    integral: Vector3<f32>,
    yaw: f32,
    heading: Vector3<f32>,
    attitude: Matrix3<f32>,
}

impl PositionLoop {
    /// A loop at `rate_hz` for a vehicle of `mass` kg.
    pub fn new(gains: PositionGains, mass: f32, rate_hz: f32) -> Self {
        Self {
            gains,
            mass,
            dt: 1.0 / rate_hz,
            integral: Vector3::zeros(),
            yaw: 0.0,
            heading: Vector3::x(),
            attitude: Matrix3::identity(),
        }
    }

    /// Its gains.
    pub fn gains(&self) -> &PositionGains {
        &self.gains
    }

    /// As it was made, in place.
    pub fn reset(&mut self) {
        (self.integral, self.yaw, self.heading, self.attitude) = (Vector3::zeros(), 0.0, Vector3::x(), Matrix3::identity());
    }

    /// Empties the integral.
    pub fn clear_integral(&mut self) {
        self.integral = Vector3::zeros();
    }

    /// Nonlinear transformation: the acceleration that PD (and integral) ask for, plus gravity, as a thrust vector.
    pub fn step(&mut self, reference: &Reference, state: &State) -> ThrustVector {
        let position_error = (reference.position - state.position).map(bounded);
        let velocity_error = (reference.velocity - state.velocity).map(bounded);
        let mut acceleration = Vector3::new(0.0, 0.0, GRAVITY);
        let limit = self.gains.integral_limit;
        for axis in 0..3 {
            let step = bounded(self.gains.ki[axis] * position_error[axis] * self.dt);
            self.integral[axis] = bounded(clamp(self.integral[axis] + step, -limit, limit));
            acceleration[axis] += bounded(
                self.gains.kp[axis] * position_error[axis] + self.gains.kd[axis] * velocity_error[axis] + self.integral[axis],
            );
        }
        if reference.yaw.to_bits() != self.yaw.to_bits() {
            // Yaw mostly stands still.
            self.yaw = reference.yaw;
            let (sine, cosine) = math::sin_cos(self.yaw);
            self.heading = Vector3::new(cosine, sine, 0.0);
        }
        let force = acceleration * self.mass;
        if let Some(attitude) = aligned(&force, &self.heading) {
            self.attitude = attitude;
        }
        ThrustVector { force, attitude: self.attitude }
    }
}

/// The number, if it is one and of a size to compute with.
#[inline(always)]
fn bounded(x: f32) -> f32 {
    clamp(finite_or_zero(x), -LARGEST, LARGEST)
}

/// Attitude whose third axis is along `force`; `None` if that is undefined (free fall, or force along the heading).
fn aligned(force: &Vector3<f32>, heading: &Vector3<f32>) -> Option<Matrix3<f32>> {
    let z = unit(force)?;
    let y = unit(&z.cross(heading))?;
    Some(Matrix3::from_columns(&[y.cross(&z), y, z]))
}

fn unit(vector: &Vector3<f32>) -> Option<Vector3<f32>> {
    let length = math::sqrt(vector.dot(vector));
    (length > 1e-6).then(|| vector * (1.0 / length))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Any finite number, huge and tiny ones included.
    fn finite() -> impl Strategy<Value = f32> {
        any::<u32>().prop_map(f32::from_bits).prop_filter("finite", |x| x.is_finite())
    }

    fn three() -> impl Strategy<Value = Vector3<f32>> {
        prop::array::uniform3(prop_oneof![finite(), Just(f32::MAX), Just(f32::MIN)]).prop_map(Vector3::from)
    }

    fn gains() -> PositionGains {
        PositionGains { kp: [6.5, 6.5, 15.0], kd: [4.0, 4.0, 9.0], ki: [1.0; 3], integral_limit: 1.0 }
    }

    proptest! {
        #[test]
        fn no_finite_number_makes_one_that_is_not(
            samples in prop::collection::vec((three(), three(), three(), three(), finite()), 1..6),
            wild in prop::option::of((three(), finite())),
        ) {
            let mut gains = gains();
            if let Some((numbers, limit)) = wild {
                gains = PositionGains { kp: numbers.into(), kd: numbers.into(), ki: numbers.into(), integral_limit: limit };
            }
            let mut baseline = PositionLoop::new(gains, 0.03, 100.0);
            for (p, v, position, velocity, yaw) in samples {
                let reference = Reference { position: p, velocity: v, yaw };
                let wanted = baseline.step(&reference, &State { position, velocity, ..State::ORIGIN });
                prop_assert!(wanted.force.iter().chain(wanted.attitude.iter()).all(|x| x.is_finite()), "{wanted:?}");
                prop_assert!(baseline.integral.iter().all(|x| x.is_finite()));
            }
        }

        #[test]
        fn what_is_huge_for_a_tick_is_forgotten_afterwards(sign in prop::sample::select(vec![-1.0f32, 1.0])) {
            let mut baseline = PositionLoop::new(PositionGains { ki: [0.0; 3], ..gains() }, 0.03, 100.0);
            let before = baseline.step(&Reference::ORIGIN, &State::ORIGIN);
            let far = Vector3::new(3.3e38 * sign, 0.0, 0.0);
            let there = State { position: -far, ..State::ORIGIN };
            baseline.step(&Reference { position: far, ..Reference::ORIGIN }, &there);
            prop_assert_eq!(baseline.step(&Reference::ORIGIN, &State::ORIGIN), before);
        }
    }
}
