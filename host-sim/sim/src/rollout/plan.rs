//! What is flown, and what comes of it.

use impromptu_firmware::{
    adapter::Lanes,
    guard::{GuardSettings, Trips},
    model::Model,
};
use impromptu_flight::replay::Recorded;

use crate::{
    controller::ControllerError,
    flight_log::FlightLog,
    plant::{Variation, VehicleError},
    trajectory::Trajectory,
};

/// An independent dither of the position reference: random signs, held for `hold_s`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dither {
    /// Amplitude on each axis, m.
    pub amplitude: f64,
    /// Time between new signs, s.
    pub hold_s: f64,
}

/// One flight to be flown.
#[derive(Clone, Debug)]
pub struct FlightPlan<'a> {
    /// What is desired.
    pub trajectory: &'a Trajectory,
    /// The add-on, if any, and its lanes.
    pub model: Option<(&'a Model<'a>, Lanes)>,
    /// How the vehicle differs from its data.
    pub variation: Variation,
    /// Seed of noise, disturbance and dither.
    pub seed: u64,
    /// Dither on the position reference.
    pub dither: Option<Dither>,
    /// Gain on the feedback lane's output, unknown to it.
    pub loop_gain: f32,
    /// Guard of the add-on.
    pub guard: GuardSettings,
    /// Whether every reference tick is logged.
    pub log: bool,
    /// Whether the flight stack's inputs and answers are recorded, so that another machine can fly it again (loop gain 1, no
    /// command delay, the default guard).
    pub record: bool,
}

impl<'a> FlightPlan<'a> {
    /// A flight of the nominal vehicle without add-on, dither or log.
    pub fn new(trajectory: &'a Trajectory, seed: u64) -> Self {
        Self {
            trajectory,
            model: None,
            variation: Variation::default(),
            seed,
            dither: None,
            loop_gain: 1.0,
            guard: GuardSettings::default(),
            log: false,
            record: false,
        }
    }

    /// The same flight with an add-on.
    #[must_use]
    pub fn with(self, model: &'a Model<'a>, lanes: Lanes) -> Self {
        Self { model: Some((model, lanes)), ..self }
    }
}

/// What came of a flight.
#[derive(Clone, Debug, Default)]
pub struct FlightRecord {
    /// sqrt(mean |p_d - p|²) over the scored part, m, with the true position.
    pub rms: f64,
    /// Root mean square of the correction's position part on each axis over the scored part, m.
    pub correction_rms: [f64; 3],
    /// Trips of the guard.
    pub trips: Trips,
    /// Every reference tick, if asked for.
    pub log: Option<FlightLog>,
    /// Everything that went into the flight stack and came out, if asked for.
    pub recorded: Option<Recorded<Vec<u8>>>,
}

/// Why flights could not be flown.
#[derive(Debug, thiserror::Error)]
pub enum RolloutError {
    /// No vehicle has these settings: the vehicle's name, and why.
    #[error("vehicle {0}")]
    Airframe(String),
    /// The firmware refuses the model.
    #[error("model: {0}")]
    Model(#[from] impromptu_firmware::model::Refusal),
    /// A setting of the condition is impossible.
    #[error("condition `{name}`: {reason}")]
    Condition {
        /// The condition.
        name: String,
        /// What is wrong.
        reason: String,
    },
    /// The trajectory is not sampled at the loop's rate.
    #[error("trajectory `{name}` is sampled at {found} Hz, the position loop runs at {expected} Hz")]
    Rate {
        /// The trajectory.
        name: String,
        /// Its rate, Hz.
        found: f64,
        /// The loop's rate, Hz.
        expected: f64,
    },
    /// The loop is not for this vehicle.
    #[error("controller {0}")]
    Controller(#[from] ControllerError),
    /// Unknown gains.
    #[error(transparent)]
    Vehicle(#[from] VehicleError),
    /// The hover in which the responses are measured was too short, or could not be sampled.
    #[error("responses are not measured: {0}")]
    Commission(String),
}
