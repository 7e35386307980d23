//! The predecessor's loop: its vehicle, gains, rates and link.
//!
//! *in* nothing; *out* a [`Loop`] at 66.7 Hz whose commands are 100 ms late; *never* noise or wind; *source* Li et al., ICRA
//! 2017. What differs: the vertical loop commands an acceleration, not a velocity, as the nonlinear transformation does in the
//!       plane; no limit of the tilt.

use impromptu_firmware::guard::GuardSettings;
use impromptu_flight::flight::Rates;
use impromptu_sim::{
    condition::Condition,
    flights::Loop,
    plant::Vehicle,
    sensors::SensorNoise,
    trajectory::{Motion, Trajectory, TrajectoryError},
    weather::WeatherSettings,
};

/// Reference ticks (15 ms) in a tick of the add-on: 0.15 s.
pub const DIVISOR: u16 = 10;
/// Largest speed of the predecessor's test flights, m/s.
pub const SPEED: f64 = 0.6;
/// Their largest acceleration, m/s².
const ACCELERATION: f64 = 2.0;

/// The loop, flown without a guard.
///
/// # Errors
/// None unless its vehicle file is broken.
pub fn predecessor() -> anyhow::Result<Loop> {
    let condition = Condition {
        name: "link".into(),
        measurement_delay_s: 0.0,
        command_delay_s: 0.1,
        noise: SensorNoise::default(),
        weather: WeatherSettings::default(),
    };
    let mut closed_loop = Loop::new(Vehicle::from_toml(include_str!("predecessor.toml"))?, "stock", condition)?;
    closed_loop.settings.rates = Rates { control_hz: 400.0, position_divisor: 6 };
    closed_loop.guard = GuardSettings::OFF;
    Ok(closed_loop)
}

/// A motion at the predecessor's pace.
///
/// # Errors
/// If it cannot be sampled.
pub fn at_its_pace(motion: Motion, rate_hz: f64) -> Result<Trajectory, TrajectoryError> {
    let (speed, acceleration) = motion.peaks(0.01);
    let factor = (SPEED / speed).min((ACCELERATION / acceleration).sqrt());
    motion.scaled(factor).sampled(rate_hz)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tick_of_the_add_on_lasts_150_ms_and_the_link_100_ms() {
        let closed_loop = predecessor().unwrap();
        assert_eq!(closed_loop.settings.check(), Ok(()));
        assert!((f64::from(DIVISOR) / closed_loop.rate_hz() - 0.15).abs() < 1e-6);
        assert_eq!(closed_loop.condition.command_delay_ticks(closed_loop.settings.rates.control_hz.into()), 40);
    }
}
