//! The constants of a vehicle and of its baseline loop, as data: one TOML file each, every number sourced there.

mod check;

use std::collections::BTreeMap;

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

/// The vehicle files that the program carries: (name, TOML text).
const EMBEDDED: [(&str, &str); 3] = [
    ("crazyflie", include_str!("../../vehicles/crazyflie.toml")),
    ("crazyflie-brushless", include_str!("../../vehicles/crazyflie-brushless.toml")),
    ("hummingbird", include_str!("../../vehicles/hummingbird.toml")),
];

/// A quadrotor: what flies, and the gains it is flown with. SI units, body frame FLU about the centre of mass.
///
/// Symbols in brackets are those of the equations in [`crate::plant`] and of RotorPy's parameter files.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Vehicle {
    /// What the command line and the reports call it.
    pub name: String,
    /// Mass (m), kg.
    pub mass: f64,
    /// Thrust of a rotor per squared speed (k_eta), N s²/rad².
    pub thrust_coefficient: f64,
    /// Reaction torque of a rotor per squared speed (k_m), N m s²/rad².
    pub torque_coefficient: f64,
    /// Rotor drag in the rotor's plane per speed and airspeed (k_d), kg/rad.
    pub rotor_drag: f64,
    /// Loss of thrust with the airspeed along the rotor's axis, per speed and airspeed (k_z), kg/rad.
    pub inflow_drag: f64,
    /// Gain of thrust with the squared airspeed in the rotor's plane (k_h), kg/m.
    pub translational_lift: f64,
    /// Flapping moment per speed and airspeed (k_flap), kg m/rad.
    pub flapping: f64,
    /// Drag of the frame per squared airspeed along the body's x, y and z (c_Dx, c_Dy, c_Dz), kg/m.
    pub parasitic_drag: [f64; 3],
    /// Time constant of the first-order rotor speed response, up and down (tau_m), s.
    pub motor_time_constant: f64,
    /// Lowest rotor speed that can be commanded, rad/s.
    pub rotor_speed_min: f64,
    /// Highest rotor speed that can be commanded, rad/s.
    pub rotor_speed_max: f64,
    /// Inertia about the centre of mass.
    pub inertia: Inertia,
    /// Gains of the attitude loop.
    pub attitude_gains: AttitudeGains,
    /// The four rotors, in the order of the commands.
    pub rotors: [Rotor; 4],
    /// Gains of the position loop, by name ("stock", "soft").
    pub position_gains: BTreeMap<String, PositionGains>,
}

/// The entries of the symmetric inertia matrix (J), kg m²: `xy` is the matrix entry itself, sign included.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inertia {
    /// About the body's x axis, kg m².
    pub xx: f64,
    /// About the body's y axis, kg m².
    pub yy: f64,
    /// About the body's z axis, kg m².
    pub zz: f64,
    /// Entry (x, y), kg m².
    pub xy: f64,
    /// Entry (y, z), kg m².
    pub yz: f64,
    /// Entry (x, z), kg m².
    pub xz: f64,
}

impl Inertia {
    /// The 3x3 matrix, kg m², body FLU.
    pub fn matrix(&self) -> Matrix3<f64> {
        Matrix3::new(self.xx, self.xy, self.xz, self.xy, self.yy, self.yz, self.xz, self.yz, self.zz)
    }

    /// Whether the principal axes are the body's axes.
    pub fn is_diagonal(&self) -> bool {
        self.xy == 0.0 && self.yz == 0.0 && self.xz == 0.0
    }
}

/// One rotor; its thrust is along the body's z.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rotor {
    /// Hub relative to the centre of mass (r), m, body FLU.
    pub position: [f64; 3],
    /// Sign of its reaction torque about the body's z: +1 pushes to positive yaw, -1 to negative.
    pub direction: i8,
}

/// Gains of the attitude loop: moment = J (-proportional e_R - derivative e_w) + w x J w (Lee, Leok, McClamroch, CDC 2010).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AttitudeGains {
    /// On the attitude error (kp_att), 1/s².
    pub proportional: f64,
    /// On the body rate error (kd_att), 1/s.
    pub derivative: f64,
}

