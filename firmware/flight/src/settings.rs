//! What a flight stack is told of its vehicle and its loops.
//!
//! *in* numbers of the vehicle's file; *out* settings of the loops; *never* a check: what cannot be flown is refused where it is
//! used; *source* the rates of the Crazyflie's firmware.

use serde::{Deserialize, Serialize};

use crate::control::{Airframe, AttitudeGains, PositionGains};

/// Rates of the loops.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rates {
    /// Control ticks (attitude loop) a second.
    pub control_hz: f32,
    /// Control ticks in a tick of the position loop, which is the reference's tick.
    pub position_divisor: u32,
}

impl Default for Rates {
    /// 500 Hz and 100 Hz, as the Crazyflie's firmware runs its attitude and position loops.
    fn default() -> Self {
        Self { control_hz: 500.0, position_divisor: 5 }
    }
}

impl Rates {
    /// Of no loop: the reference's rate is 0.
    pub(crate) const NONE: Self = Self { control_hz: 0.0, position_divisor: 1 };

    /// Rate of the position loop and so of the reference, Hz.
    pub fn reference_hz(&self) -> f32 {
        self.control_hz / self.position_divisor.max(1) as f32
    }
}

/// Settings of the flight stack.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Vehicle constants.
    pub airframe: Airframe,
    /// Position loop.
    pub position: PositionGains,
    /// Attitude loop.
    pub attitude: AttitudeGains,
    /// Rates.
    pub rates: Rates,
}
