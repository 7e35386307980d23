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
    /// If a number is not finite, or no vehicle can be asked for it; then nothing is stored.
    pub fn push(&mut self, setpoint: &Setpoint) -> Result<(), Status> {
        let setpoint = setpoint.checked().ok_or(Status::NotFinite)?;
        self.flight.push_setpoint(&setpoint).then_some(()).ok_or(Status::NotFinite)
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
        let state = state.checked().filter(types::State::is_physical).ok_or(Status::NotFinite)?;
        let command = self.flight.step(Tick(tick), &state, scratch);
        Ok(self.command(&command))
    }

    /// A control tick without the network.
    ///
    /// # Errors
    /// If the state is not finite, or no vehicle can be in it; then nothing is done.
    pub fn control(&mut self, tick: u32, state: &State) -> Result<(Command, Option<Job>), Status> {
        let state = state.checked().filter(types::State::is_physical).ok_or(Status::NotFinite)?;
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
