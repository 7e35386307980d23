//! Values that cross the boundary of the flight stack.
//!
//! *in/out* plain values in SI units, world ENU, body FLU; *never* a motor command outside 0..1 or non-finite;
//! *source* conventions of the crate root; the limits below are far beyond what any multirotor does, and far within what f32
//! computes with.

use impromptu_firmware::math::{abs, clamp, finite_or_zero};
use nalgebra::{Quaternion, UnitQuaternion, Vector3, Vector4};

/// Largest coordinate of a position, m: beyond the range of any multirotor from where it took off.
pub const POSITION_LIMIT: f32 = 10_000.0;
/// Largest component of a velocity, m/s: twice the fastest multirotor.
pub const VELOCITY_LIMIT: f32 = 400.0;
/// Largest component of an acceleration, m/s²: 100 g, six times what the sensors of flight controllers measure (16 g).
pub const ACCELERATION_LIMIT: f32 = 1_000.0;
/// Largest body rate, rad/s: five times what the gyroscopes of flight controllers measure (2000 °/s).
pub const RATE_LIMIT: f32 = 175.0;
/// Largest yaw, rad, of whoever counts turns: as far as its sine is exact
/// ([`impromptu_firmware::math::sin_cos`]).
pub const YAW_LIMIT: f32 = 8_192.0;
/// How far from 1 the squared length of an attitude's quaternion may be: rounding, and what the link lets pass.
pub const ATTITUDE_TOLERANCE: f32 = 3e-3;

/// Whether each number is at most `limit` away from 0; NaN is not.
pub(crate) fn within(values: &[f32], limit: f32) -> bool {
    values.iter().all(|value| abs(*value) <= limit)
}

/// Count of control ticks (500 Hz by default) since the stack started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Tick(pub u32);

/// What the loop is told about the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Position, world ENU, m. May be older than the attitude: motion capture arrives late.
    pub position: Vector3<f32>,
    /// Velocity, world ENU, m/s; as old as the position.
    pub velocity: Vector3<f32>,
    /// Attitude, Hamilton quaternion body to world.
    pub attitude: UnitQuaternion<f32>,
    /// Body rates, rad/s, body FLU.
    pub rates: Vector3<f32>,
    /// Vertical acceleration in the world frame without gravity, m/s² (a network input only; 0 if unknown).
    pub vertical_acceleration: f32,
}

impl Default for State {
    fn default() -> Self {
        Self::ORIGIN
    }
}

impl State {
    /// At rest and level in the origin.
    pub const ORIGIN: Self = Self {
        position: Vector3::new(0.0, 0.0, 0.0),
        velocity: Vector3::new(0.0, 0.0, 0.0),
        attitude: UnitQuaternion::new_unchecked(Quaternion::from_vector(Vector4::new(0.0, 0.0, 0.0, 1.0))),
        rates: Vector3::new(0.0, 0.0, 0.0),
        vertical_acceleration: 0.0,
    };

    /// Whether a vehicle can be there and so: every number within the limits above, the attitude's length 1. What is not so is
    /// no measurement, whatever it is.
    pub fn is_physical(&self) -> bool {
        let q = &self.attitude.coords;
        within(self.position.as_slice(), POSITION_LIMIT)
            && within(self.velocity.as_slice(), VELOCITY_LIMIT)
            && within(self.rates.as_slice(), RATE_LIMIT)
            && abs(self.vertical_acceleration) <= ACCELERATION_LIMIT
            && abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1.0) <= ATTITUDE_TOLERANCE
    }

    /// Builds a state from raw numbers; `attitude` is `[w, x, y, z]` and is normalised here.
    /// `None` if any number is not finite or the quaternion is near zero.
    pub fn from_raw(position: [f32; 3], velocity: [f32; 3], attitude: [f32; 4], rates: [f32; 3]) -> Option<Self> {
        let finite = |values: &[f32]| values.iter().all(|value| value.is_finite());
        if !(finite(&position) && finite(&velocity) && finite(&attitude) && finite(&rates)) {
            return None;
        }
        let quaternion = Quaternion::new(attitude[0], attitude[1], attitude[2], attitude[3]);
        Some(Self {
            position: position.into(),
            velocity: velocity.into(),
            attitude: UnitQuaternion::try_new(quaternion, 1e-3)?,
            rates: rates.into(),
            vertical_acceleration: 0.0,
        })
    }
}

