//! The flight stack.
//!
//! *in* states, setpoints, a model; *out* motor commands; *never* other bits than those of the flight stack in Rust; *source*
//! [`impromptu_flight::flight`].

use impromptu_firmware::{
    adapter::{Inference, Job, Lanes},
    add_on,
    model::Model,
    network::Scratch,
};
use impromptu_flight::{
    course::{self, Course, Now},
    flight::Flight,
    types::{self, MotorCommand, Tick},
};

use crate::{
    status::Status,
    values::{Command, Report, Setpoint, State},
};

/// A flight stack.
#[derive(Debug)]
pub struct Stack {
    pub(crate) flight: Flight<'static>,
    pub(crate) course: Course,
    /// Seconds from one reference tick to the next.
    pub(crate) period: f32,
    /// The last reference tick that was flown.
    pub(crate) flown: Option<i32>,
}

impl Stack {
    /// Puts an add-on before the loop, with the lanes given.
    ///
    /// # Errors
    /// If the model does not fit; the loop then stays as it was.
    pub fn attach(&mut self, model: &'static Model<'static>, lanes: Lanes) -> Result<(), Status> {
        Ok(self.flight.attach(model, lanes)?)
    }

    /// Appends the desired state of the next reference tick.
    ///
    /// # Errors
    /// If a number is not finite, or no vehicle can be asked for it, or the vehicle brakes, or the preview is full; then nothing
    /// is stored.
    pub fn push(&mut self, setpoint: &Setpoint) -> Result<(), Status> {
        let (setpoint, now) = (physical(setpoint)?, self.now());
        Ok(self.course.append(&mut self.flight, &now, &setpoint)?)
    }

    /// Replaces what is stored from a reference tick on; the difference fades.
    ///
    /// # Errors
    /// If a number is not finite, or no vehicle can be asked for it, or the tick has been flown; then nothing changes.
    pub fn replan(&mut self, tick: i32, setpoint: &Setpoint) -> Result<(), Status> {
        let (setpoint, now) = (physical(setpoint)?, self.now());
        Ok(self.course.replan(&mut self.flight, &now, tick, &setpoint)?)
    }

    /// Replaces what is stored after the present by coming to rest.
    pub fn brake(&mut self) {
        let now = self.now();
        self.course.brake(&mut self.flight, &now);
    }

    fn now(&self) -> Now {
        Now { tick: self.flown.map_or(0, |flown| flown.wrapping_add(1)), flown: self.flown, period: self.period }
    }

    /// What the trajectory needs before a control tick, and which state it is.
    fn begin(&mut self, tick: u32, state: &State) -> Result<types::State, Status> {
        let state = state.checked().filter(types::State::is_physical).ok_or(Status::NotFinite)?;
        self.flown = Some(self.flight.reference_tick(Tick(tick)));
        let now = self.now();
        self.course.keep_up(&mut self.flight, &now);
        Ok(state)
    }

    /// Lets lanes act again that the guard has handed over for good.
    ///
    /// # Errors
    /// If there is no model.
    pub fn rearm(&mut self) -> Result<(), Status> {
        self.flight.adapter().ok_or(Status::Nothing)?.rearm();
        Ok(())
    }

    /// Switches lanes.
    ///
    /// # Errors
    /// If there is no model.
    pub fn switch(&mut self, lanes: Lanes) -> Result<(), Status> {
        self.flight.adapter().ok_or(Status::Nothing)?.switch(lanes);
        Ok(())
    }

    /// A control tick, the network included.
    ///
    /// # Errors
    /// If the state is not finite, or no vehicle can be in it; then nothing is done.
    pub fn step(&mut self, tick: u32, state: &State, scratch: &mut Scratch) -> Result<Command, Status> {
        let state = self.begin(tick, state)?;
        let command = self.flight.step(Tick(tick), &state, scratch);
        Ok(self.command(&command))
    }

    /// A control tick without the network.
    ///
    /// # Errors
    /// If the state is not finite, or no vehicle can be in it; then nothing is done.
    pub fn control(&mut self, tick: u32, state: &State) -> Result<(Command, Option<Job>), Status> {
        let state = self.begin(tick, state)?;
        let (command, job) = self.flight.control(Tick(tick), &state);
        Ok((self.command(&command), job))
    }

    /// Takes the result of a job.
    pub fn deliver(&mut self, inference: Inference) {
        self.flight.deliver(inference);
    }

    /// What the add-on has done.
    ///
    /// # Errors
    /// If there is no model.
    pub fn report(&mut self) -> Result<Report, Status> {
        let next_tick = self.flight.next_setpoint();
        Ok(add_on::Report::of(self.flight.adapter().ok_or(Status::Nothing)?, next_tick).into())
    }

    fn command(&self, command: &MotorCommand) -> Command {
        Command { motors: command.fractions(), reference: self.flight.reference().into() }
    }
}

/// A setpoint that a vehicle can be asked for.
fn physical(setpoint: &Setpoint) -> Result<types::Setpoint, Status> {
    setpoint.checked().filter(types::Setpoint::is_physical).ok_or(Status::NotFinite)
}

impl From<course::Refusal> for Status {
    fn from(refusal: course::Refusal) -> Self {
        match refusal {
            course::Refusal::Braking => Self::Braking,
            course::Refusal::Tick { .. } => Self::Tick,
            course::Refusal::Full { .. } => Self::Full,
        }
    }
}
