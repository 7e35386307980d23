//! Vehicle, gains, loop and condition of flights, by name or from a file.

use std::path::Path;

use anyhow::{Context as _, Result, bail};
use clap::Args;
use impromptu_files::reading;
use impromptu_sim::{condition::Condition, controller::Controller, flights::Loop, plant::Vehicle};

use super::configuration::toml;

/// Vehicle, gains, loop and condition.
#[derive(Debug, Args)]
pub(super) struct Situation {
    /// Vehicle: crazyflie, crazyflie-brushless, hummingbird, or a file of the same form as host-sim/sim/vehicles/*.toml.
    #[arg(long, value_name = "NAME|FILE.toml", default_value = "crazyflie")]
    pub(super) vehicle: String,
    /// Gains of the position loop, named in the vehicle's data.
    #[arg(long, value_name = "NAME", default_value = "stock")]
    pub(super) gains: String,
    /// Loop that flies: se3, or one with the gains of the Crazyflie's firmware: pid, mellinger, mellinger_feed_forward.
    #[arg(long, value_name = "NAME", default_value = "se3", value_parser = controller)]
    pub(super) controller: Controller,
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
        flown_by(closed_loop(&self.vehicle, &self.gains, &self.condition)?, self.controller)
    }

    /// What the loop's gains go by.
    pub(super) fn gains_name(&self) -> &str {
        if self.controller == Controller::Se3 { &self.gains } else { self.controller.name() }
    }

    /// Why these arguments do not go together, if they do not.
    pub(super) fn conflict(&self) -> Option<String> {
        gains_conflict(&self.gains, self.controller)
    }
}

/// Why a loop has no such gains, if it does not: all but the flight stack's bring their own.
pub(super) fn gains_conflict(gains: &str, controller: Controller) -> Option<String> {
    let name = controller.name();
    (controller != Controller::Se3 && gains != "stock").then(|| format!("--gains {gains}: --controller {name} has its own gains"))
}

/// The same vehicle, flown by a loop.
pub(super) fn flown_by(closed_loop: Loop, controller: Controller) -> Result<Loop> {
    closed_loop.flown_by(controller).context("--controller")
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

/// A loop by name.
pub(super) fn controller(text: &str) -> Result<Controller, String> {
    let known = || Controller::ALL.map(Controller::name).join(", ");
    Controller::named(text).ok_or_else(|| format!("known names: {}", known()))
}

/// A factor on the speed of a trajectory.
pub(super) fn speed(text: &str) -> Result<f64, String> {
    within(text, 0.05, 20.0)
}

/// Seconds of motion that are learned from.
pub(super) fn learning(text: &str) -> Result<u32, String> {
    text.parse().ok().filter(|seconds| *seconds <= 3600).ok_or_else(|| "expected whole seconds from 0 to 3600".into())
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
