//! From a loop's output to the rotors, in the units of the Crazyflie's motors: 65535 is full power.
//!
//! *in* thrust and the three torques; *out* rotor speeds; *never* torque given up before thrust where a rotor is at its limit;
//! *source* the Crazyflie's documentation of its power distribution. What differs: a rotor's thrust is power / 65535 of the
//! largest thrust of this vehicle, at every charge of the battery; numbers are not rounded.

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
        let powers = self
            .shares
            .map(|shares| shares.iter().zip(demand.torque).fold(demand.thrust, |power, (share, torque)| power + share * torque));
        let excess = powers.iter().fold(0.0f32, |excess, power| excess.max(power - FULL));
        MotorCommand::saturated(powers.map(|power| ((power - excess).max(0.0) / FULL).sqrt()))
    }
}

/// Largest thrust of a rotor, N.
pub(super) fn largest_thrust(vehicle: &Vehicle) -> f64 {
    vehicle.thrust_coefficient * vehicle.rotor_speed_max.powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Forces of the rotors as shares of the largest, front left, front right, rear right, rear left.
    fn shares(thrust: f32, torque: [f32; 3]) -> [f32; 4] {
        let motors = Motors::new(&Vehicle::named("crazyflie").unwrap());
        motors.command(&Demand { thrust, torque }).fractions().map(|speed| speed * speed)
    }

    #[test]
    fn thrust_is_power_and_torques_have_the_bodys_signs() {
        let near = |found: [f32; 4], expected: [f32; 4]| {
            assert!(found.iter().zip(expected).all(|(found, expected)| (found * FULL - expected).abs() < 0.1), "{found:?}");
        };
        near(shares(30_000.0, [0.0; 3]), [30_000.0; 4]);
        // Left side up; nose down; nose to the left, with the rotors that push there.
        near(shares(30_000.0, [2_000.0, 0.0, 0.0]), [31_000.0, 29_000.0, 29_000.0, 31_000.0]);
        near(shares(30_000.0, [0.0, 2_000.0, 0.0]), [29_000.0, 29_000.0, 31_000.0, 31_000.0]);
        near(shares(30_000.0, [0.0, 0.0, 1_000.0]), [31_000.0, 29_000.0, 31_000.0, 29_000.0]);
    }

    #[test]
    fn thrust_is_given_up_before_torque() {
        let found = shares(64_000.0, [8_000.0, 0.0, 0.0]);
        assert!((found[0] - 1.0).abs() < 1e-6 && ((found[0] - found[1]) * FULL - 8_000.0).abs() < 0.1, "{found:?}");
        assert_eq!(shares(1_000.0, [8_000.0, 0.0, 0.0])[1], 0.0);
        assert_eq!(shares(f32::NAN, [0.0; 3]), [0.0; 4]);
    }
}
