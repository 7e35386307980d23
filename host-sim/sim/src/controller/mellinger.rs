//! The Crazyflie's controller after Mellinger and Kumar, "Minimum snap trajectory generation and control for quadrotors", ICRA
//! 2011: errors to a force, the attitude whose z axis is along it, torques from the attitude's error.
//!
//! *in* a target and a state; *out* a force with an attitude and body rates, then rotor speeds; *never* an attitude that is
//! undefined: the last one stays; *source* sections III (body rates) and IV (control) of the paper, and the gains, limits and
//! rates of the Crazyflie's firmware, which adds integrals of position and yaw and the derivative of the body rates' error.
//!
//! What differs: this is another implementation, which of the same states makes the firmware's powers to 7 of 65535 (the firmware
//! rounds torques); the mass is the vehicle's, and a force becomes power by the vehicle's largest thrust (113,976 a newton for
//! the file `crazyflie`), where the firmware has 0.029 kg and 132,000; the position part runs when there is a new position
//! (100 Hz), not at 500 Hz.

use impromptu_flight::types::{MotorCommand, State};
use nalgebra::{Matrix3, Vector3};

use super::{
    motors::{Demand, FULL, Motors, largest_thrust},
    target::Target,
};
use crate::plant::{GRAVITY, PositionGains, Vehicle};

/// Of position, N/m, of velocity, N s/m, and of the position's integral, N/(m s); across, across, up.
const KP: [f32; 3] = [0.4, 0.4, 1.25];
const KV: [f32; 3] = [0.2, 0.2, 0.4];
const KI: [f32; 3] = [0.05, 0.05, 0.05];
/// Largest integral of the position error, m s.
const INTEGRAL: [f32; 3] = [2.0, 2.0, 0.4];
/// Of the attitude error, in motor power, of the body rates, s/rad, of their derivative, s²/rad; roll, pitch, yaw. The error is
/// the firmware's, twice the paper's.
const KR: [f32; 3] = [70_000.0, 70_000.0, 60_000.0];
const KW: [f32; 3] = [20_000.0, 20_000.0, 12_000.0];
const KD: [f32; 3] = [200.0, 200.0, 0.0];
/// Of the yaw error's integral, 1/s, and its limit, s.
const KI_YAW: f32 = 500.0;
const INTEGRAL_YAW: f32 = 1_500.0;
/// Largest torque, in motor power.
const TORQUE: f32 = 32_000.0;

/// What the position part wants of the attitude part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThrustWish {
    /// Force, world ENU, N.
    pub force: Vector3<f32>,
    /// Attitude whose z axis is along the force; columns are body axes in the world.
    pub attitude: Matrix3<f32>,
    /// Body rates, rad/s, body FLU.
    pub rates: Vector3<f32>,
}

impl ThrustWish {
    /// No force, no rotation.
    pub const NONE: Self = Self {
        force: Vector3::new(0.0, 0.0, 0.0),
        attitude: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        rates: Vector3::new(0.0, 0.0, 0.0),
    };
}

/// The controller.
#[derive(Clone, Debug)]
pub struct Mellinger {
    feed_forward: bool,
    mass: f32,
    /// Motor power for a newton of all rotors.
    per_newton: f32,
    reference_hz: f32,
    control_hz: f32,
    integral: Vector3<f32>,
    yaw_integral: f32,
    rate_error: Option<Vector3<f32>>,
    attitude: Matrix3<f32>,
    motors: Motors,
}

impl Mellinger {
    /// A controller whose position part runs at `reference_hz` and whose attitude part runs at `control_hz`.
    pub fn new(vehicle: &Vehicle, feed_forward: bool, reference_hz: f32, control_hz: f32) -> Self {
        Self {
            feed_forward,
            mass: vehicle.mass as f32,
            per_newton: FULL / (4.0 * largest_thrust(vehicle)) as f32,
            reference_hz,
            control_hz,
            integral: Vector3::zeros(),
            yaw_integral: 0.0,
            rate_error: None,
            attitude: Matrix3::identity(),
            motors: Motors::new(vehicle),
        }
    }

