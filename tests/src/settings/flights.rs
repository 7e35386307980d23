//! Settings, states and setpoints by calls.
//!
//! *in* bytes that say which calls; *out* how many settings were taken and ticks flown; *never* as in the module above.

use impromptu_firmware::{Lanes, Scratch};
use impromptu_flight::{
    flight::{Flight, Settings},
    types::{POSITION_LIMIT, Setpoint, State, Tick},
};

use super::vehicle::{MODEL, answer, crazyflie, judge, setpoint, settings, state};
use crate::bytes::Bytes;

/// Two flight stacks.
pub(super) struct Flights {
    told: Flight<'static>,
    other: Flight<'static>,
    /// The newest state that was one.
    known: Option<State>,
    tick: u32,
    taken: usize,
    flown: usize,
}

impl Flights {
    pub(super) fn new() -> Self {
        Self { told: Flight::empty(), other: Flight::empty(), known: None, tick: 0, taken: 0, flown: 0 }
    }

    pub(super) fn fly(mut self, bytes: &mut Bytes<'_>) -> [usize; 2] {
        self.configure(&crazyflie());
        self.attach(Lanes::BOTH);
        while !bytes.is_empty() {
            self.call(bytes);
        }
        [self.taken, self.flown]
    }

    fn configure(&mut self, settings: &Settings) {
        let taken = self.told.configure(settings);
        assert_eq!(taken, settings.check().is_ok());
        if taken {
            judge(settings);
            self.other.configure(settings);
            (self.known, self.tick) = (None, 0);
        }
        self.taken += usize::from(taken);
    }

    fn attach(&mut self, lanes: Lanes) {
        if self.told.attach(&MODEL, lanes).is_ok() {
            assert!(self.other.attach(&MODEL, lanes).is_ok());
        }
    }

    fn both(&mut self, call: impl Fn(&mut Flight<'static>)) {
        call(&mut self.told);
        call(&mut self.other);
    }

    fn push(&mut self, setpoint: &Setpoint) {
        let before = self.told.next_setpoint();
        let taken = self.told.push_setpoint(setpoint);
        assert_eq!(self.told.next_setpoint(), before.wrapping_add(i32::from(taken)));
        if setpoint.is_physical() {
            // Whether there is room is the same in both.
            assert_eq!(self.other.push_setpoint(setpoint), taken);
        } else {
            assert!(!taken);
        }
    }

    fn control(&mut self, state: &State) {
        if state.is_physical() {
            self.known = Some(*state);
        }
        let fly = |flight: &mut Flight<'static>, state: &State| {
            let (command, job) = flight.control(Tick(self.tick), state);
            if let (Some(job), Some(network)) = (job, MODEL.network()) {
                flight.deliver(job.run(network, &mut Scratch::new()));
            }
            answer(&command, flight.reference())
        };
        let found = fly(&mut self.told, state);
        match &self.known {
            Some(known) => assert_eq!(found, fly(&mut self.other, known), "a state that no vehicle is in"),
            None => assert_eq!(found[..4], [0; 4], "motors are off before there is a state"),
        }
        self.flown += usize::from(self.known.is_some());
    }

    fn call(&mut self, bytes: &mut Bytes<'_>) {
        match bytes.choice(16) {
            0..=5 => {
                let near = self.told.setpoint(self.told.reference_tick(Tick(self.tick)));
                for _ in 0..=bytes.choice(16) {
                    self.control(&state(bytes, &near));
                    self.tick = self.tick.wrapping_add(1);
                }
            }
            6 => {
                self.tick = bytes.tick(self.tick as i32) as u32;
                self.control(&state(bytes, &Setpoint::ORIGIN));
            }
            7 | 8 => {
                let setpoint = setpoint(bytes);
                self.push(&setpoint);
            }
            9 => {
                // A trajectory.
                let mut at = setpoint(bytes);
                for _ in 0..bytes.byte() {
                    at.position += at.velocity * 0.01;
                    self.push(&at);
                }
            }
            10 | 11 => self.configure(&settings(bytes)),
            12 => {
                let lanes = bytes.byte();
                self.attach(Lanes { network: lanes & 1 == 0, feedback: lanes & 2 == 0 });
            }
            13 => {
                let dither = bytes.numbers();
                self.told.set_dither(dither.into());
                if dither.iter().all(|number| number.abs() <= POSITION_LIMIT) {
                    self.other.set_dither(dither.into());
                }
            }
            14 => {
                let from = bytes.tick(self.told.next_setpoint());
                self.both(|flight| flight.replace_setpoints(from));
            }
            _ => {
                let first = bytes.tick(self.told.next_setpoint());
                match bytes.choice(3) {
                    0 => self.both(|flight| flight.clear_setpoints(first)),
                    1 => self.both(Flight::detach),
                    _ => {
                        self.both(Flight::reset);
                        (self.known, self.tick) = (None, 0);
                    }
                }
            }
        }
    }
}