/// One sample of the desired trajectory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Setpoint {
    /// Position, world ENU, m.
    pub position: Vector3<f32>,
    /// Velocity, world ENU, m/s.
    pub velocity: Vector3<f32>,
    /// Acceleration, world ENU, m/s².
    pub acceleration: Vector3<f32>,
    /// Yaw, rad.
    pub yaw: f32,
}

impl Setpoint {
    /// At rest in the origin.
    pub const ORIGIN: Self = {
        let zero = Vector3::new(0.0, 0.0, 0.0);
        Self { position: zero, velocity: zero, acceleration: zero, yaw: 0.0 }
    };

    /// Whether a vehicle can be asked for it: every number within the limits above.
    pub fn is_physical(&self) -> bool {
        within(self.position.as_slice(), POSITION_LIMIT)
            && within(self.velocity.as_slice(), VELOCITY_LIMIT)
            && within(self.acceleration.as_slice(), ACCELERATION_LIMIT)
            && abs(self.yaw) <= YAW_LIMIT
    }
}

/// What the baseline loop tracks: the desired state, corrected.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reference {
    /// Position, world ENU, m.
    pub position: Vector3<f32>,
    /// Velocity, world ENU, m/s.
    pub velocity: Vector3<f32>,
    /// Yaw, rad.
    pub yaw: f32,
}

impl Reference {
    /// At rest in the origin.
    pub const ORIGIN: Self = Self { position: Vector3::new(0.0, 0.0, 0.0), velocity: Vector3::new(0.0, 0.0, 0.0), yaw: 0.0 };
}

/// Rotor speeds as fractions of the largest speed: always finite, always in 0..=1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotorCommand([f32; 4]);

impl MotorCommand {
    /// Motors off.
    pub const OFF: Self = Self([0.0; 4]);

    /// Clamps each fraction to 0..=1; what is not finite becomes 0.
    pub fn saturated(fractions: [f32; 4]) -> Self {
        Self(fractions.map(|fraction| clamp(finite_or_zero(fraction), 0.0, 1.0)))
    }

    /// Fractions of the largest rotor speed, rotors 1..4.
    pub fn fractions(&self) -> [f32; 4] {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn motor_commands_are_always_fractions(bits in any::<[u32; 4]>()) {
            let command = MotorCommand::saturated(bits.map(f32::from_bits));
            prop_assert!(command.fractions().iter().all(|f| (0.0..=1.0).contains(f)));
        }

        #[test]
        fn what_is_physical_is_within_every_limit(index in 0usize..14, bits in any::<u32>()) {
            let mut raw = [0.1f32; 14];
            raw[index] = f32::from_bits(bits);
            let part = |from: usize| Vector3::new(raw[from], raw[from + 1], raw[from + 2]);
            let limits = [[POSITION_LIMIT; 3], [VELOCITY_LIMIT; 3], [RATE_LIMIT; 3]];
            let expected = limits.as_flattened().iter().chain(&[ACCELERATION_LIMIT]).zip(raw).all(|(l, x)| x.abs() <= *l);
            let (position, velocity, rates) = (part(0), part(3), part(6));
            let state = State { position, velocity, rates, vertical_acceleration: raw[9], ..State::ORIGIN };
            prop_assert_eq!(state.is_physical(), expected);
            let turned = Quaternion::from_vector(Vector4::new(0.0, 0.0, 0.0, raw[index]));
            let state = State { attitude: UnitQuaternion::new_unchecked(turned), ..State::ORIGIN };
            prop_assert!(!state.is_physical() || (raw[index].abs() - 1.0).abs() < 2e-3);
            let setpoint = Setpoint { position, velocity, acceleration: part(10), yaw: raw[13] };
            let limits = [[POSITION_LIMIT; 3], [VELOCITY_LIMIT; 3]];
            let mut others = raw[10..13].iter().map(|x| (x, ACCELERATION_LIMIT)).chain([(&raw[13], YAW_LIMIT)]);
            let expected = limits.as_flattened().iter().zip(raw).all(|(l, x)| x.abs() <= *l) && others.all(|(x, l)| x.abs() <= l);
            prop_assert_eq!(setpoint.is_physical(), expected);
        }

        #[test]
        fn states_with_a_bad_number_are_refused(index in 0usize..13, bad in prop::sample::select(vec![f32::NAN, f32::INFINITY])) {
            let mut raw = [0.1f32; 13];
            raw[index] = bad;
            let part = |from: usize| [raw[from], raw[from + 1], raw[from + 2]];
            prop_assert!(State::from_raw(part(0), part(3), [raw[6], raw[7], raw[8], raw[9]], part(10)).is_none());
        }
    }
}