    /// Position part: F = Kp e_p + Kv e_v + Ki ∫e_p + m g z, and m a_d and the desired body rates if they are fed forward.
    pub fn position_step(&mut self, target: &Target, state: &State) -> ThrustWish {
        let reference = &target.reference;
        let (position_error, velocity_error) = (reference.position - state.position, reference.velocity - state.velocity);
        let mut acceleration = Vector3::new(0.0, 0.0, GRAVITY as f32);
        if self.feed_forward {
            acceleration += target.acceleration;
        }
        let mut force = acceleration * self.mass;
        for axis in 0..3 {
            let integral = self.integral[axis] + position_error[axis] / self.reference_hz;
            // A flight that left the numbers does not come back by its integral.
            self.integral[axis] = if integral.is_finite() { integral.clamp(-INTEGRAL[axis], INTEGRAL[axis]) } else { 0.0 };
            force[axis] += KP[axis] * position_error[axis] + KV[axis] * velocity_error[axis] + KI[axis] * self.integral[axis];
        }
        self.attitude = aligned(&force, reference.yaw).unwrap_or(self.attitude);
        let rates = if self.feed_forward { body_rates(target) } else { Vector3::zeros() };
        ThrustWish { force, attitude: self.attitude, rates }
    }

    /// Attitude part: rotor speeds. Torque = -KR e_R + Kw e_w + Kd de_w/dt, and an integral about z.
    pub fn attitude_step(&mut self, wanted: &ThrustWish, state: &State) -> MotorCommand {
        let attitude: Matrix3<f32> = *state.attitude.to_rotation_matrix().matrix();
        let thrust = self.per_newton * wanted.force.dot(&attitude.column(2));
        let rate_error = wanted.rates - state.rates;
        let rate_change = (rate_error - self.rate_error.unwrap_or(rate_error)) * self.control_hz;
        self.rate_error = Some(rate_error);
        if thrust.is_nan() || thrust <= 0.0 {
            (self.integral, self.yaw_integral) = (Vector3::zeros(), 0.0);
            return MotorCommand::OFF;
        }
        let turn = wanted.attitude.transpose() * attitude;
        let error = [turn[(2, 1)] - turn[(1, 2)], turn[(0, 2)] - turn[(2, 0)], turn[(1, 0)] - turn[(0, 1)]];
        self.yaw_integral = (self.yaw_integral - error[2] / self.control_hz).clamp(-INTEGRAL_YAW, INTEGRAL_YAW);
        let integral = [0.0, 0.0, KI_YAW * self.yaw_integral];
        let torque = std::array::from_fn(|axis| {
            let asked = KW[axis] * rate_error[axis] + KD[axis] * rate_change[axis] - KR[axis] * error[axis] + integral[axis];
            asked.clamp(-TORQUE, TORQUE)
        });
        self.motors.command(&Demand { thrust, torque })
    }
}

/// Gains for small errors, 1/s² and 1/s.
pub(super) fn position_gains(vehicle: &Vehicle) -> PositionGains {
    let per_mass = |gains: [f32; 3]| gains.map(|gain| f64::from(gain) / vehicle.mass);
    PositionGains { proportional: per_mass(KP), derivative: per_mass(KV) }
}

/// Body rates, rad/s, of a vehicle that flies the desired acceleration and jerk without error (h_ω of section III).
fn body_rates(target: &Target) -> Vector3<f32> {
    let thrust = target.acceleration + Vector3::new(0.0, 0.0, GRAVITY as f32);
    let Some(attitude) = aligned(&thrust, target.reference.yaw) else { return Vector3::zeros() };
    let turn = target.jerk / thrust.norm();
    Vector3::new(-turn.dot(&attitude.column(1)), turn.dot(&attitude.column(0)), attitude[(2, 2)] * target.yaw_rate)
}

/// Attitude whose third axis is along `force` and whose heading is `yaw`, rad; `None` if that is undefined.
fn aligned(force: &Vector3<f32>, yaw: f32) -> Option<Matrix3<f32>> {
    let heading = Vector3::new(libm::cosf(yaw), libm::sinf(yaw), 0.0);
    let z = force.try_normalize(1e-6)?;
    let y = z.cross(&heading).try_normalize(1e-6)?;
    Some(Matrix3::from_columns(&[y.cross(&z), y, z]))
}
