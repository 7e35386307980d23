//! Writes recordings.
//!
//! *in* the calls of a flight and its answers; *out* their bytes; *never* a call out of order; *source* the table in [`super`].

use nalgebra::Vector3;

use super::{Event, Header, answer};
use impromptu_firmware::{adapter::Lanes, model::Model};

use crate::{
    settings::Settings,
    types::{MotorCommand, Reference, Setpoint, State},
};

/// A finished recording with its answers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recorded<S> {
    /// Header and records.
    pub recording: S,
    /// The answers.
    pub answers: S,
}

/// Writes down a flight while it is flown, into anything that takes bytes (a `Vec<u8>`).
///
/// Whoever flies a [`crate::flight::Flight`] tells the recorder of each call: what happens between ticks before it takes effect,
/// and each tick with the answer.
#[derive(Clone, Debug)]
pub struct Recorder<S> {
    recorded: Recorded<S>,
    ticks: u32,
}

impl<S: Default + Extend<u8>> Recorder<S> {
    /// A recorder for a flight with these settings and, if an add-on is attached, its model and first lanes.
    pub fn new(settings: &Settings, addon: Option<(&Model<'_>, Lanes)>) -> Self {
        let mut recorder = Self { recorded: Recorded::default(), ticks: 0 };
        let header = Header { settings: *settings, model: addon.map(|(model, _)| model.checksum()) };
        recorder.recorded.recording.extend(header.to_bytes());
        if let Some((_, lanes)) = addon {
            recorder.lanes(lanes);
        }
        recorder
    }

    /// A setpoint was pushed.
    pub fn setpoint(&mut self, setpoint: &Setpoint) {
        self.write(Event::Setpoint(*setpoint));
    }

    /// Lanes were switched.
    pub fn lanes(&mut self, lanes: Lanes) {
        self.write(Event::Lanes(lanes));
    }

    /// The dither was set.
    pub fn dither(&mut self, offset: Vector3<f32>) {
        self.write(Event::Dither(offset));
    }

    /// A control tick was flown: state in, motors and reference out.
    pub fn tick(&mut self, state: &State, command: &MotorCommand, reference: &Reference) {
        self.write(Event::Tick(*state));
        self.recorded.answers.extend(answer(command, reference));
        self.ticks += 1;
    }

    /// Ends the recording.
    pub fn finish(mut self) -> Recorded<S> {
        let ticks = self.ticks;
        self.write(Event::End { ticks });
        self.recorded
    }

    fn write(&mut self, event: Event) {
        self.recorded.recording.extend(event.to_bytes());
    }
}
