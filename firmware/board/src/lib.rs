//! What both boards share: the settings that they start with.
#![no_std]

use impromptu_firmware::{
    control::{Airframe, AttitudeGains, PositionGains},
    flight::{Rates, Settings},
};

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
    rates: Rates { control_hz: 500.0, position_divisor: 5 },
};
