//! The vehicle on its link: what it is told, what it does, and what it does when it is told nothing.
//!
//! *in* the link's commands and control ticks; *out* a motor command at every tick; *never* motors that turn while disarmed, or
//! for longer than [`Timeouts::motors_inertial_s`] without a new attitude or position.
//!
//! | what arrives | what happens |
//! |---|---|
//! | nothing for a while | the newest state is held |
//! | nothing for [`Timeouts::lanes_inertial_s`] | the add-on fades out |
//! | nothing for [`Timeouts::motors_inertial_s`] | motors off, disarmed |
//! | a state that is older than the newest | ignored |
//! | a setpoint after a gap | filled in a straight line; if it is longer than the preview, the trajectory begins anew |
//! | a setpoint that is stored already | ignored |
//! | no setpoint any more | the end of the trajectory is held |

mod state_age;

use impromptu_firmware::{
    adapter::{Inference, Job, Lanes},
    guard::Trip,
    math::sqrt,
    model::{Model, Refusal},
};
use nalgebra::{Quaternion, UnitQuaternion, Vector4};

use crate::{
    flight::{Flight, PREVIEW},
    link::{
        Command, Order, Outcome, Reason, Received,
        message::{FrameReport, Identity, LaneReport, Motors, Telemetry, TimedSetpoint},
    },
    settings::{Rates, Settings},
    types::{MotorCommand, Reference, Setpoint, State, Tick},
};

use state_age::StateAge;
pub use state_age::Timeouts;

/// What a board measures of itself; the unit of costs is the board's (instructions or cycles).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Meters {
    /// Largest cost of a control tick.
    pub control_max: u32,
    /// Largest cost of an inference.
    pub inference_max: u32,
    /// High-water mark of the stack, bytes.
    pub stack_bytes: u32,
    /// Largest delay from the tick's interrupt to the control task.
    pub entry_latency_max: u32,
    /// Control ticks that were not done when the next one was due.
    pub deadline_misses: u32,
}

/// What is done with a command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reaction {
    /// Nothing is said.
    Silence,
    /// The vehicle says who it is.
    Introduce,
    /// The sender is told what became of the command.
    Acknowledge(Outcome),
}

/// The flight stack with arming, and with timeouts for a link that fails.
#[derive(Debug)]
pub struct Autopilot<'m> {
    flight: Flight<'m>,
    rates: Option<Rates>,
    model: Option<&'m Model<'m>>,
    slot: Option<u8>,
    lanes: Lanes,
    state: State,
    age: StateAge,
    /// Control ticks since the motors were armed.
    tick: Tick,
    armed: bool,
    /// The newest setpoint, from which a gap is filled.
    setpoint: Setpoint,
    /// Mean square of the tracking error over about the last second, m².
    error_square: f32,
}

impl Default for Autopilot<'_> {
    fn default() -> Self {
        Self::new()
    }
}

impl<'m> Autopilot<'m> {
    /// A vehicle that knows nothing of itself: it cannot be armed. 13 KB, so a microcontroller has it in a static.
    pub const fn new() -> Self {
        Self {
            flight: Flight::empty(),
            rates: None,
            model: None,
            slot: None,
            lanes: Lanes::NONE,
            state: State {
                attitude: UnitQuaternion::new_unchecked(Quaternion::from_vector(Vector4::new(0.0, 0.0, 0.0, 0.0))),
                ..State::ORIGIN
            },
            age: StateAge::NONE,
            tick: Tick(0),
            armed: false,
            setpoint: Setpoint::ORIGIN,
            error_square: 0.0,
        }
    }

    /// Gives the vehicle the model that it shall fly with; without settings it waits for them.
    ///
    /// # Errors
    /// If it does not fit the flight stack; then there is none.
    pub fn load(&mut self, model: &'m Model<'m>, slot: Option<u8>) -> Result<(), Refusal> {
        (self.model, self.slot) = (None, slot);
        self.flight.detach();
        if self.rates.is_some() {
            self.flight.attach(model, Lanes::NONE)?;
        }
        self.model = Some(model);
        Ok(())
    }

