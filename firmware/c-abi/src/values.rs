//! Plain numbers as C sees them.
//!
//! *in/out* structures of f32, u32 and i32 in a layout that C knows; *never* padding between numbers, a pointer into the library,
//! or a value that Rust could not hold; *source* [`impromptu_flight::types`], [`impromptu_flight::flight::Settings`].

mod learner;

use core::ffi::c_char;

use impromptu_firmware::{
    adapter, add_on,
    guard::{Trip, Trips},
    learning::Kept,
    model::{self, Model},
};
use impromptu_flight::{
    control::{self, PositionGains},
    flight, types,
};

pub use learner::{LearnerProblem, LearnerReport, LearnerSettings};

/// Most channels of a signal. A model with more of them, or with more corrected channels, is refused.
pub const MAX_CHANNELS: usize = 16;
/// Most network inputs.
pub const MAX_FEATURES: usize = 128;
/// Most corrected channels.
pub const MAX_OUTPUTS: usize = 8;
/// Reasons for which the guard trips a lane.
pub const TRIPS: usize = 8;
/// Most bytes of what a learner keeps.
pub const KEPT: usize = 848;
/// Samples of the desired trajectory that an adapter or a flight stack keeps, past ones included.
pub const PREVIEW: usize = 192;

const _: () = assert!(
    MAX_CHANNELS == model::DEFAULT_CHANNELS
        && MAX_FEATURES == model::MAX_FEATURES
        && MAX_OUTPUTS == model::DEFAULT_OUTPUTS
        && PREVIEW == flight::PREVIEW
        && TRIPS == Trip::ALL.len()
        && KEPT == Kept::length(1)
);

/// One channel of a signal. The texts must live until the adapter is created.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Channel {
    /// Name, for example "position.x"; of a reference channel, that of the desired channel from which it starts.
    pub name: *const c_char,
    /// SI unit, for example "m/s".
    pub unit: *const c_char,
    /// Frame, for example "world ENU".
    pub frame: *const c_char,
    /// Beyond the trajectory's ends: 0 the nearest sample is held (positions), 1 the channel is zero (velocities).
    pub zero_beyond: u32,
}

/// What the correction of a reference channel may be, whatever a model says.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Cap {
    /// Largest absolute correction, in the channel's unit; 0: the channel is not corrected.
    pub limit: f32,
    /// Largest rate of change of the correction, in the channel's unit a second.
    pub rate: f32,
}

/// The application's signals, compared with the model's.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Signals {
    /// Channels of the desired trajectory.
    pub desired: *const Channel,
    /// Number of desired channels.
    pub desired_count: u32,
    /// Channels of the measured state.
    pub measured: *const Channel,
    /// Number of measured channels.
    pub measured_count: u32,
    /// Channels of the reference.
    pub reference: *const Channel,
    /// Number of reference channels.
    pub reference_count: u32,
}

/// What a model says of itself.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Description {
    /// CRC-32 that identifies the file.
    pub checksum: u32,
    /// Desired, measured and reference channels.
    pub channels: [u32; 3],
    /// Rate of the references, Hz.
    pub reference_rate_hz: f32,
    /// Reference ticks in a tick of the network lane.
    pub divisor: u32,
    /// Reference ticks of the past that must stay in the preview.
    pub past: u32,
    /// Reference ticks of the future that should be pushed ahead.
    pub future: u32,
    /// Corrected channels.
    pub outputs: u32,
    /// 1 if there is a network lane.
    pub network: u32,
    /// 1 if there is a feedback lane.
    pub feedback: u32,
}

impl Description {
    /// Of a model.
    pub fn new(model: &Model<'_>) -> Self {
        let card = model.card();
        let (past, future) = card.preview_span();
        let signals = &card.signals;
        Self {
            checksum: model.checksum(),
            channels: [&signals.desired, &signals.measured, &signals.reference].map(|channels| channels.len() as u32),
            reference_rate_hz: card.timing.reference_rate_hz,
            divisor: u32::from(card.timing.divisor),
            past,
            future,
            outputs: card.outputs.len() as u32,
            network: u32::from(model.network().is_some()),
            feedback: u32::from(model.feedback().is_some()),
        }
    }
}

