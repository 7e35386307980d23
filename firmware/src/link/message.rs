//! What is said over the link.
//!
//! *in/out* the crate's values as plain numbers, SI units, world ENU, body FLU; *never* another bit than the sender's: attitudes are not
//! normalised, so that a flight over the link has the bits of a flight without; *source* ours.

use nalgebra::{Quaternion, UnitQuaternion};
use serde::{Deserialize, Serialize};

use super::{check::Message, outcome::Outcome};
use crate::{
    adapter::Lanes,
    flight::Settings,
    types::{self, MotorCommand, Reference, State, Tick},
};

/// Reasons for which a lane can trip, each with a count in [`LaneReport`].
pub const TRIP_REASONS: usize = 8;

/// Which way messages go.
pub trait Direction {
    /// The messages, which borrow bytes and names from the frame.
    type Message<'a>: Message + Deserialize<'a>;
}

/// To the vehicle.
#[derive(Clone, Copy, Debug)]
pub enum Commands {}

impl Direction for Commands {
    type Message<'a> = Command<'a>;
}

/// From the vehicle.
#[derive(Clone, Copy, Debug)]
pub enum Reports {}

impl Direction for Reports {
    type Message<'a> = Report<'a>;
}

/// A message to the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Command<'a> {
    /// Asks for [`Report::Identity`]; the receiver counts sequence numbers from here.
    Hello,
    /// Attitude and rates, at every control tick.
    Inertial(Inertial),
    /// Position and velocity, at every reference tick.
    Position(Position),
    /// One sample of the desired trajectory.
    Setpoint(TimedSetpoint),
    /// Settings of the flight stack.
    Settings(Settings),
    /// Which lanes of the add-on act.
    Lanes(Lanes),
    /// Motors on.
    Arm,
    /// Motors off.
    Disarm,
    /// A model file follows.
    ModelBegin {
        /// Length of the file in bytes.
        length: u32,
        /// CRC-32/ISO-HDLC of the whole file.
        checksum: u32,
    },
    /// A piece of the model file.
    #[serde(borrow)]
    ModelChunk(ModelChunk<'a>),
    /// The file is complete: check it, and fly it from now on.
    ModelCommit,
}

/// A message from the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Report<'a> {
    /// The answer to [`Command::Hello`]; the receiver counts sequence numbers from here.
    #[serde(borrow)]
    Identity(Identity<'a>),
    /// What the motors got, at every control tick.
    Motors(Motors),
    /// How the vehicle is.
    Telemetry(Telemetry),
    /// What became of a command.
    Acknowledge {
        /// Sequence number of the command's frame.
        sequence: u8,
        /// What became of it.
        outcome: Outcome,
    },
}

/// The part of the state that a vehicle measures itself.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Inertial {
    /// Control tick.
    pub tick: u32,
    /// Hamilton quaternion body to world: w, x, y, z.
    pub attitude: [f32; 4],
    /// Body rates, rad/s, body FLU.
    pub rates: [f32; 3],
}

impl Inertial {
    /// The inertial part of a state.
    pub fn new(Tick(tick): Tick, state: &State) -> Self {
        let Quaternion { coords: q } = *state.attitude.quaternion();
        Self { tick, attitude: [q.w, q.x, q.y, q.z], rates: state.rates.into() }
    }

    /// Puts this part into a state, bit by bit.
    pub fn apply(&self, state: &mut State) {
        let [w, x, y, z] = self.attitude;
        state.attitude = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
        state.rates = self.rates.into();
    }
}

/// The part of the state that comes from motion capture or an estimator.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Position {
    /// Control tick.
    pub tick: u32,
    /// Position, world ENU, m.
    pub position: [f32; 3],
    /// Velocity, world ENU, m/s.
    pub velocity: [f32; 3],
    /// Vertical acceleration in the world frame without gravity, m/s².
    pub vertical_acceleration: f32,
}

impl Position {
    /// The position part of a state.
    pub fn new(Tick(tick): Tick, state: &State) -> Self {
        let State { position, velocity, vertical_acceleration, .. } = *state;
        Self { tick, position: position.into(), velocity: velocity.into(), vertical_acceleration }
    }

    /// Puts this part into a state, bit by bit.
    pub fn apply(&self, state: &mut State) {
        state.position = self.position.into();
        state.velocity = self.velocity.into();
        state.vertical_acceleration = self.vertical_acceleration;
    }
}

/// A sample of the desired trajectory and when it is due.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimedSetpoint {
    /// Reference tick.
    pub tick: i32,
    /// Position, world ENU, m.
    pub position: [f32; 3],
    /// Velocity, world ENU, m/s.
    pub velocity: [f32; 3],
    /// Acceleration, world ENU, m/s².
    pub acceleration: [f32; 3],
    /// Yaw, rad.
    pub yaw: f32,
}

impl TimedSetpoint {
    /// A setpoint for a reference tick.
    pub fn new(tick: i32, setpoint: &types::Setpoint) -> Self {
        let types::Setpoint { position, velocity, acceleration, yaw } = *setpoint;
        Self { tick, position: position.into(), velocity: velocity.into(), acceleration: acceleration.into(), yaw }
    }

