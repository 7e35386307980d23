//! What the plant carries from step to step: the states of [`LANES`] flights side by side, and of one flight.

/// Flights that one call advances: as many f64 as one 512-bit register holds.
pub const LANES: usize = 8;

/// One scalar of each of the [`LANES`] flights.
pub type Lanes = [f64; LANES];

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

/// The states of [`LANES`] flights, structure of arrays: `field[component][lane]`, units and frames as in [`State`].
///
/// A time derivative has the same shape: each component is then "per second".
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub struct States {
    /// Positions, m, world ENU.
    pub position: [Lanes; 3],
    /// Velocities, m/s, world ENU.
    pub velocity: [Lanes; 3],
    /// Attitudes: Hamilton quaternions (w, x, y, z), body FLU to world ENU.
    pub attitude: [Lanes; 4],
    /// Body rates, rad/s, body FLU.
    pub body_rates: [Lanes; 3],
    /// Rotor speeds, rad/s.
    pub rotor_speeds: [Lanes; 4],
}

impl States {
    /// Every lane starts as `state`.
    pub fn splat(state: &State) -> Self {
        Self {
            position: state.position.map(|value| [value; LANES]),
            velocity: state.velocity.map(|value| [value; LANES]),
            attitude: state.attitude.map(|value| [value; LANES]),
            body_rates: state.body_rates.map(|value| [value; LANES]),
            rotor_speeds: state.rotor_speeds.map(|value| [value; LANES]),
        }
    }

    /// The flight in `lane` (`lane < LANES`).
    #[inline]
    pub fn lane(&self, lane: usize) -> State {
        State {
            position: gather(&self.position, lane),
            velocity: gather(&self.velocity, lane),
            attitude: gather(&self.attitude, lane),
            body_rates: gather(&self.body_rates, lane),
            rotor_speeds: gather(&self.rotor_speeds, lane),
        }
    }

    /// Puts a flight into `lane` (`lane < LANES`).
    #[inline]
    pub fn set_lane(&mut self, lane: usize, state: &State) {
        scatter(&mut self.position, lane, &state.position);
        scatter(&mut self.velocity, lane, &state.velocity);
        scatter(&mut self.attitude, lane, &state.attitude);
        scatter(&mut self.body_rates, lane, &state.body_rates);
        scatter(&mut self.rotor_speeds, lane, &state.rotor_speeds);
    }
}

/// What the surroundings do to each flight during one step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(align(64))]
pub struct Disturbance {
    /// Velocity of the air, m/s, world ENU.
    pub wind_velocity: [Lanes; 3],
    /// Acceleration added to the vehicle's own, m/s², world ENU: an unmodelled force divided by the mass.
    pub acceleration: [Lanes; 3],
}

impl Disturbance {
    /// Puts the air velocity (m/s) and the added acceleration (m/s²), both world ENU, of one flight into `lane` (`lane < LANES`).
    #[inline]
    pub fn set_lane(&mut self, lane: usize, wind_velocity: [f64; 3], acceleration: [f64; 3]) {
        scatter(&mut self.wind_velocity, lane, &wind_velocity);
        scatter(&mut self.acceleration, lane, &acceleration);
    }
}

/// One lane of each component.
#[inline(always)]
pub(super) fn gather<const N: usize>(components: &[Lanes; N], lane: usize) -> [f64; N] {
    std::array::from_fn(|component| components[component][lane])
}

/// Writes one lane of each component.
#[inline(always)]
pub(super) fn scatter<const N: usize>(components: &mut [Lanes; N], lane: usize, values: &[f64; N]) {
    for (component, value) in components.iter_mut().zip(values) {
        component[lane] = *value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lane_comes_back_and_leaves_the_others_alone() {
        let rest = State::at_rest([1.0, 2.0, 3.0]);
        let moving = State {
            position: [4.0, 5.0, 6.0],
            velocity: [0.1, 0.2, 0.3],
            attitude: [0.5, -0.5, 0.5, -0.5],
            body_rates: [7.0, 8.0, 9.0],
            rotor_speeds: [10.0, 11.0, 12.0, 13.0],
        };
        let mut states = States::splat(&rest);
        states.set_lane(5, &moving);
        for lane in 0..LANES {
            assert_eq!(states.lane(lane), if lane == 5 { moving } else { rest });
        }
    }
}
