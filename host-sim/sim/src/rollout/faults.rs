//! A flight stack in which something goes wrong between its parts, as a robustness study asks.
//!
//! *in* a flight stack, a gain on its feedback lane and a delay of its attitude loop's commands; *out* its motor commands;
//! *never* other bits than those of [`Flight::step`] with a gain of 1 and no delay; *source* the seams of the flight stack:
//! [`Flight::position_step`] and [`Flight::attitude_step`].

use impromptu_firmware::{adapter::Job, model::Model, network::Scratch};
use impromptu_flight::{
    flight::Flight,
    types::{MotorCommand, State, Tick},
};

use super::loops::Loops;

/// A flight stack with faults.
pub struct FaultyFlight<'m> {
    /// What flies.
    pub flight: Flight<'m>,
    /// Factor on what the loop gets of the feedback lane, unknown to the lane.
    loop_gain: f32,
    /// What flies the vehicle, with the link on which its position part's commands are late.
    loops: Loops,
}

impl<'m> FaultyFlight<'m> {
    /// A flight stack on the ground with these faults; a gain of 1 and no delay are none.
    pub fn new(flight: Flight<'m>, loop_gain: f32, command_delay: u32) -> Self {
        Self::with(flight, loop_gain, Loops::own(command_delay))
    }

    /// The same with a loop that may be another than the flight stack's own.
    pub(super) fn with(flight: Flight<'m>, loop_gain: f32, loops: Loops) -> Self {
        Self { flight, loop_gain, loops }
    }

    /// One control tick, the network included.
    pub fn step(&mut self, tick: Tick, state: &State, scratch: &mut Scratch) -> MotorCommand {
        let (gain, mut job) = (self.loop_gain, Job::EMPTY);
        let scale = |asked: &mut [f32; _]| asked.iter_mut().for_each(|value| *value *= gain);
        let (wanted, released) = self.flight.position_step(tick, state, &mut job, scale);
        if let Some(wanted) = wanted {
            self.loops.position_step(tick, wanted, &self.flight, state);
        }
        let command = self.loops.attitude_step(tick, &mut self.flight, state);
        if released && let Some(network) = self.flight.adapter().and_then(|adapter| adapter.model()).and_then(Model::network) {
            self.flight.deliver(job.run(network, scratch));
        }
        command
    }
}
