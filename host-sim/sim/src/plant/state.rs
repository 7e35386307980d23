//! What the plant carries from step to step: the states of [`BATCH`] flights side by side, and of one flight.

/// Flights that one call advances: as many f64 as one 512-bit register holds.
pub const BATCH: usize = 8;

/// One scalar of each of the [`BATCH`] flights.
pub type Batch = [f64; BATCH];

/// The state of one flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Position of the centre of mass, m, world ENU.
    pub position: [f64; 3],
    /// Velocity, m/s, world ENU.
    pub velocity: [f64; 3],
    /// Attitude: Hamilton quaternion (w, x, y, z), body FLU to world ENU.
    pub attitude: [f64; 4],
    /// Body rates, rad/s, body FLU.
    pub body_rates: [f64; 3],
    /// Rotor speeds, rad/s, in the vehicle's rotor order.
    pub rotor_speeds: [f64; 4],
}

impl State {
    /// At rest and level at `position` (m, world ENU), the rotors standing still.
    pub const fn at_rest(position: [f64; 3]) -> Self {
        Self { position, velocity: [0.0; 3], attitude: [1.0, 0.0, 0.0, 0.0], body_rates: [0.0; 3], rotor_speeds: [0.0; 4] }
    }
}

/// The states of [`BATCH`] flights, structure of arrays: `field[component][member]`, units and frames as in [`State`].
///
/// A time derivative has the same shape: each component is then "per second".
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub struct States {
    /// Positions, m, world ENU.
    pub position: [Batch; 3],
    /// Velocities, m/s, world ENU.
    pub velocity: [Batch; 3],
    /// Attitudes: Hamilton quaternions (w, x, y, z), body FLU to world ENU.
    pub attitude: [Batch; 4],
    /// Body rates, rad/s, body FLU.
    pub body_rates: [Batch; 3],
    /// Rotor speeds, rad/s.
    pub rotor_speeds: [Batch; 4],
}

impl States {
    /// Every member starts as `state`.
    pub fn splat(state: &State) -> Self {
        Self {
            position: state.position.map(|value| [value; BATCH]),
            velocity: state.velocity.map(|value| [value; BATCH]),
            attitude: state.attitude.map(|value| [value; BATCH]),
            body_rates: state.body_rates.map(|value| [value; BATCH]),
            rotor_speeds: state.rotor_speeds.map(|value| [value; BATCH]),
        }
    }

    /// The flight in `member` (`member < BATCH`).
    #[inline]
    pub fn member(&self, member: usize) -> State {
        State {
            position: gather(&self.position, member),
            velocity: gather(&self.velocity, member),
            attitude: gather(&self.attitude, member),
            body_rates: gather(&self.body_rates, member),
            rotor_speeds: gather(&self.rotor_speeds, member),
        }
    }

    /// Puts a flight into `member` (`member < BATCH`).
    #[inline]
    pub fn set_member(&mut self, member: usize, state: &State) {
        scatter(&mut self.position, member, &state.position);
        scatter(&mut self.velocity, member, &state.velocity);
        scatter(&mut self.attitude, member, &state.attitude);
        scatter(&mut self.body_rates, member, &state.body_rates);
        scatter(&mut self.rotor_speeds, member, &state.rotor_speeds);
    }
}

/// What the surroundings do to each flight during one step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(align(64))]
pub struct Disturbance {
    /// Velocity of the air, m/s, world ENU.
    pub wind_velocity: [Batch; 3],
    /// Acceleration added to the vehicle's own, m/s², world ENU: an unmodelled force divided by the mass.
    pub acceleration: [Batch; 3],
}

impl Disturbance {
    /// Puts the air velocity (m/s) and the added acceleration (m/s²), both world ENU, of one flight into `member` (`member < BATCH`).
    #[inline]
    pub fn set_member(&mut self, member: usize, wind_velocity: [f64; 3], acceleration: [f64; 3]) {
        scatter(&mut self.wind_velocity, member, &wind_velocity);
        scatter(&mut self.acceleration, member, &acceleration);
    }
}

/// One member of each component.
#[inline(always)]
pub(super) fn gather<const N: usize>(components: &[Batch; N], member: usize) -> [f64; N] {
    std::array::from_fn(|component| components[component][member])
}

/// Writes one member of each component.
#[inline(always)]
pub(super) fn scatter<const N: usize>(components: &mut [Batch; N], member: usize, values: &[f64; N]) {
    for (component, value) in components.iter_mut().zip(values) {
        component[member] = *value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_member_comes_back_and_leaves_the_others_alone() {
        let rest = State::at_rest([1.0, 2.0, 3.0]);
        let moving = State {
            position: [4.0, 5.0, 6.0],
            velocity: [0.1, 0.2, 0.3],
            attitude: [0.5, -0.5, 0.5, -0.5],
            body_rates: [7.0, 8.0, 9.0],
            rotor_speeds: [10.0, 11.0, 12.0, 13.0],
        };
        let mut states = States::splat(&rest);
        states.set_member(5, &moving);
        for member in 0..BATCH {
            assert_eq!(states.member(member), if member == 5 { moving } else { rest });
        }
    }
}