/// Gains of the position loop: acceleration = -proportional e_p - derivative e_v, world ENU.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PositionGains {
    /// On the position error along x, y and z, 1/s².
    pub proportional: [f64; 3],
    /// On the velocity error along x, y and z, 1/s.
    pub derivative: [f64; 3],
}

/// Why a vehicle cannot be flown.
#[derive(Debug, thiserror::Error)]
pub enum VehicleError {
    /// No vehicle of that name is built in.
    #[error("no vehicle is named `{name}`; known names: {known}")]
    UnknownName {
        /// The name that was asked for.
        name: String,
        /// The names that exist, separated by commas.
        known: String,
    },
    /// No position gains of that name.
    #[error("vehicle `{vehicle}` has no position gains named `{name}`; known names: {known}")]
    UnknownGains {
        /// The vehicle that was asked.
        vehicle: String,
        /// The name that was asked for.
        name: String,
        /// The names that exist, separated by commas.
        known: String,
    },
    /// The text is not TOML, or a field is missing, unknown or of the wrong type.
    #[error("vehicle file, line {line}: {problem}")]
    Syntax {
        /// The line, from 1.
        line: usize,
        /// What is wrong there.
        problem: String,
    },
    /// A number that no vehicle can have.
    #[error("vehicle `{vehicle}`: `{field}` is {found}; it must be {rule}")]
    Value {
        /// The vehicle in question.
        vehicle: String,
        /// The offending field.
        field: &'static str,
        /// Its value.
        found: String,
        /// What its value has to satisfy.
        rule: String,
    },
}

impl Vehicle {
    /// The names that [`Vehicle::named`] knows.
    pub fn names() -> impl Iterator<Item = &'static str> {
        EMBEDDED.iter().map(|(name, _)| *name)
    }

    /// A built-in vehicle by name.
    ///
    /// # Errors
    /// An unknown name; the message lists the known ones.
    pub fn named(name: &str) -> Result<Self, VehicleError> {
        match EMBEDDED.iter().find(|(known, _)| *known == name) {
            Some((_, text)) => Self::from_toml(text),
            None => Err(VehicleError::UnknownName { name: name.to_owned(), known: Self::names().collect::<Vec<_>>().join(", ") }),
        }
    }

    /// A vehicle from the text of a TOML file (the files in `host-sim/sim/vehicles` are the examples).
    ///
    /// # Errors
    /// Text which does not parse, a missing or unknown field, or a value outside its range.
    pub fn from_toml(text: &str) -> Result<Self, VehicleError> {
        let vehicle: Self = toml::from_str(text).map_err(|error: toml::de::Error| {
            let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
            VehicleError::Syntax { line: 1 + before.matches('\n').count(), problem: error.message().into() }
        })?;
        vehicle.check()?;
        Ok(vehicle)
    }

    /// The position gains of that name.
    ///
    /// # Errors
    /// An unknown name; the message lists the known ones.
    pub fn position_gains(&self, name: &str) -> Result<PositionGains, VehicleError> {
        self.position_gains.get(name).copied().ok_or_else(|| VehicleError::UnknownGains {
            vehicle: self.name.clone(),
            name: name.to_owned(),
            known: self.position_gains.keys().cloned().collect::<Vec<_>>().join(", "),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_embedded_vehicle_parses_under_its_own_name_and_has_both_gain_sets() {
        for name in Vehicle::names() {
            let vehicle = Vehicle::named(name).expect(name);
            assert_eq!(vehicle.name, name);
            assert_eq!(vehicle.position_gains("stock").unwrap().proportional, [6.5, 6.5, 15.0]);
            assert_eq!(vehicle.position_gains("soft").unwrap().derivative, [2.02; 3]);
        }
    }

    #[test]
    fn unknown_names_are_answered_with_the_known_ones() {
        let message = Vehicle::named("crazyfly").unwrap_err().to_string();
        assert!(message.contains("`crazyfly`") && message.contains("crazyflie, crazyflie-brushless, hummingbird"), "{message}");
        let message = Vehicle::named("crazyflie").unwrap().position_gains("hard").unwrap_err().to_string();
        assert!(message.contains("`hard`") && message.contains("soft, stock"), "{message}");
    }
}
