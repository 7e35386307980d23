//! What commands carry.
//!
//! *in/out* the crate's values as plain numbers, SI units, world ENU, body FLU; *never* another bit than the sender's: attitudes
//! are not normalised, so that a flight over the link has the bits of a flight without.

use nalgebra::{Quaternion, UnitQuaternion};
use serde::{Deserialize, Serialize};

use crate::types::{self, State, Tick};

/// The part of the state that a vehicle measures itself.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Inertial {
    /// Control tick.
    pub tick: u32,
    /// Hamilton quaternion body to world: w, x, y, z.
    pub attitude: [f32; 4],
    /// Body rates, rad/s, body FLU.
    pub rates: [f32; 3],
}

impl Inertial {
    /// The inertial part of a state.
    pub fn new(Tick(tick): Tick, state: &State) -> Self {
        let Quaternion { coords: q } = *state.attitude.quaternion();
        Self { tick, attitude: [q.w, q.x, q.y, q.z], rates: state.rates.into() }
    }

    /// Puts this part into a state, bit by bit.
    pub fn apply(&self, state: &mut State) {
        let [w, x, y, z] = self.attitude;
        state.attitude = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
        state.rates = self.rates.into();
    }
}

/// The part of the state that comes from motion capture or an estimator.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Position {
    /// Control tick.
    pub tick: u32,
    /// Position, world ENU, m.
    pub position: [f32; 3],
    /// Velocity, world ENU, m/s.
    pub velocity: [f32; 3],
    /// Vertical acceleration in the world frame without gravity, m/s².
    pub vertical_acceleration: f32,
}

impl Position {
    /// The position part of a state.
    pub fn new(Tick(tick): Tick, state: &State) -> Self {
        let State { position, velocity, vertical_acceleration, .. } = *state;
        Self { tick, position: position.into(), velocity: velocity.into(), vertical_acceleration }
    }

    /// Puts this part into a state, bit by bit.
    pub fn apply(&self, state: &mut State) {
        state.position = self.position.into();
        state.velocity = self.velocity.into();
        state.vertical_acceleration = self.vertical_acceleration;
    }
}

/// A sample of the desired trajectory and when it is due.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimedSetpoint {
    /// Reference tick.
    pub tick: i32,
    /// Position, world ENU, m.
    pub position: [f32; 3],
    /// Velocity, world ENU, m/s.
    pub velocity: [f32; 3],
    /// Acceleration, world ENU, m/s².
    pub acceleration: [f32; 3],
    /// Yaw, rad.
    pub yaw: f32,
}

impl TimedSetpoint {
    /// A setpoint for a reference tick.
    pub fn new(tick: i32, setpoint: &types::Setpoint) -> Self {
        let types::Setpoint { position, velocity, acceleration, yaw } = *setpoint;
        Self { tick, position: position.into(), velocity: velocity.into(), acceleration: acceleration.into(), yaw }
    }

    /// The setpoint.
    pub fn setpoint(&self) -> types::Setpoint {
        let Self { position, velocity, acceleration, yaw, .. } = *self;
        types::Setpoint { position: position.into(), velocity: velocity.into(), acceleration: acceleration.into(), yaw }
    }
}

/// A piece of a model file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModelChunk<'a> {
    /// Where it belongs, bytes from the start of the file.
    pub offset: u32,
    /// At most [`crate::link::CHUNK`] bytes.
    pub bytes: &'a [u8],
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn states_and_setpoints_keep_every_bit(values in prop::collection::vec(any::<f32>(), 24)) {
            let vector = |from: usize| Vector3::new(values[from], values[from + 1], values[from + 2]);
            let state = State {
                position: vector(0),
                velocity: vector(3),
                attitude: UnitQuaternion::new_unchecked(Quaternion::new(values[6], values[7], values[8], values[9])),
                rates: vector(10),
                vertical_acceleration: values[13],
            };
            let mut copy = State::default();
            Inertial::new(Tick(1), &state).apply(&mut copy);
            Position::new(Tick(1), &state).apply(&mut copy);
            prop_assert_eq!(copy, state);
            let (position, velocity, acceleration) = (vector(14), vector(17), vector(20));
            let setpoint = types::Setpoint { position, velocity, acceleration, yaw: values[23] };
            prop_assert_eq!(TimedSetpoint::new(-3, &setpoint).setpoint(), setpoint);
        }
    }
}
