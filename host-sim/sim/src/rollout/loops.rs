//! The loop that flies, in two parts with a link between them.
//!
//! *in* what the flight stack's position part wants, at reference ticks, and the state; *out* motor commands; *never* other bits
//! than the flight stack's where the loop is its own; *source* [`crate::controller`].

use impromptu_flight::{
    control::ThrustVector,
    flight::{Flight, Rates},
    types::{MotorCommand, State, Tick},
};

use super::link::Link;
use crate::{
    controller::{Attitude, Controller, Mellinger, Pid, Target, ThrustWish},
    plant::Vehicle,
};

/// A loop and its link.
pub(super) enum Loops {
    /// The flight stack's own.
    Se3(Link<ThrustVector>),
    /// The cascade of PIDs, with the rate of the references.
    Pid(Box<Pid>, Link<Attitude>, f32),
    /// Mellinger's.
    Mellinger(Mellinger, Link<ThrustWish>, f32),
}

impl Loops {
    /// The flight stack's own, with a link of `delay` control ticks.
    pub(super) fn own(delay: u32) -> Self {
        Self::Se3(Link::new(delay, ThrustVector::NONE))
    }

    /// A loop for a vehicle, with a link of `delay` control ticks.
    pub(super) fn new(controller: Controller, vehicle: &Vehicle, rates: &Rates, delay: u32) -> Self {
        let (slow, fast) = (rates.reference_hz(), rates.control_hz);
        match controller {
            Controller::Se3 => Self::own(delay),
            Controller::Pid => Self::Pid(Box::new(Pid::new(vehicle, slow, fast)), Link::new(delay, Attitude::LEVEL), slow),
            Controller::Mellinger { feed_forward } => {
                let controller = Mellinger::new(vehicle, feed_forward, slow, fast);
                Self::Mellinger(controller, Link::new(delay, ThrustWish::NONE), slow)
            }
        }
    }

    /// At a reference tick: the position part. Of the flight stack's wish only its own attitude part makes use.
    pub(super) fn position_step(&mut self, tick: Tick, wanted: ThrustVector, flight: &Flight<'_>, state: &State) {
        match self {
            Self::Se3(link) => link.send(tick, wanted),
            Self::Pid(pid, link, hz) => link.send(tick, pid.position_step(&Target::of(flight, tick, *hz), state)),
            Self::Mellinger(mellinger, link, hz) => {
                link.send(tick, mellinger.position_step(&Target::of(flight, tick, *hz), state));
            }
        }
    }

    /// At each control tick: the attitude part.
    pub(super) fn attitude_step(&mut self, tick: Tick, flight: &mut Flight<'_>, state: &State) -> MotorCommand {
        match self {
            Self::Se3(link) => flight.attitude_step(link.receive(tick), state),
            Self::Pid(pid, link, _) => pid.attitude_step(link.receive(tick), state),
            Self::Mellinger(mellinger, link, _) => mellinger.attitude_step(link.receive(tick), state),
        }
    }
}
