//! What corrections of a quadrotor's references may be, whatever a model says.
//!
//! *in* the gains of the position loop; *out* bounds of each reference channel and of what the loop makes of them; *never* a
//! bound from a model or its data; *source* thrust and tilt of a small quadrotor: an acceleration of 1.5 g across needs 1.8
//! times the hover thrust, as much as a Crazyflie has.

use impromptu_firmware::caps::{Cap, SumCap};

use crate::{control::PositionGains, quadrotor::REFERENCE};

/// Position references: as far as a lag of 0.3 s takes a vehicle at 3.3 m/s, m; across all of it in 50 ms, m/s.
const POSITION: Cap = Cap { limit: 1.0, rate: 40.0 };
/// Velocity references, m/s and m/s².
const VELOCITY: Cap = Cap { limit: 4.0, rate: 160.0 };
/// Largest acceleration that the position loop is asked for by corrections on one axis, m/s².
pub const ACCELERATION: f32 = 15.0;

/// Of each reference channel: position, velocity.
pub const CHANNELS: [Cap; REFERENCE] = [POSITION, POSITION, POSITION, VELOCITY, VELOCITY, VELOCITY];

/// Of each axis: the acceleration that the position loop makes of both corrections, kp·Δp + kd·Δv.
pub fn sums(gains: &PositionGains) -> [SumCap; 3] {
    core::array::from_fn(|axis| {
        let gain = |gains: &[f32; 3]| gains.get(axis).copied().unwrap_or(0.0);
        SumCap { first: (axis as u8, gain(&gains.kp)), second: (axis as u8 + 3, gain(&gains.kd)), limit: ACCELERATION }
    })
}