/// One evaluation of the network that is to be done.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Job {
    /// Reference tick at which it was released.
    pub tick: i32,
    /// The model's features, in physical units; zeros behind the last.
    pub inputs: [f32; MAX_FEATURES],
}

impl From<Job> for adapter::Job {
    fn from(Job { tick, inputs }: Job) -> Self {
        Self { tick, inputs }
    }
}

/// One evaluation of the network that was done.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Inference {
    /// Reference tick of its job.
    pub tick: i32,
    /// Correction of each output of the model.
    pub outputs: [f32; MAX_OUTPUTS],
}

impl From<adapter::Inference> for Inference {
    fn from(adapter::Inference { tick, outputs }: adapter::Inference) -> Self {
        Self { tick, outputs }
    }
}

impl From<Inference> for adapter::Inference {
    fn from(Inference { tick, outputs }: Inference) -> Self {
        Self { tick, outputs }
    }
}

/// What an adapter has done.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Report {
    /// Correction of each output of the model in the last tick, in the channel's unit.
    pub correction: [f32; MAX_OUTPUTS],
    /// How far the network lane is faded in, 0..1.
    pub network_weight: f32,
    /// How far the feedback lane is faded in, 0..1.
    pub feedback_weight: f32,
    /// Ticks in which a limit or the slew bounded the correction.
    pub saturations: u32,
    /// Inferences that did not come in time.
    pub late: u32,
    /// Reference tick of the next sample that is pushed.
    pub next_tick: i32,
    /// Ticks with a lane on in which the trajectory did not reach as far ahead as impromptu_description.future: what was missing
    /// was taken as its end.
    pub starved: u32,
    /// Samples of the trajectory ahead of the last reference tick; negative if it has ended.
    pub reach: i32,
    /// Trips of the network lane by reason: envelope, not finite, stale, saturated, counterfactual, late, oscillation, astray.
    pub network_trips: [u16; TRIPS],
    /// Trips of the feedback lane by reason.
    pub feedback_trips: [u16; TRIPS],
}

impl From<add_on::Report> for Report {
    fn from(report: add_on::Report) -> Self {
        let add_on::Report {
            correction,
            network_weight,
            feedback_weight,
            saturations,
            late,
            next_tick,
            starved,
            reach,
            trips,
            ..
        } = report;
        let Trips { network: network_trips, feedback: feedback_trips } = trips;
        Self {
            correction,
            network_weight,
            feedback_weight,
            saturations,
            late,
            next_tick,
            starved,
            reach,
            network_trips,
            feedback_trips,
        }
    }
}

/// Settings of the flight stack.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct FlightSettings {
    /// Mass, kg.
    pub mass: f32,
    /// Principal moments of inertia, kg m^2, body FLU.
    pub inertia: [f32; 3],
    /// Positions of rotors 1..4 (forward, left), m.
    pub rotors: [[f32; 2]; 4],
    /// Sign of each rotor's reaction torque about the body's z axis.
    pub directions: [f32; 4],
    /// Thrust over squared rotor speed, N s^2.
    pub thrust_coefficient: f32,
    /// Reaction torque over squared rotor speed, N m s^2.
    pub torque_coefficient: f32,
    /// Largest rotor speed, rad/s.
    pub max_rotor_speed: f32,
    /// Position error to acceleration, world ENU, 1/s^2.
    pub position_kp: [f32; 3],
    /// Velocity error to acceleration, 1/s.
    pub position_kd: [f32; 3],
    /// Integrated position error to acceleration, 1/s^3.
    pub position_ki: [f32; 3],
    /// Largest acceleration that the integral may ask for, m/s^2.
    pub integral_limit: f32,
    /// Attitude error to angular acceleration, 1/s^2.
    pub attitude_kp: f32,
    /// Body rate to angular acceleration, 1/s.
    pub attitude_kd: f32,
    /// Control ticks (attitude loop) a second.
    pub control_hz: f32,
    /// Control ticks in a tick of the position loop, which is the reference's tick.
    pub position_divisor: u32,
}

