//! The named cases of the target table, and what each must keep.
//!
//! *in* nothing; *out* mismatches with bounds; *never* a bound that was lowered to what was found; *source* the
//! project's pilot study: each bound is about a point below what it found in the same case.

use super::mismatch::Mismatch;

/// A case that is asked for.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Name in the JSON document.
    pub name: &'static str,
    /// What it is.
    pub what: &'static str,
    /// How the loop differs.
    pub mismatch: Mismatch,
    /// Least mean reduction with both lanes, Crazyflie 'stock' in `lab`, per cent.
    pub asked: f64,
}

/// The cases, in the order of the table.
pub const CASES: [Case; 5] = [
    Case { name: "thrust_minus_4", what: "thrust -4 %", mismatch: Mismatch { thrust: 0.96, ..Mismatch::NONE }, asked: 95.0 },
    Case {
        name: "payload_plus_10",
        what: "payload +10 % (as thrust -9 %)",
        mismatch: Mismatch { mass: 1.1, ..Mismatch::NONE },
        asked: 94.0,
    },
    Case { name: "drag_times_4", what: "rotor drag x4", mismatch: Mismatch { drag: 4.0, ..Mismatch::NONE }, asked: 86.0 },
    Case {
        name: "disturbance_times_3",
        what: "disturbance x3",
        mismatch: Mismatch { disturbance: 3.0, ..Mismatch::NONE },
        asked: 91.0,
    },
    Case {
        name: "delay_plus_10_ms",
        what: "delay of the whole loop +10 ms",
        mismatch: Mismatch { delay_s: 0.01, ..Mismatch::NONE },
        asked: 95.0,
    },
];

/// One quantity that is off by a share, either way.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Name in the JSON document.
    pub name: &'static str,
    /// What it is.
    pub what: &'static str,
    /// The mismatch at a factor on the quantity.
    pub at: fn(f64) -> Mismatch,
}

/// The quantities that are swept.
pub const PARAMETERS: [Parameter; 4] = [
    Parameter { name: "mass", what: "mass", at: |mass| Mismatch { mass, ..Mismatch::NONE } },
    Parameter { name: "thrust", what: "thrust", at: |thrust| Mismatch { thrust, ..Mismatch::NONE } },
    Parameter { name: "drag", what: "rotor drag", at: |drag| Mismatch { drag, ..Mismatch::NONE } },
    Parameter {
        name: "delay",
        what: "measurement delay",
        at: |measurement_delay| Mismatch { measurement_delay, ..Mismatch::NONE },
    },
];

/// Deviations of the sweep, per cent.
pub const DEVIATIONS: [f64; 9] = [-30.0, -20.0, -10.0, -5.0, 0.0, 5.0, 10.0, 20.0, 30.0];

/// Mean winds of the sweep, m/s, across the strokes' plane as well as along it.
pub const WINDS: [f64; 4] = [0.5, 1.0, 2.0, 3.0];

/// A wind at 45° to both horizontal axes.
pub fn wind(speed: f64) -> Mismatch {
    Mismatch { wind: speed, wind_direction: std::f64::consts::FRAC_PI_4, ..Mismatch::NONE }
}