    /// Gives the disarmed vehicle its settings.
    ///
    /// # Errors
    /// If it is armed, if the airframe cannot be mixed, or if the model does not fit.
    pub fn configure(&mut self, settings: &Settings) -> Result<(), Reason> {
        if self.armed {
            return Err(Reason::Armed);
        }
        if !self.flight.configure(settings) {
            return Err(Reason::Settings);
        }
        (self.rates, self.age, self.state) = (Some(settings.rates), StateAge::new(&settings.rates), State::ORIGIN);
        match self.model {
            Some(model) if self.flight.adapter().is_none() => {
                self.flight.attach(model, Lanes::NONE).map_err(|refusal| Reason::Model((&refusal).into()))
            }
            _ => Ok(()),
        }
    }

    /// Whether the motors may turn.
    pub fn armed(&self) -> bool {
        self.armed
    }

    /// Whether a control tick was flown since the motors were armed.
    pub fn in_flight(&self) -> bool {
        self.armed && self.tick.0 > 0
    }

    /// Whether a new attitude came since the last tick.
    pub fn informed(&self) -> bool {
        self.age.informed()
    }

    /// Carries a command out, or does not; models are the board's affair.
    pub fn handle(&mut self, received: &Received<Command<'_>>) -> Reaction {
        let outcome = match (&received.message, received.order) {
            (Command::Hello, _) => return Reaction::Introduce,
            (Command::Inertial(inertial), _) => {
                if self.age.inertial(inertial.tick) {
                    inertial.apply(&mut self.state);
                }
                return Reaction::Silence;
            }
            (Command::Position(position), _) => {
                if self.age.position(position.tick) {
                    position.apply(&mut self.state);
                }
                return Reaction::Silence;
            }
            (Command::Setpoint(setpoint), _) => match self.follow(setpoint) {
                Ok(()) => return Reaction::Silence,
                Err(reason) => Err(reason),
            },
            // An order that was overtaken by a younger one is out of date.
            (_, Order::Late) => return Reaction::Silence,
            (Command::Settings(settings), _) => self.configure(settings),
            (Command::Lanes(lanes), _) => self.switch(*lanes),
            (Command::Arm, _) => self.arm(),
            (Command::Disarm, _) => {
                self.disarm();
                Ok(())
            }
            (Command::ModelBegin { .. } | Command::ModelChunk(_) | Command::ModelCommit, _) => Err(Reason::Storage),
        };
        Reaction::Acknowledge(match outcome {
            Ok(()) => Outcome::Done,
            Err(reason) => Outcome::Refused(reason),
        })
    }

    /// One control tick: what the motors get, and whether there is a job of the network for a task of lower priority.
    pub fn step(&mut self, job: &mut Job) -> (MotorCommand, bool) {
        self.age.tick();
        if !self.armed {
            return (MotorCommand::OFF, false);
        }
        if self.age.motors_off() {
            self.disarm();
            return (MotorCommand::OFF, false);
        }
        let age = if self.age.lanes_off() { u16::MAX } else { 0 };
        if let Some(adapter) = self.flight.adapter() {
            adapter.switch(self.lanes);
            // The guard counts it, and waits before the lanes come back.
            adapter.set_age(age);
        }
        let (command, released) = self.flight.control_into(self.tick, &self.state, job);
        self.tick.0 = self.tick.0.wrapping_add(1);
        self.watch();
        (command, released)
    }

    /// Takes what came of a job.
    pub fn deliver(&mut self, inference: Inference) {
        self.flight.deliver(inference);
    }

    /// The reference that the loop tracks now.
    pub fn reference(&self) -> &Reference {
        self.flight.reference()
    }

    /// What the motors got in the last tick, as the link says it.
    pub fn motors(&self, command: &MotorCommand) -> Motors {
        Motors::new(Tick(self.tick.0.wrapping_sub(1)), command, self.flight.reference())
    }

    /// Who this is.
    pub fn identity<'a>(&'a self, software: &'a str) -> Identity<'a> {
        let slot = self.slot;
        let model = self.model.map(|model| crate::link::message::FlyingModel {
            name: model.card().name,
            checksum: model.checksum(),
            slot,
        });
        Identity::new(software, model)
    }

