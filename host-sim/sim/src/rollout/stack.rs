//! What flies a vehicle: the flight stack in this program, or the same one in a microcontroller.
//!
//! *in* setpoints ahead of time, and the state at each control tick; *out* motor commands; *never* a time of its own; *source*
//! the calls of [`impromptu_flight::flight::Flight`].

use impromptu_firmware::{guard::Trips, network::Scratch};
use impromptu_flight::{
    flight::{Flight, Settings},
    learning::FlightLearning,
    types::{MotorCommand, Reference, Setpoint, State, Tick},
};
use nalgebra::Vector3;

use super::{
    faults::FaultyFlight,
    loops::Loops,
    plan::{FlightPlan, RolloutError},
};
use crate::{condition::Condition, controller::Controller, plant::Vehicle};

/// A flight stack, on the ground or in flight.
pub trait FlightStack {
    /// Appends the desired state of the next reference tick.
    fn push_setpoint(&mut self, setpoint: &Setpoint);
    /// Reference tick of the next setpoint.
    fn next_setpoint(&self) -> i32;
    /// Offsets the position reference, m, world ENU.
    fn set_dither(&mut self, offset: Vector3<f32>);
    /// One control tick.
    fn step(&mut self, tick: Tick, state: &State) -> MotorCommand;
    /// The reference that the loop tracks now.
    fn reference(&self) -> &Reference;
    /// Trips of the guard so far.
    fn trips(&mut self) -> Trips;
}

impl<S: FlightStack> FlightStack for &mut S {
    fn push_setpoint(&mut self, setpoint: &Setpoint) {
        S::push_setpoint(self, setpoint);
    }

    fn next_setpoint(&self) -> i32 {
        S::next_setpoint(self)
    }

    fn set_dither(&mut self, offset: Vector3<f32>) {
        S::set_dither(self, offset);
    }

    fn step(&mut self, tick: Tick, state: &State) -> MotorCommand {
        S::step(self, tick, state)
    }

    fn reference(&self) -> &Reference {
        S::reference(self)
    }

    fn trips(&mut self) -> Trips {
        S::trips(self)
    }
}

/// The flight stack in this program.
pub(super) struct Software<'a> {
    inside: FaultyFlight<'a>,
    scratch: Scratch,
    learning: Option<&'a mut FlightLearning>,
}

impl<'a> Software<'a> {
    pub(super) fn new(
        vehicle: &Vehicle,
        controller: Controller,
        settings: &Settings,
        condition: &Condition,
        plan: &FlightPlan<'a>,
    ) -> Result<Self, RolloutError> {
        controller.check(vehicle)?;
        settings.check().map_err(|refusal| RolloutError::Airframe(format!("`{}`: {refusal}", vehicle.name)))?;
        let mut flight = Flight::empty();
        flight.configure(settings);
        if let Some((model, lanes)) = plan.model {
            flight.attach(model, lanes)?;
            if let Some(adapter) = flight.adapter() {
                adapter.set_guard(plan.guard);
            }
        }
        let delay = condition.command_delay_ticks(settings.rates.control_hz.into());
        let loops = Loops::new(controller, vehicle, &settings.rates, delay);
        let inside = FaultyFlight::with(flight, plan.loop_gain, loops);
        Ok(Self { inside, scratch: Scratch::new(), learning: None })
    }

    /// The same, which learns what it does not know yet.
    pub(super) fn learning(self, learning: &'a mut FlightLearning) -> Self {
        learning.restart();
        Self { learning: Some(learning), ..self }
    }
}

impl FlightStack for Software<'_> {
    fn push_setpoint(&mut self, setpoint: &Setpoint) {
        self.inside.flight.push_setpoint(setpoint);
    }

    fn next_setpoint(&self) -> i32 {
        self.inside.flight.next_setpoint()
    }

    fn set_dither(&mut self, offset: Vector3<f32>) {
        self.inside.flight.set_dither(offset);
    }

    fn step(&mut self, tick: Tick, state: &State) -> MotorCommand {
        if let Some(learning) = &mut self.learning {
            learning.step(&mut self.inside.flight, tick, Some(state));
        }
        self.inside.step(tick, state, &mut self.scratch)
    }

    fn reference(&self) -> &Reference {
        self.inside.flight.reference()
    }

    fn trips(&mut self) -> Trips {
        self.inside.flight.adapter().map(|adapter| adapter.trips()).unwrap_or_default()
    }
}