impl FlightSettings {
    /// As the flight stack takes them; `None` if a number is not finite or a rate is not positive.
    pub fn checked(&self) -> Option<flight::Settings> {
        let numbers = [
            self.mass,
            self.thrust_coefficient,
            self.torque_coefficient,
            self.max_rotor_speed,
            self.integral_limit,
            self.attitude_kp,
            self.attitude_kd,
            self.control_hz,
        ];
        let all = numbers.iter().chain(&self.inertia).chain(self.rotors.as_flattened()).chain(&self.directions);
        let mut all = all.chain(&self.position_kp).chain(&self.position_kd).chain(&self.position_ki);
        (all.all(|number| number.is_finite()) && self.control_hz > 0.0 && self.position_divisor > 0).then_some(flight::Settings {
            airframe: control::Airframe {
                mass: self.mass,
                inertia: self.inertia,
                rotors: self.rotors,
                directions: self.directions,
                thrust_coefficient: self.thrust_coefficient,
                torque_coefficient: self.torque_coefficient,
                max_rotor_speed: self.max_rotor_speed,
            },
            position: PositionGains {
                kp: self.position_kp,
                kd: self.position_kd,
                ki: self.position_ki,
                integral_limit: self.integral_limit,
            },
            attitude: control::AttitudeGains { kp: self.attitude_kp, kd: self.attitude_kd },
            rates: flight::Rates { control_hz: self.control_hz, position_divisor: self.position_divisor },
        })
    }
}

/// One sample of the desired trajectory.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Setpoint {
    /// Position, world ENU, m.
    pub position: [f32; 3],
    /// Velocity, world ENU, m/s.
    pub velocity: [f32; 3],
    /// Acceleration, world ENU, m/s^2.
    pub acceleration: [f32; 3],
    /// Yaw, rad.
    pub yaw: f32,
}

impl Setpoint {
    /// As the flight stack takes it; `None` if a number is not finite.
    pub fn checked(&self) -> Option<types::Setpoint> {
        let mut all = self.position.iter().chain(&self.velocity).chain(&self.acceleration).chain([&self.yaw]);
        all.all(|number| number.is_finite()).then(|| types::Setpoint {
            position: self.position.into(),
            velocity: self.velocity.into(),
            acceleration: self.acceleration.into(),
            yaw: self.yaw,
        })
    }
}

/// What the flight stack is told about the vehicle.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct State {
    /// Position, world ENU, m.
    pub position: [f32; 3],
    /// Velocity, world ENU, m/s.
    pub velocity: [f32; 3],
    /// Attitude: Hamilton quaternion w, x, y, z, body to world. Need not be normalised.
    pub attitude: [f32; 4],
    /// Body rates, rad/s, body FLU.
    pub rates: [f32; 3],
    /// Vertical acceleration in the world frame without gravity, m/s^2; a network input only, 0 if unknown.
    pub vertical_acceleration: f32,
}

impl State {
    /// As the flight stack takes it; `None` if a number is not finite or the quaternion is near zero.
    pub fn checked(&self) -> Option<types::State> {
        let state = types::State::from_raw(self.position, self.velocity, self.attitude, self.rates)?;
        let vertical_acceleration = self.vertical_acceleration;
        vertical_acceleration.is_finite().then_some(types::State { vertical_acceleration, ..state })
    }
}

/// What the position loop tracks: the desired state, corrected.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Reference {
    /// Position, world ENU, m.
    pub position: [f32; 3],
    /// Velocity, world ENU, m/s.
    pub velocity: [f32; 3],
    /// Yaw, rad.
    pub yaw: f32,
}

impl From<&types::Reference> for Reference {
    fn from(reference: &types::Reference) -> Self {
        Self { position: reference.position.into(), velocity: reference.velocity.into(), yaw: reference.yaw }
    }
}

/// What a control tick gives.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Command {
    /// Rotor speeds 1..4 as fractions of the largest speed: always finite, always in 0..1.
    pub motors: [f32; 4],
    /// The reference that the position loop tracks.
    pub reference: Reference,
}
