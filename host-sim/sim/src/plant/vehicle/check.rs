//! Which constants a vehicle may have: those with which the equations have a meaning, and that some quadrotor can have.

use impromptu_files::name::plain;

use super::{Vehicle, VehicleError};

/// A field, its values, from where to where each of them may be, and the unit.
type Range<'a> = (&'static str, &'a [f64], f64, f64, &'static str);

impl Vehicle {
    /// Refuses what no quadrotor is, from a gram to a hundred kilograms.
    ///
    /// # Errors
    /// Names the first field whose value is out of range, the value and the range.
    pub fn check(&self) -> Result<(), VehicleError> {
        let refuse =
            |field, found: String, rule: String| Err(VehicleError::Value { vehicle: self.name.clone(), field, found, rule });
        for name in std::iter::once(&self.name).chain(self.position_gains.keys()) {
            if let Err(error) = plain(name) {
                let field = if *name == self.name { "name" } else { "position_gains" };
                return refuse(field, format!("{name:?}"), format!("a plain name ({error})"));
            }
        }
        let inertia = &self.inertia;
        let entries = [inertia.xx, inertia.yy, inertia.zz, inertia.xy, inertia.yz, inertia.xz];
        let rotors: Vec<f64> = self.rotors.iter().flat_map(|rotor| rotor.position).collect();
        let gains = self.position_gains.values();
        let gains: Vec<f64> = gains.flat_map(|gains| gains.proportional.into_iter().chain(gains.derivative)).collect();
        let attitude = [self.attitude_gains.proportional, self.attitude_gains.derivative];
        let ranges: [Range<'_>; 14] = [
            ("mass", &[self.mass], 1e-3, 100.0, "kg"),
            ("thrust_coefficient", &[self.thrust_coefficient], 1e-12, 1.0, "N s²/rad²"),
            ("torque_coefficient", &[self.torque_coefficient], 1e-15, 1.0, "N m s²/rad²"),
            ("rotor_drag", &[self.rotor_drag], 0.0, 1.0, "kg/rad"),
            ("inflow_drag", &[self.inflow_drag], 0.0, 1.0, "kg/rad"),
            ("translational_lift", &[self.translational_lift], 0.0, 10.0, "kg/m"),
            ("flapping", &[self.flapping], 0.0, 1.0, "kg m/rad"),
            ("parasitic_drag", &self.parasitic_drag, 0.0, 100.0, "kg/m"),
            ("motor_time_constant", &[self.motor_time_constant], 1e-4, 2.0, "s"),
            ("rotor_speed_max", &[self.rotor_speed_max], 1.0, 1e5, "rad/s"),
            ("inertia", &entries, -100.0, 100.0, "kg m²"),
            ("attitude_gains", &attitude, 0.0, 1e6, "1/s², 1/s"),
            ("rotors.position", &rotors, -10.0, 10.0, "m"),
            ("position_gains", &gains, 0.0, 1e4, "1/s², 1/s"),
        ];
        for (field, values, low, high, unit) in ranges {
            // Written so that what is not a number is refused as well.
            if let Some(value) = values.iter().find(|value| !(low..=high).contains(*value)) {
                return refuse(field, value.to_string(), format!("from {low} to {high} ({unit})"));
            }
        }
        if !(0.0..self.rotor_speed_max).contains(&self.rotor_speed_min) {
            let rule = "zero or more, and below rotor_speed_max (rad/s)";
            return refuse("rotor_speed_min", self.rotor_speed_min.to_string(), rule.into());
        }
        if inertia.matrix().cholesky().is_none() {
            return refuse("inertia", format!("{entries:?}"), "a positive definite matrix".into());
        }
        match self.rotors.iter().find(|rotor| rotor.direction.abs() != 1) {
            Some(rotor) => refuse("rotors.direction", rotor.direction.to_string(), "1 or -1".into()),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bad_files_are_refused_by_field_with_value_and_range() {
        let good = include_str!("../../../vehicles/crazyflie.toml");
        for (from, to, expected) in [
            ("mass = 0.03 ", "mas = 0.03 ", "mas"),
            ("mass = 0.03 ", "mass = nan ", "`mass` is NaN; it must be from 0.001 to 100 (kg)"),
            ("mass = 0.03 ", "mass = 1e12 ", "`mass` is 1000000000000; it must be from 0.001 to 100 (kg)"),
            ("rotor_speed_max = 2500.0", "rotor_speed_max = 0.0", "`rotor_speed_max` is 0; it must be from 1"),
            (
                "rotor_speed_min = 0.0",
                "rotor_speed_min = 2500.0",
                "`rotor_speed_min` is 2500; it must be zero or more, and below",
            ),
            ("xy = 0.0", "xy = 1.0", "it must be a positive definite matrix"),
            ("direction = -1", "direction = 2", "`rotors.direction` is 2; it must be 1 or -1"),
            ("derivative = [4.0", "derivative = [-4.0", "`position_gains` is -4; it must be from 0"),
            ("name = \"crazyflie\"", "name = \"x/../..\"", "`name` is \"x/../..\"; it must be a plain name"),
            ("name = \"crazyflie\"", "name = \"a\\u001bb\"", "`name` is \"a\\u{1b}b\"; it must be a plain name"),
            ("[inertia]", "[inertias]", "inertias"),
        ] {
            assert!(good.contains(from), "{from}");
            let message = Vehicle::from_toml(&good.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(message.contains(expected), "{to}: {message}");
        }
    }
}
