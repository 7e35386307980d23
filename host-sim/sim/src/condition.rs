//! What a flight meets: delays, sensor noise, disturbances, wind.
//!
//! *in* a name or TOML; *out* numbers; *never* a delay for the loop that the add-on does not have too;
//! *source* the three conditions of the project's pilot study, kept as data so that others can be added.
//!
//! The measurement delay is that of position and velocity (motion capture and radio); attitude and rates come from on board and
//! are fresh: the Crazyflie's attitude loop (27° of phase margin with its 72 ms motors) would not bear it.

use serde::{Deserialize, Serialize};

use crate::{
    sensors::SensorNoise,
    weather::{OrnsteinUhlenbeck, WeatherSettings},
};

/// Conditions of a flight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Condition {
    /// Name in tables.
    pub name: String,
    /// Age of position and velocity when the loop and the add-on receive them, s.
    pub measurement_delay_s: f64,
    /// Delay of the position loop's command on its way to the attitude loop, s: the radio link of a loop off board.
    pub command_delay_s: f64,
    /// Sensor noise: position and velocity at each reference tick, attitude and rates at each control tick.
    #[serde(default)]
    pub noise: SensorNoise,
    /// Disturbance and wind, new at each control tick.
    #[serde(default)]
    pub weather: WeatherSettings,
}

impl Condition {
    /// Names that [`Condition::named`] knows.
    pub const NAMES: [&str; 3] = ["clean", "lab", "rough"];

    /// `clean` (nothing), `lab` or `rough`.
    pub fn named(name: &str) -> Option<Self> {
        let noisy = |position, velocity, attitude, body_rates, disturbance| Self {
            name: name.into(),
            measurement_delay_s: 0.024,
            command_delay_s: 0.0,
            noise: SensorNoise { position, velocity, attitude, body_rates },
            weather: WeatherSettings {
                acceleration: OrnsteinUhlenbeck { sigma: [disturbance; 3], correlation_time: 0.4 },
                ..WeatherSettings::default()
            },
        };
        match name {
            "clean" => Some(Self { measurement_delay_s: 0.0, ..noisy(0.0, 0.0, 0.0, 0.0, 0.0) }),
            "lab" => Some(noisy(0.3e-3, 1e-2, 2e-3, 2e-2, 0.05)),
            "rough" => Some(noisy(0.7e-3, 2e-2, 4e-3, 3e-2, 0.12)),
            _ => None,
        }
    }

    /// Delay of the position loop's command in control ticks.
    pub fn command_delay_ticks(&self, control_hz: f64) -> u32 {
        (self.command_delay_s * control_hz).round() as u32
    }

    /// The same with `seconds` more delay in the whole position loop: its commands arrive later.
    #[must_use]
    pub fn delayed(&self, seconds: f64) -> Self {
        Self {
            name: if seconds > 0.0 { format!("{}+{:.0}ms", self.name, seconds * 1e3) } else { self.name.clone() },
            command_delay_s: self.command_delay_s + seconds,
            ..self.clone()
        }
    }
}
