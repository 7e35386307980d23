//! A vehicle and an air that differ from what a model was made for, at test time only.
//!
//! *in* a loop and a [`Mismatch`]; *out* the loop that is flown; *never* a flight stack that knows of it: mass, thrust and gains in its
//! settings stay those of the vehicle's data; *source* facts of the pilot study, "at test time only".

use impromptu_sim::{flights::Loop, weather::Dryden};
use serde::{Deserialize, Serialize};

/// How a flown loop differs from the loop of the training flights; nothing by default.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Mismatch {
    /// Factor on the mass.
    pub mass: f64,
    /// Factor on the thrust of a rotor at a given speed.
    pub thrust: f64,
    /// Factor on the drag of the rotors, in their plane and along their axis, and of the frame.
    pub drag: f64,
    /// Factor on the moments of inertia.
    pub inertia: f64,
    /// Factor on the motors' time constant.
    pub motor_lag: f64,
    /// Factor on the age of the measurements; the flight stack still believes the old age.
    pub measurement_delay: f64,
    /// Further delay of the position loop's commands, s.
    pub delay_s: f64,
    /// Factor on the random acceleration of the condition.
    pub disturbance: f64,
    /// Mean wind, m/s, with Dryden gusts of that strength on top; 0: none.
    pub wind: f64,
    /// Where the wind blows to, rad from the world's x.
    pub wind_direction: f64,
}

impl Default for Mismatch {
    fn default() -> Self {
        Self::NONE
    }
}

/// Height at which the gusts are those of flights near the ground, m: below it the standard ends (10 feet).
const GUST_ALTITUDE: f64 = 3.048;

impl Mismatch {
    /// The loop of the training flights.
    pub const NONE: Self = Self {
        mass: 1.0,
        thrust: 1.0,
        drag: 1.0,
        inertia: 1.0,
        motor_lag: 1.0,
        measurement_delay: 1.0,
        delay_s: 0.0,
        disturbance: 1.0,
        wind: 0.0,
        wind_direction: 0.0,
    };

    /// The loop that is flown.
    #[must_use]
    pub fn applied(&self, closed_loop: &Loop) -> Loop {
        let mut flown = closed_loop.delayed(self.delay_s);
        let vehicle = &mut flown.vehicle;
        vehicle.mass *= self.mass;
        vehicle.thrust_coefficient *= self.thrust;
        vehicle.rotor_drag *= self.drag;
        vehicle.inflow_drag *= self.drag;
        vehicle.parasitic_drag = vehicle.parasitic_drag.map(|drag| self.drag * drag);
        vehicle.motor_time_constant *= self.motor_lag;
        let inertia = &mut vehicle.inertia;
        for moment in [&mut inertia.xx, &mut inertia.yy, &mut inertia.zz, &mut inertia.xy, &mut inertia.yz, &mut inertia.xz] {
            *moment *= self.inertia;
        }
        flown.condition.measurement_delay_s *= self.measurement_delay;
        let weather = &mut flown.condition.weather;
        weather.acceleration.sigma = weather.acceleration.sigma.map(|sigma| self.disturbance * sigma);
        if self.wind > 0.0 {
            let (sine, cosine) = (libm::sin(self.wind_direction), libm::cos(self.wind_direction));
            weather.mean_wind[0] += self.wind * cosine;
            weather.mean_wind[1] += self.wind * sine;
            weather.gusts = Some(Dryden { wind_at_6_m: self.wind, altitude: GUST_ALTITUDE, airspeed: self.wind });
        }
        flown
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use impromptu_sim::{condition::Condition, plant::Vehicle};

    #[test]
    fn the_flight_stack_does_not_know_of_a_mismatch_and_none_changes_nothing() {
        let closed_loop = Loop::new(Vehicle::named("crazyflie").unwrap(), "stock", Condition::named("lab").unwrap()).unwrap();
        let same = Mismatch::default().applied(&closed_loop);
        assert_eq!((&same.vehicle, &same.condition), (&closed_loop.vehicle, &closed_loop.condition));
        let heavy = Mismatch { mass: 1.1, thrust: 0.9, inertia: 1.2, wind: 2.0, ..Mismatch::default() }.applied(&closed_loop);
        assert_eq!(heavy.settings, closed_loop.settings);
        assert_eq!(heavy.vehicle.mass, 1.1 * closed_loop.vehicle.mass);
        assert_eq!(heavy.condition.weather.mean_wind, [2.0, 0.0, 0.0]);
    }
}
