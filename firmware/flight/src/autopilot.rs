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
//! | a state from the future, or one that no vehicle is in | ignored and counted: one missed sample |
//! | states of a sender that starts again in flight | heard 20 ms (attitude) and 0.1 s (position) after the last old one |
//! | settings that no vehicle has, or of another control rate | refused by name; nothing changes |
//! | a setpoint after a gap, a re-plan, a brake | no jump, see the table of [`crate::course`] |
//! | a setpoint that is stored already | ignored |
//! | a setpoint that was flown without, or of a sender that starts again | refused, with the tick that is expected |
//! | no setpoint any more | the end of the trajectory is held |

mod learner;
mod meters;
mod reports;
mod state_age;

use impromptu_firmware::{
    adapter::{Inference, Job, Lanes},
    model::{Model, Refusal},
};
use nalgebra::{Quaternion, UnitQuaternion, Vector4};

use crate::{
    course::{Course, Now},
    flight::Flight,
    link::{Command, Message, Order, Outcome, Reason, Received},
    motion::MotionLimits,
    settings::{Rates, Setting, Settings},
    types::{MotorCommand, Reference, State, Tick},
};

pub use learner::{FlightLearner, Learns, NoLearner};
pub use meters::Meters;
use state_age::{News, StateAge};
pub use state_age::{RUN, Timeouts};

/// What is done with a command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reaction {
    /// Nothing is said.
    Silence,
    /// The vehicle says who it is.
    Introduce,
    /// The sender is told what became of the command.
    Acknowledge(Outcome),
    /// The sender is told what was learned, from this byte of it on.
    TellLearned(u32),
}

/// The flight stack with arming, and with timeouts for a link that fails.
#[derive(Debug)]
pub struct Autopilot<'m, L = NoLearner> {
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
    course: Course,
    /// Mean square of the tracking error over about the last second, m².
    error_square: f32,
    refused: u32,
    learner: L,
}

impl Default for Autopilot<'_> {
    fn default() -> Self {
        Self::new()
    }
}

impl Autopilot<'_> {
    /// A vehicle that knows nothing of itself: it cannot be armed. 13 KB, so a microcontroller has it in a static.
    pub const fn new() -> Self {
        Self::with(NoLearner)
    }
}