    /// The setpoint.
    pub fn setpoint(&self) -> types::Setpoint {
        let Self { position, velocity, acceleration, yaw, .. } = *self;
        types::Setpoint { position: position.into(), velocity: velocity.into(), acceleration: acceleration.into(), yaw }
    }
}

/// A piece of a model file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModelChunk<'a> {
    /// Where it belongs, bytes from the start of the file.
    pub offset: u32,
    /// At most [`super::CHUNK`] bytes.
    pub bytes: &'a [u8],
}

/// Who answers. The names are at most [`Identity::NAME`] bytes each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity<'a> {
    /// [`super::VERSION`] of the vehicle.
    pub link_version: u8,
    /// Name and version of its software.
    pub software: &'a str,
    /// The model that flies; `None`: the baseline alone.
    #[serde(borrow)]
    pub model: Option<FlyingModel<'a>>,
}

impl<'a> Identity<'a> {
    /// Most bytes of a name.
    pub const NAME: usize = 96;

    /// An identity whose names are cut to what fits.
    pub fn new(software: &'a str, model: Option<FlyingModel<'a>>) -> Self {
        let model = model.map(|model| FlyingModel { name: cut(model.name), ..model });
        Self { link_version: super::VERSION, software: cut(software), model }
    }
}

/// The start of a name, which ends between two characters.
fn cut(name: &str) -> &str {
    (0..=Identity::NAME.min(name.len())).rev().find_map(|end| name.get(..end)).unwrap_or_default()
}

/// The model that flies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FlyingModel<'a> {
    /// Its name.
    pub name: &'a str,
    /// Check sum of its file ([`crate::model::file::checksum`]).
    pub checksum: u32,
    /// The flash slot that it is in; `None`: a part of the firmware.
    pub slot: Option<u8>,
}

/// What the motors got.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motors {
    /// Control tick.
    pub tick: u32,
    /// Fractions of the largest rotor speed, 0..=1.
    pub fractions: [f32; 4],
    /// The reference that the loop tracks: position, m, then velocity, m/s, world ENU.
    pub reference: [f32; 6],
}

impl Motors {
    /// The answer to a control tick.
    pub fn new(Tick(tick): Tick, command: &MotorCommand, reference: &Reference) -> Self {
        let Reference { position: p, velocity: v, .. } = reference;
        Self { tick, fractions: command.fractions(), reference: [p.x, p.y, p.z, v.x, v.y, v.z] }
    }

    /// The motor command.
    pub fn command(&self) -> MotorCommand {
        MotorCommand::saturated(self.fractions)
    }
}

/// How a lane is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LaneReport {
    /// How much of its correction acts: 0 none, 1 all.
    pub weight: f32,
    /// Trips since the start, by reason.
    pub trips: [u16; TRIP_REASONS],
}

/// How the link is, as the vehicle sees it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameReport {
    /// Commands that were delivered.
    pub received: u32,
    /// Frames that were refused, whatever the fault.
    pub damaged: u32,
    /// Frames that came twice, or after a younger one.
    pub reordered: u32,
    /// Frames that were missing when a younger one came.
    pub dropped: u32,
}

/// How the vehicle is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Telemetry {
    /// Control tick.
    pub tick: u32,
    /// Whether motors may turn.
    pub armed: bool,
    /// The network lane.
    pub network: LaneReport,
    /// The feedback lane.
    pub feedback: LaneReport,
    /// Inferences that were not ready when they were due.
    pub late_inferences: u32,
    /// Control ticks with a correction or a motor at its limit.
    pub saturations: u32,
    /// The link.
    pub frames: FrameReport,
    /// Tracking error, m, over the last second.
    pub tracking_error: f32,
    /// Largest cost of a control tick, in instructions or cycles as the board counts.
    pub control_max: u32,
    /// Largest cost of an inference, in the same unit.
    pub inference_max: u32,
    /// High-water mark of the stack, bytes.
    pub stack_bytes: u32,
    /// Largest delay from the control tick's interrupt to its task, in the same unit.
    pub entry_latency_max: u32,
    /// Control ticks that were late.
    pub deadline_misses: u32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn states_and_setpoints_keep_every_bit(values in prop::collection::vec(any::<f32>(), 24)) {
            let vector = |from: usize| Vector3::new(values[from], values[from + 1], values[from + 2]);
            let state = State {
                position: vector(0),
                velocity: vector(3),
                attitude: UnitQuaternion::new_unchecked(Quaternion::new(values[6], values[7], values[8], values[9])),
                rates: vector(10),
                vertical_acceleration: values[13],
            };
            let mut copy = State::default();
            Inertial::new(Tick(1), &state).apply(&mut copy);
            Position::new(Tick(1), &state).apply(&mut copy);
            prop_assert_eq!(copy, state);
            let setpoint = types::Setpoint { position: vector(14), velocity: vector(17), acceleration: vector(20), yaw: values[23] };
            prop_assert_eq!(TimedSetpoint::new(-3, &setpoint).setpoint(), setpoint);
        }

        #[test]
        fn names_are_cut_between_characters(name in "\\PC{0,120}") {
            let identity = Identity::new(&name, None);
            prop_assert!(name.starts_with(identity.software));
            prop_assert!(identity.software == name || identity.software.len() + 4 > Identity::NAME);
        }
    }
}
