//! Vehicles and samples in the firmware's types.

use impromptu_flight::{
    control::{Airframe, AttitudeGains, PositionGains},
    flight::{Rates, Settings},
    types::Setpoint,
};
use nalgebra::Vector3;

use crate::{
    plant::{PositionGains as VehicleGains, Vehicle, VehicleError},
    trajectory::Sample,
};

/// The firmware's settings for a vehicle with the position gains of that name.
pub fn settings(vehicle: &Vehicle, gains: &str) -> Result<Settings, VehicleError> {
    let position = vehicle.position_gains(gains)?;
    let single = |values: [f64; 3]| values.map(|value| value as f32);
    Ok(Settings {
        airframe: Airframe {
            mass: vehicle.mass as f32,
            inertia: single([vehicle.inertia.xx, vehicle.inertia.yy, vehicle.inertia.zz]),
            rotors: std::array::from_fn(|i| [vehicle.rotors[i].position[0] as f32, vehicle.rotors[i].position[1] as f32]),
            directions: std::array::from_fn(|i| f32::from(vehicle.rotors[i].direction)),
            thrust_coefficient: vehicle.thrust_coefficient as f32,
            torque_coefficient: vehicle.torque_coefficient as f32,
            max_rotor_speed: vehicle.rotor_speed_max as f32,
        },
        position: position_gains(&position),
        attitude: AttitudeGains { kp: vehicle.attitude_gains.proportional as f32, kd: vehicle.attitude_gains.derivative as f32 },
        rates: Rates::default(),
    })
}

/// Gains as the firmware's, without an integral.
pub fn position_gains(gains: &VehicleGains) -> PositionGains {
    let single = |values: [f64; 3]| values.map(|value| value as f32);
    PositionGains { kp: single(gains.proportional), kd: single(gains.derivative), ki: [0.0; 3], integral_limit: 0.0 }
}

/// A sample as the firmware's setpoint.
pub fn setpoint(sample: &Sample) -> Setpoint {
    let vector = |values: [f64; 3]| Vector3::from(values.map(|value| value as f32));
    Setpoint {
        position: vector(sample.position),
        velocity: vector(sample.velocity),
        acceleration: vector(sample.acceleration),
        yaw: sample.yaw as f32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_vehicle_of_the_catalogue_has_settings_that_a_vehicle_can_have() {
        for name in Vehicle::names() {
            let vehicle = Vehicle::named(name).unwrap();
            for gains in ["stock", "soft"] {
                assert_eq!(settings(&vehicle, gains).unwrap().check(), Ok(()), "{name}, {gains}");
            }
        }
    }
}
