//! Vehicle, gains and condition of flights, by name or from a file.

use std::path::Path;

use anyhow::{Context as _, Result, bail};
use clap::Args;
use impromptu_files::reading;
use impromptu_sim::{condition::Condition, flights::Loop, plant::Vehicle};

use super::configuration::toml;

/// Vehicle, gains and condition.
#[derive(Debug, Args)]
pub(super) struct Situation {
    /// Vehicle: crazyflie, crazyflie-brushless, hummingbird, or a file of the same form as host-sim/sim/vehicles/*.toml.
    #[arg(long, value_name = "NAME|FILE.toml", default_value = "crazyflie")]
    pub(super) vehicle: String,
    /// Gains of the position loop, named in the vehicle's data.
    #[arg(long, value_name = "NAME", default_value = "stock")]
    pub(super) gains: String,
    /// Delays, sensor noise and weather: clean, lab, rough, or a file with a condition.
    #[arg(long, value_name = "NAME|FILE.toml", default_value = "lab")]
    pub(super) condition: String,
}

impl Situation {
    /// The files among them: inputs that no output may replace.
    pub(super) fn files(&self) -> [&Path; 2] {
        [Path::new(&self.vehicle), Path::new(&self.condition)]
    }

    /// The loop that is flown.
    pub(super) fn closed_loop(&self) -> Result<Loop> {
        closed_loop(&self.vehicle, &self.gains, &self.condition)
    }
}

/// The loop of a vehicle with gains under a condition.
pub(super) fn closed_loop(vehicle: &str, gains: &str, condition: &str) -> Result<Loop> {
    Loop::new(find_vehicle(vehicle)?, gains, find_condition(condition)?).context("--gains")
}

fn find_vehicle(name: &str) -> Result<Vehicle> {
    if !name.ends_with(".toml") {
        return Vehicle::named(name).context("--vehicle");
    }
    let text = reading::read_text(Path::new(name), reading::SETTINGS).with_context(|| format!("--vehicle {name}"))?;
    Vehicle::from_toml(&text).with_context(|| format!("--vehicle {name}"))
}

fn find_condition(name: &str) -> Result<Condition> {
    match Condition::named(name) {
        Some(condition) => Ok(condition),
        None if name.ends_with(".toml") => {
            let condition: Condition = toml(Path::new(name)).context("--condition")?;
            condition.check().with_context(|| format!("--condition {name}"))?;
            Ok(condition)
        }
        None => bail!("--condition: no condition is named `{name}`; known names: {}", Condition::NAMES.join(", ")),
    }
}

/// A factor on the speed of a trajectory.
pub(super) fn speed(text: &str) -> Result<f64, String> {
    within(text, 0.05, 20.0)
}

/// A delay in milliseconds.
pub(super) fn milliseconds(text: &str) -> Result<f64, String> {
    within(text, 0.0, 500.0)
}

/// A rate in Hz.
pub(super) fn hertz(text: &str) -> Result<f64, String> {
    within(text, 1e-6, 1e6)
}

/// From where to where a number given as an argument may be.
pub(super) fn within(text: &str, low: f64, high: f64) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if (low..=high).contains(&value) => Ok(value),
        _ => Err(format!("expected a number from {low} to {high}")),
    }
}
