//! Values that cross the boundary of the flight stack.
//!
//! *in/out* plain values in SI units, world ENU, body FLU; *never* a motor command outside 0..1 or non-finite;
//! *source* conventions of the crate root.

use impromptu_firmware::math::{clamp, finite_or_zero};
use nalgebra::{Quaternion, UnitQuaternion, Vector3, Vector4};

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
        fn states_with_a_bad_number_are_refused(index in 0usize..13, bad in prop::sample::select(vec![f32::NAN, f32::INFINITY])) {
            let mut raw = [0.1f32; 13];
            raw[index] = bad;
            let part = |from: usize| [raw[from], raw[from + 1], raw[from + 2]];
            prop_assert!(State::from_raw(part(0), part(3), [raw[6], raw[7], raw[8], raw[9]], part(10)).is_none());
        }
    }
}
