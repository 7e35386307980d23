//! Which constants a vehicle may have.

use super::{Vehicle, VehicleError};

impl Vehicle {
    /// Refuses constants with which the equations have no meaning.
    ///
    /// # Errors
    /// Names the first field whose value is out of range.
    pub fn check(&self) -> Result<(), VehicleError> {
        let positive = |value: f64| value.is_finite() && value > 0.0;
        let non_negative = |value: f64| value.is_finite() && value >= 0.0;
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let speeds =
            non_negative(self.rotor_speed_min) && self.rotor_speed_max.is_finite() && self.rotor_speed_max > self.rotor_speed_min;
        let gains = self.position_gains.values();
        let rules = [
            ("mass", "positive", positive(self.mass)),
            ("thrust_coefficient", "positive", positive(self.thrust_coefficient)),
            ("torque_coefficient", "positive", positive(self.torque_coefficient)),
            ("rotor_drag", "zero or positive", non_negative(self.rotor_drag)),
            ("inflow_drag", "zero or positive", non_negative(self.inflow_drag)),
            ("translational_lift", "zero or positive", non_negative(self.translational_lift)),
            ("flapping", "zero or positive", non_negative(self.flapping)),
            ("parasitic_drag", "zero or positive", self.parasitic_drag.into_iter().all(non_negative)),
            ("motor_time_constant", "positive", positive(self.motor_time_constant)),
            ("rotor_speed_max", "above rotor_speed_min, which is zero or positive", speeds),
            ("inertia", "a positive definite matrix", self.inertia.matrix().cholesky().is_some()),
            ("attitude_gains", "finite", finite(&[self.attitude_gains.proportional, self.attitude_gains.derivative])),
            ("rotors.position", "finite", self.rotors.iter().all(|rotor| finite(&rotor.position))),
            ("rotors.direction", "1 or -1", self.rotors.iter().all(|rotor| rotor.direction.abs() == 1)),
            ("position_gains", "finite", gains.into_iter().all(|gains| finite(&gains.proportional) && finite(&gains.derivative))),
        ];
        match rules.into_iter().find(|(_, _, holds)| !holds) {
            None => Ok(()),
            Some((field, rule, _)) => Err(VehicleError::Value { vehicle: self.name.clone(), field, rule }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bad_files_are_refused_by_field() {
        let good = include_str!("../../../vehicles/crazyflie.toml");
        for (from, to, expected) in [
            ("mass = 0.03 ", "mas = 0.03 ", "mas"),
            ("mass = 0.03 ", "mass = nan ", "`mass` must be positive"),
            ("rotor_speed_max = 2500.0", "rotor_speed_max = 0.0", "`rotor_speed_max` must be above"),
            ("xy = 0.0", "xy = 1.0", "`inertia` must be a positive definite"),
            ("direction = -1", "direction = 2", "`rotors.direction` must be 1 or -1"),
            ("[inertia]", "[inertias]", "inertias"),
        ] {
            assert!(good.contains(from));
            let message = Vehicle::from_toml(&good.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(message.contains(expected), "{to}: {message}");
        }
    }
}
