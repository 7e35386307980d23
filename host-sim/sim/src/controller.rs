//! Baseline loops that a vehicle may have in the place of the flight stack's own, by name.
//!
//! *in* a name and a vehicle; *out* whether the one can fly the other, and the loops; *never* a loop on a vehicle that its gains
//! are not for; *source* the documentation of the Crazyflie and its firmware's gains, limits and rates (master of August 2026);
//! each module says what differs.

mod mellinger;
mod motors;
mod pid;
mod target;

use crate::plant::{GRAVITY, PositionGains, Vehicle};
pub use mellinger::{Mellinger, ThrustWish};
pub use motors::{Demand, FULL, Motors};
pub use pid::{Attitude, Pid};
pub use target::Target;

/// Which loop flies a vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Controller {
    /// The flight stack's own: PD to a thrust vector, geometric attitude loop; its gains are the vehicle file's.
    #[default]
    Se3,
    /// The Crazyflie's cascade of PIDs, which it has when it leaves the box.
    Pid,
    /// The Crazyflie's controller after Mellinger and Kumar.
    Mellinger {
        /// Acceleration and body rates of the desired trajectory are fed forward, as the Crazyflie's commander does.
        feed_forward: bool,
    },
}

/// Why a loop does not fly a vehicle.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "`{controller}` has a Crazyflie 2.x's gains, vehicle `{vehicle}` is none: its {what} is {found}{unit}, not {low} to {high}"
)]
pub struct ControllerError {
    controller: &'static str,
    vehicle: String,
    what: &'static str,
    found: f64,
    unit: &'static str,
    low: f64,
    high: f64,
}

impl Controller {
    /// Each of them.
    pub const ALL: [Self; 4] =
        [Self::Se3, Self::Pid, Self::Mellinger { feed_forward: false }, Self::Mellinger { feed_forward: true }];

    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Se3 => "se3",
            Self::Pid => "pid",
            Self::Mellinger { feed_forward: false } => "mellinger",
            Self::Mellinger { feed_forward: true } => "mellinger_feed_forward",
        }
    }

    /// The loop of that name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|controller| controller.name() == name)
    }

    /// Refuses a vehicle on which a unit of the motors' power does something else than on a Crazyflie 2.x.
    ///
    /// # Errors
    /// The first property that is too far from a Crazyflie's.
    pub fn check(self, vehicle: &Vehicle) -> Result<(), ControllerError> {
        if self == Self::Se3 {
            return Ok(());
        }
        let largest = motors::largest_thrust(vehicle);
        let turn = |arm: fn(&[f64; 3]) -> f64, moment: f64| {
            vehicle.rotors.iter().map(|rotor| arm(&rotor.position).abs() * largest).sum::<f64>() / moment
        };
        let ranges = [
            ("mass", vehicle.mass, " kg", 0.02, 0.042),
            ("share of all thrust in hover", vehicle.mass * GRAVITY / (4.0 * largest), "", 0.35, 0.8),
            ("roll by all thrust", turn(|[_, y, _]| *y, vehicle.inertia.xx), " rad/s²", 600.0, 2400.0),
            ("pitch by all thrust", turn(|[x, _, _]| *x, vehicle.inertia.yy), " rad/s²", 600.0, 2400.0),
        ];
        match ranges.into_iter().find(|(_, found, _, low, high)| !(low..=high).contains(&found)) {
            Some((what, found, unit, low, high)) => {
                // Rounded for the reader.
                let found = (found * 1e4).round() / 1e4;
                Err(ControllerError { controller: self.name(), vehicle: vehicle.name.clone(), what, found, unit, low, high })
            }
            None => Ok(()),
        }
    }

    /// What its position part does to small errors, as gains of the acceleration; `None` for the flight stack's own.
    pub fn position_gains(self, vehicle: &Vehicle) -> Option<PositionGains> {
        match self {
            Self::Se3 => None,
            Self::Pid => Some(pid::position_gains(vehicle)),
            Self::Mellinger { .. } => Some(mellinger::position_gains(vehicle)),
        }
    }
}
