//! A flight stack in which something goes wrong between its parts, as a robustness study asks.
//!
//! *in* a flight stack, a gain on its feedback lane and a delay of its attitude loop's commands; *out* its motor commands;
//! *never* other bits than those of [`Flight::step`] with a gain of 1 and no delay; *source* the seams of the flight stack:
//! [`Flight::position_step`] and [`Flight::attitude_step`].

use std::collections::VecDeque;

use impromptu_firmware::{adapter::Job, model::Model, network::Scratch};
use impromptu_flight::{
    control::ThrustVector,
    flight::Flight,
    types::{MotorCommand, State, Tick},
};

/// A flight stack with faults.
pub struct FaultyFlight<'m> {
    /// What flies.
    pub flight: Flight<'m>,
    /// Factor on what the loop gets of the feedback lane, unknown to the lane.
    loop_gain: f32,
    /// Control ticks for which a command of the position loop is on its way to the attitude loop: the link of a position loop off
    /// board.
    command_delay: u32,
    /// Commands on their way, with the control tick at which they are due.
    on_the_way: VecDeque<(u32, ThrustVector)>,
    wanted: ThrustVector,
}

impl<'m> FaultyFlight<'m> {
    /// A flight stack on the ground with these faults; a gain of 1 and no delay are none.
    pub fn new(flight: Flight<'m>, loop_gain: f32, command_delay: u32) -> Self {
        Self { flight, loop_gain, command_delay, on_the_way: VecDeque::new(), wanted: ThrustVector::NONE }
    }

    /// One control tick, the network included.
    pub fn step(&mut self, tick: Tick, state: &State, scratch: &mut Scratch) -> MotorCommand {
        let (gain, mut job) = (self.loop_gain, Job::EMPTY);
        let scale = |asked: &mut [f32; _]| asked.iter_mut().for_each(|value| *value *= gain);
        let (wanted, released) = self.flight.position_step(tick, state, &mut job, scale);
        if let Some(wanted) = wanted {
            if tick.0 == 0 {
                self.wanted = wanted;
            }
            self.on_the_way.push_back((tick.0.wrapping_add(self.command_delay), wanted));
        }
        while self.on_the_way.front().is_some_and(|(due, _)| *due <= tick.0)
            && let Some((_, wanted)) = self.on_the_way.pop_front()
        {
            self.wanted = wanted;
        }
        let command = self.flight.attitude_step(&self.wanted, state);
        if released && let Some(network) = self.flight.adapter().and_then(|adapter| adapter.model()).and_then(Model::network) {
            self.flight.deliver(job.run(network, scratch));
        }
        command
    }
}