impl<'m, L: Learns> Autopilot<'m, L> {
    /// [`Autopilot::new`] that learns with this.
    pub const fn with(learner: L) -> Self {
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
            course: Course::NONE,
            error_square: 0.0,
            refused: 0,
            learner,
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

    /// Gives the disarmed vehicle its settings, all of them or none. This is the board's call: the control rate that it gives is
    /// the one at which it calls [`Autopilot::step`], on which every time-out rests, so no message changes it.
    ///
    /// # Errors
    /// If it is armed, if no vehicle has these settings, or if the model does not fit. Then nothing was changed.
    pub fn configure(&mut self, settings: &Settings) -> Result<(), Reason> {
        if self.armed {
            return Err(Reason::Armed);
        }
        settings.check().map_err(|refusal| Reason::Setting { what: refusal.what })?;
        if let Some(model) = self.model {
            Flight::accepts(model, &settings.rates).map_err(|refusal| Reason::Model((&refusal).into()))?;
        }
        if !self.flight.configure(settings) {
            return Err(Reason::Settings);
        }
        self.course.reset();
        (self.rates, self.age, self.state) = (Some(settings.rates), StateAge::new(&settings.rates), State::ORIGIN);
        self.learner.configure(settings);
        match self.model {
            Some(model) if self.flight.adapter().is_none() => {
                self.flight.attach(model, Lanes::NONE).map_err(|refusal| Reason::Model((&refusal).into()))
            }
            _ => Ok(()),
        }
    }

    /// [`Autopilot::configure`] by a message.
    fn reconfigure(&mut self, settings: &Settings) -> Result<(), Reason> {
        if self.rates.is_none_or(|rates| rates.control_hz != settings.rates.control_hz) {
            return Err(Reason::Setting { what: Setting::ControlRate });
        }
        self.configure(settings)
    }

    /// How fast the vehicle is moved by itself when it brakes and when it comes from one trajectory to another; `false`, and
    /// nothing changes, if no vehicle can be moved so.
    pub fn set_motion_limits(&mut self, limits: MotionLimits) -> bool {
        self.course.limit(limits)
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
        if let Err(reason) = received.message.check() {
            self.refuse();
            return Reaction::Acknowledge(Outcome::Refused(reason));
        }
        self.carry_out(received)
    }

    /// [`Autopilot::handle`] for a message that the line has checked.
    pub(crate) fn carry_out(&mut self, received: &Received<Command<'_>>) -> Reaction {
        let outcome = match (&received.message, received.order) {
            (Command::Hello, _) => return Reaction::Introduce,
            (Command::Inertial(inertial), _) => {
                match self.age.inertial(inertial.tick) {
                    News::Newer => inertial.apply(&mut self.state),
                    News::Older => {}
                    News::Ahead => self.refuse(),
                }
                return Reaction::Silence;
            }
            (Command::Position(position), _) => {
                match self.age.position(position.tick) {
                    News::Newer => {
                        position.apply(&mut self.state);
                        self.learner.hear();
                    }
                    News::Older => {}
                    News::Ahead => self.refuse(),
                }
                return Reaction::Silence;
            }
            (Command::Setpoint(setpoint), _) => {
                let now = self.now();
                match self.course.follow(&mut self.flight, &now, setpoint.tick, &setpoint.setpoint()) {
                    Ok(()) => return Reaction::Silence,
                    Err(refusal) => Err(refusal.into()),
                }
            }
            // An order that was overtaken by a younger one is out of date.
            (_, Order::Late) => return Reaction::Silence,
            (Command::Settings(settings), _) => self.reconfigure(settings),
            (Command::Lanes(lanes), _) => self.switch(*lanes),
            (Command::Replan(setpoint), _) => {
                let now = self.now();
                self.course.replan(&mut self.flight, &now, setpoint.tick, &setpoint.setpoint()).map_err(Reason::from)
            }
            (Command::Brake, _) => self.brake(),
            (Command::Arm, _) => self.arm(),
            (Command::Disarm, _) => {
                self.disarm();
                Ok(())
            }
            (Command::Learn(order), _) => self.learner.order(*order),
            (Command::Learned { offset }, _) => match self.tells_learned(*offset) {
                Ok(()) => return Reaction::TellLearned(*offset),
                Err(reason) => Err(reason),
            },
            (Command::ModelBegin { .. } | Command::ModelChunk(_) | Command::ModelCommit, _) => Err(Reason::Storage),
        };
        Reaction::Acknowledge(match outcome {
            Ok(()) => Outcome::Done,
            Err(reason) => Outcome::Refused(reason),
        })
    }

    /// States that were refused since the start: from the future, or such that no vehicle is in. What the line refuses before it
    /// comes here is in [`crate::link::message::FrameReport::damaged`].
    pub fn refused(&self) -> u32 {
        self.refused
    }

    fn refuse(&mut self) {
        self.refused = self.refused.saturating_add(1);
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
        if self.course.braking() {
            let now = self.now();
            self.course.keep_up(&mut self.flight, &now);
        }
        self.learner.step(&mut self.flight, self.tick, &self.state);
        let (command, released) = self.flight.control_known(self.tick, &self.state, job);
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
        self.course.reset();
        self.learner.land();
    }

    /// Where the flight is on its trajectory.
    fn now(&self) -> Now {
        let period = self.rates.map_or(0.0, |rates| 1.0 / rates.reference_hz());
        if !self.armed {
            return Now { tick: 0, flown: None, period };
        }
        let last = Tick(self.tick.0.wrapping_sub(1));
        let flown = (self.tick.0 > 0).then(|| self.flight.reference_tick(last));
        Now { tick: self.flight.reference_tick(self.tick), flown, period }
    }

    fn brake(&mut self) -> Result<(), Reason> {
        if !self.armed {
            return Err(Reason::NotArmed);
        }
        let now = self.now();
        self.course.brake(&mut self.flight, &now);
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
