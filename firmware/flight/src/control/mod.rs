//! The baseline loop: position and velocity references to a thrust vector, attitude loop, mixer.
//!
//! *in* a [`crate::types::Reference`] and a [`crate::types::State`]; *out* a [`crate::types::MotorCommand`]; *never* a non-finite
//! command; *source* Lee, Leok, McClamroch 2010 (geometric attitude control) as in RotorPy's `SE3Control`; Zhou 2017, section V-A
//! (nonlinear transformation and PD). What differs: no acceleration feed-forward, an optional bounded integral.

mod attitude;
mod mixer;
mod position;

pub use attitude::{AttitudeGains, AttitudeLoop};
pub use mixer::Mixer;
pub use position::{PositionGains, PositionLoop, ThrustVector};

use serde::{Deserialize, Serialize};

/// Standard gravity, m/s².
pub const GRAVITY: f32 = 9.81;

/// What the loop must know of the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Airframe {
    /// Mass, kg.
    pub mass: f32,
    /// Principal moments of inertia, kg m², body FLU.
    pub inertia: [f32; 3],
    /// Rotor positions (forward, left), m.
    pub rotors: [[f32; 2]; 4],
    /// Sign of each rotor's reaction torque about the body's z axis.
    pub directions: [f32; 4],
    /// Thrust over squared rotor speed, N s².
    pub thrust_coefficient: f32,
    /// Reaction torque over squared rotor speed, N m s².
    pub torque_coefficient: f32,
    /// Largest rotor speed, rad/s.
    pub max_rotor_speed: f32,
}
