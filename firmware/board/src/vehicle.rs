//! The vehicle that the boards fly, its rates and its link.
//!
//! *in* nothing; *out* constants; *never* more bytes on the link than its rate carries; *source* `host-sim`'s vehicle `crazyflie`.

use impromptu_flight::{
    control::{Airframe, AttitudeGains, PositionGains},
    flight::{Rates, Settings},
};

/// Control ticks a second.
pub const CONTROL_HZ: u32 = 500;
/// Clock of the core, Hz.
pub const CORE_HZ: u32 = 168_000_000;

/// Bits a second on the link of the real board, ten for a byte.
pub const LINK_BAUD: u32 = 1_000_000;

/// Bytes a second that a flight takes to the vehicle: an attitude of 39 bytes at every control tick, a position of 39 and a setpoint of 50 at
/// every reference tick. From the vehicle: motors of 51 at every control tick, some telemetry.
const LINK_BYTES: u32 = 39 * CONTROL_HZ + (39 + 50) * CONTROL_HZ / 5;
const _: () = assert!(LINK_BAUD >= 3 * 10 * LINK_BYTES, "what is said again, and an upload, need room too");

/// A Crazyflie 2.x with the gains of `host-sim`'s vehicle `crazyflie`; whoever talks to the board can send others.
pub const CRAZYFLIE: Settings = Settings {
    airframe: Airframe {
        mass: 0.03,
        inertia: [1.43e-5, 1.43e-5, 2.89e-5],
        rotors: [[0.03077, 0.03077], [0.03077, -0.03077], [-0.03077, -0.03077], [-0.03077, 0.03077]],
        directions: [1.0, -1.0, 1.0, -1.0],
        thrust_coefficient: 2.3e-8,
        torque_coefficient: 7.8e-10,
        max_rotor_speed: 2_500.0,
    },
    position: PositionGains { kp: [6.5, 6.5, 15.0], kd: [4.0, 4.0, 9.0], ki: [0.0; 3], integral_limit: 0.0 },
    attitude: AttitudeGains { kp: 544.0, kd: 46.64 },
    rates: Rates { control_hz: CONTROL_HZ as f32, position_divisor: 5 },
};
