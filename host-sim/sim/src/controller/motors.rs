//! From a loop's output to the rotors, in the units of the Crazyflie's motors: 65535 is full power.
//!
//! *in* thrust and the three torques; *out* rotor speeds; *never* torque given up before thrust where a rotor is at its limit;
//! *source* the Crazyflie's documentation of its power distribution. What differs: a rotor's thrust is power / 65535 of the largest
//! thrust of this vehicle, at once and at every charge of the battery; numbers are not rounded.

use impromptu_flight::types::MotorCommand;

use crate::plant::Vehicle;

/// Full power of a motor.
pub const FULL: f32 = 65_535.0;

/// What the rotors shall do, in units of motor power.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Demand {
    /// Of each rotor.
    pub thrust: f32,
    /// About the body's x, y and z (FLU): a rotor gets half of the first two and all of the third, with its sign.
    pub torque: [f32; 3],
}

/// How power goes to the rotors.
#[derive(Clone, Debug)]
pub struct Motors {
    shares: [[f32; 3]; 4],
}

impl Motors {
    /// Those of a vehicle with a rotor in each quadrant.
    pub fn new(vehicle: &Vehicle) -> Self {
        let share = |arm: f64| if arm > 0.0 { 0.5 } else { -0.5 };
        let shares = vehicle.rotors.map(|rotor| {
            let [x, y, _] = rotor.position;
            [share(y), share(-x), f32::from(rotor.direction)]
        });
        Self { shares }
    }

    /// Rotor speeds. If a rotor shall give more than it has, all give less, by as much; none less than nothing.
    pub fn command(&self, demand: &Demand) -> MotorCommand {
        let powers = self.shares.map(|shares| {
            shares.iter().zip(demand.torque).fold(demand.thrust, |power, (share, torque)| power + share * torque)
        });
        let excess = powers.iter().fold(0.0f32, |excess, power| excess.max(power - FULL));
        MotorCommand::saturated(powers.map(|power| ((power - excess).max(0.0) / FULL).sqrt()))
    }
}

/// Largest thrust of a rotor, N.
pub(super) fn largest_thrust(vehicle: &Vehicle) -> f64 {
    vehicle.thrust_coefficient * vehicle.rotor_speed_max.powi(2)
}