    /// How the vehicle is.
    pub fn telemetry(&mut self, meters: &Meters, frames: FrameReport) -> Telemetry {
        let (network, feedback, late_inferences, saturations) = match self.flight.adapter() {
            Some(adapter) => {
                let [network, feedback] = adapter.weights();
                let lane = |weight, counts: [u16; Trip::ALL.len()]| {
                    let mut report = LaneReport { weight, ..LaneReport::default() };
                    report.trips.iter_mut().zip(counts).for_each(|(place, count)| *place = count);
                    report
                };
                let trips = adapter.trips();
                (lane(network, trips.network), lane(feedback, trips.feedback), adapter.late(), adapter.saturations())
            }
            None => Default::default(),
        };
        Telemetry {
            tick: self.tick.0,
            armed: self.armed,
            network,
            feedback,
            late_inferences,
            saturations,
            frames,
            tracking_error: sqrt(self.error_square),
            control_max: meters.control_max,
            inference_max: meters.inference_max,
            stack_bytes: meters.stack_bytes,
            entry_latency_max: meters.entry_latency_max,
            deadline_misses: meters.deadline_misses,
        }
    }

    fn switch(&mut self, lanes: Lanes) -> Result<(), Reason> {
        let missing = (lanes.network && self.model.and_then(Model::network).is_none())
            || (lanes.feedback && self.model.and_then(Model::feedback).is_none());
        if missing {
            return Err(Reason::NoModel);
        }
        self.lanes = lanes;
        Ok(())
    }

    fn arm(&mut self) -> Result<(), Reason> {
        if self.armed {
            return Err(Reason::Armed);
        }
        if self.rates.is_none() {
            return Err(Reason::Settings);
        }
        if self.age.lanes_off() {
            return Err(Reason::NoState);
        }
        if self.flight.next_setpoint() == 0 {
            return Err(Reason::Setpoint { expected: 0 });
        }
        (self.armed, self.tick, self.error_square) = (true, Tick(0), 0.0);
        self.age.seen();
        Ok(())
    }

    /// Motors off. The next flight begins with a trajectory of its own, and with nothing left of this one.
    fn disarm(&mut self) {
        self.armed = false;
        if let Some(rates) = &self.rates {
            self.age = StateAge::new(rates);
        }
        self.flight.reset();
    }

    /// Appends a sample of the desired trajectory, and what was lost before it.
    fn follow(&mut self, timed: &TimedSetpoint) -> Result<(), Reason> {
        let next = self.flight.next_setpoint();
        let setpoint = timed.setpoint();
        let gap = timed.tick.wrapping_sub(next);
        if gap < 0 {
            return Ok(());
        }
        // What lies further ahead than the preview would push out the present.
        let now = self.flight.reference_tick(self.tick);
        if timed.tick.wrapping_sub(now) >= PREVIEW as i32 || (next == 0 && gap > 0) {
            return Err(Reason::Setpoint { expected: next });
        }
        if gap >= PREVIEW as i32 {
            // Nothing came for so long that the trajectory begins anew.
            self.flight.clear_setpoints(timed.tick);
        }
        let gap = if gap < PREVIEW as i32 { gap } else { 0 };
        let start = self.setpoint;
        for missing in 1..=gap {
            let share = missing as f32 / (gap + 1) as f32;
            self.flight.push_setpoint(&Setpoint {
                position: start.position.lerp(&setpoint.position, share),
                velocity: start.velocity.lerp(&setpoint.velocity, share),
                acceleration: start.acceleration.lerp(&setpoint.acceleration, share),
                yaw: start.yaw + (setpoint.yaw - start.yaw) * share,
            });
        }
        self.flight.push_setpoint(&setpoint);
        self.setpoint = setpoint;
        Ok(())
    }

    /// Follows the tracking error, for the telemetry.
    fn watch(&mut self) {
        let error = self.state.position - self.flight.desired_position(Tick(self.tick.0.wrapping_sub(1)));
        let rate = self.rates.map_or(1.0, |rates| rates.control_hz);
        let share = 1.0 / rate.max(1.0);
        self.error_square += (error.norm_squared() - self.error_square) * share;
    }
}
