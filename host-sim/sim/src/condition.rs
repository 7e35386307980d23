//! What a flight meets: delays, sensor noise, disturbances, wind.
//!
//! *in* a name or TOML; *out* numbers; *never* a delay for the loop that the add-on does not have too;
//! *source* the three conditions of the project's pilot study, kept as data so that others can be added.
//!
//! The measurement delay is that of position and velocity (motion capture and radio); attitude and rates come from on board and
//! are fresh: the Crazyflie's attitude loop (27° of phase margin with its 72 ms motors) would not bear it.

use impromptu_files::name::plain;
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

/// A value that no flight meets.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("`{field}` is {found}; it must be {rule}")]
pub struct ConditionError {
    field: &'static str,
    found: String,
    rule: String,
}

impl Condition {
    /// Refuses what no flight meets.
    ///
    /// # Errors
    /// Names the first field that is out of its range, its value and the range.
    pub fn check(&self) -> Result<(), ConditionError> {
        if let Err(error) = plain(&self.name) {
            let (found, rule) = (format!("{:?}", self.name), format!("a plain name ({error})"));
            return Err(ConditionError { field: "name", found, rule });
        }
        let (noise, weather) = (&self.noise, &self.weather);
        let gusts = weather.gusts.as_ref().map(|gusts| [gusts.wind_at_6_m, gusts.altitude, gusts.airspeed]);
        let ranges: [(&'static str, &[f64], f64, f64, &'static str); 13] = [
            ("measurement_delay_s", &[self.measurement_delay_s], 0.0, 0.5, "s"),
            ("command_delay_s", &[self.command_delay_s], 0.0, 0.5, "s"),
            ("noise.position", &[noise.position], 0.0, 10.0, "m"),
            ("noise.velocity", &[noise.velocity], 0.0, 10.0, "m/s"),
            ("noise.attitude", &[noise.attitude], 0.0, 1.0, "rad"),
            ("noise.body_rates", &[noise.body_rates], 0.0, 10.0, "rad/s"),
            ("weather.acceleration.sigma", &weather.acceleration.sigma, 0.0, 50.0, "m/s²"),
            ("weather.acceleration.correlation_time", &[weather.acceleration.correlation_time], 1e-3, 1e4, "s"),
            ("weather.mean_wind", &weather.mean_wind, -50.0, 50.0, "m/s"),
            ("weather.wind.sigma", &weather.wind.sigma, 0.0, 50.0, "m/s"),
            ("weather.wind.correlation_time", &[weather.wind.correlation_time], 1e-3, 1e4, "s"),
            ("weather.gusts", gusts.as_ref().map_or(&[], |gusts| &gusts[..2]), 0.0, 304.8, "m/s, m"),
            ("weather.gusts.airspeed", gusts.as_ref().map_or(&[], |gusts| &gusts[2..]), 0.01, 100.0, "m/s"),
        ];
        for (field, values, low, high, unit) in ranges {
            if let Some(value) = values.iter().find(|value| !(low..=high).contains(*value)) {
                return Err(ConditionError { field, found: value.to_string(), rule: format!("from {low} to {high} ({unit})") });
            }
        }
        Ok(())
    }

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_that_no_flight_meets_is_refused_with_its_range() {
        for name in Condition::NAMES {
            assert_eq!(Condition::named(name).unwrap().check(), Ok(()));
        }
        let refusal = |text: &str| toml::from_str::<Condition>(text).unwrap().check().unwrap_err().to_string();
        let with = |rest: &str| refusal(&format!("name = \"own\"\nmeasurement_delay_s = 0.01\ncommand_delay_s = 0.0\n{rest}"));
        assert_eq!(
            refusal("name = \"own\"\nmeasurement_delay_s = 1e12\ncommand_delay_s = 0.0"),
            "`measurement_delay_s` is 1000000000000; it must be from 0 to 0.5 (s)"
        );
        assert_eq!(with("[noise]\nposition = nan"), "`noise.position` is NaN; it must be from 0 to 10 (m)");
        assert!(with("[weather]\nmean_wind = [0.0, 0.0, 1e308]").contains("`weather.mean_wind`"));
        assert!(refusal("name = \"../x\"\nmeasurement_delay_s = 0.0\ncommand_delay_s = 0.0").contains("plain name"));
    }
}
