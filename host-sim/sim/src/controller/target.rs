//! What the position part of a loop is given.

use impromptu_flight::{
    flight::Flight,
    types::{Reference, Tick},
};
use libm::remainderf;
use nalgebra::Vector3;

/// The corrected reference, and of the desired trajectory what a loop may feed forward. World ENU.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Target {
    /// What shall be tracked, corrected by the add-on.
    pub reference: Reference,
    /// Desired acceleration, m/s².
    pub acceleration: Vector3<f32>,
    /// Desired jerk, m/s³.
    pub jerk: Vector3<f32>,
    /// Desired rate of the yaw, rad/s.
    pub yaw_rate: f32,
}

impl Target {
    /// That of the flight stack at a control tick which is a reference tick too. Jerk and yaw rate are central differences over
    /// two reference ticks; the Crazyflie's commander differentiates its polynomials.
    pub fn of(flight: &Flight<'_>, tick: Tick, reference_hz: f32) -> Self {
        let now = flight.reference_tick(tick);
        let [before, at, after] = [(now - 1).max(0), now, now + 1].map(|tick| flight.setpoint(tick));
        let per_second = 0.5 * reference_hz;
        Self {
            reference: *flight.reference(),
            acceleration: at.acceleration,
            jerk: (after.acceleration - before.acceleration) * per_second,
            yaw_rate: remainderf(after.yaw - before.yaw, core::f32::consts::TAU) * per_second,
        }
    }
}
