//! The same over the link: settings and other commands as a host says them.
//!
//! *in* bytes that say which commands; *out* how many settings were taken and ticks flown; *never* as in the module above, nor a
//! report that cannot be decoded.

use impromptu_firmware::{Job, Lanes, Scratch};
use impromptu_flight::{
    application::Application,
    autopilot::Meters,
    link::{
        Command, FRAME, Outcome, Receiver, Report, Reports, Sender,
        message::{Inertial, Position, TimedSetpoint},
    },
    types::{Setpoint, State, Tick},
};

use super::vehicle::{MODEL, answer, crazyflie, judge, setpoint, settings, state};
use crate::bytes::Bytes;

/// A vehicle at the end of a line.
struct Line {
    application: Application<'static>,
    sender: Sender,
    reports: Receiver<Reports>,
}

impl Line {
    fn new() -> Self {
        let mut application = Application::new();
        assert!(application.autopilot().configure(&crazyflie()).is_ok() && application.autopilot().load(&MODEL, None).is_ok());
        Self { application, sender: Sender::new(), reports: Receiver::new() }
    }

    /// Says a command; gives what became of it, if the vehicle tells.
    fn say(&mut self, command: &Command<'_>) -> Option<Outcome> {
        let mut frame = [0; FRAME];
        let Some((_, bytes)) = self.sender.encode(command, &mut frame) else { panic!("no frame for {command:?}") };
        for byte in bytes {
            assert!(self.application.on_byte(*byte).is_none(), "no model was said");
        }
        self.hear()
    }

    /// Reports, all of which can be decoded; what became of the newest command.
    fn hear(&mut self) -> Option<Outcome> {
        let mut outcome = None;
        for byte in self.application.outbox() {
            match self.reports.push(*byte) {
                Some(Ok(received)) => {
                    if let Report::Acknowledge { outcome: newest, .. } = received.message {
                        outcome = Some(newest);
                    }
                }
                Some(Err(fault)) => panic!("a report cannot be decoded: {fault:?}"),
                None => {}
            }
        }
        self.application.sent();
        outcome
    }

    fn step(&mut self) -> Vec<u32> {
        let mut job = Job::EMPTY;
        let (command, released) = self.application.step(&Meters::default(), &mut job);
        if let Some(network) = MODEL.network().filter(|_| released) {
            self.application.deliver(job.run(network, &mut Scratch::new()));
        }
        self.hear();
        answer(&command, self.application.autopilot().reference())
    }
}

/// Two of them.
pub(super) struct Lines {
    told: Line,
    other: Line,
    tick: u32,
    setpoint: i32,
    taken: usize,
    flown: usize,
}

impl Lines {
    pub(super) fn new() -> Self {
        Self { told: Line::new(), other: Line::new(), tick: 1, setpoint: 0, taken: 0, flown: 0 }
    }

    /// Says it to both, but to the other one only if the first does not refuse it.
    fn say(&mut self, command: &Command<'_>) {
        let outcome = self.told.say(command);
        if let Command::Settings(settings) = command {
            let armed = self.told.application.autopilot().armed();
            let good = settings.check().is_ok() && settings.rates == crazyflie().rates;
            assert!(outcome != Some(Outcome::Done) || (settings.check().is_ok() && !armed), "{settings:?}");
            assert!(!good || armed || outcome == Some(Outcome::Done), "{outcome:?}: {settings:?}");
            if outcome == Some(Outcome::Done) {
                judge(settings);
                self.taken += 1;
            }
        }
        if !matches!(outcome, Some(Outcome::Refused(_))) {
            self.other.say(command);
        }
    }

    pub(super) fn fly(mut self, bytes: &mut Bytes<'_>) -> [usize; 2] {
        while !bytes.is_empty() {
            self.call(bytes);
        }
        [self.taken, self.flown]
    }

    fn news(&mut self, bytes: &mut Bytes<'_>) {
        let state = state(bytes, &Setpoint::ORIGIN);
        self.say(&Command::Inertial(Inertial::new(Tick(self.tick), &state)));
        if self.tick.is_multiple_of(5) {
            self.say(&Command::Position(Position::new(Tick(self.tick), &state)));
        }
    }

    fn timed(&mut self, bytes: &mut Bytes<'_>, tick: i32) -> TimedSetpoint {
        let Setpoint { position, velocity, acceleration, yaw } = setpoint(bytes);
        TimedSetpoint { tick, position: position.into(), velocity: velocity.into(), acceleration: acceleration.into(), yaw }
    }

    fn step(&mut self) {
        self.flown += usize::from(self.told.application.autopilot().armed());
        assert_eq!(self.told.step(), self.other.step(), "a refused command");
        self.tick = self.tick.wrapping_add(1);
    }

    fn call(&mut self, bytes: &mut Bytes<'_>) {
        match bytes.choice(16) {
            0..=4 => {
                for _ in 0..=bytes.choice(16) {
                    self.news(bytes);
                    self.step();
                }
            }
            5 => (0..bytes.byte()).for_each(|_| self.step()),
            6 => {
                self.tick = bytes.tick(self.tick as i32) as u32;
                self.news(bytes);
            }
            7 | 8 => self.say(&Command::Settings(settings(bytes))),
            9 | 10 => {
                for _ in 0..=bytes.choice(64) {
                    let setpoint = self.timed(bytes, self.setpoint);
                    self.say(&Command::Setpoint(setpoint));
                    self.setpoint = self.setpoint.wrapping_add(1);
                }
            }
            11 => {
                let tick = bytes.tick(self.setpoint);
                let setpoint = self.timed(bytes, tick);
                self.setpoint = tick.wrapping_add(1);
                self.say(&if bytes.choice(2) == 0 { Command::Replan(setpoint) } else { Command::Setpoint(setpoint) });
            }
            12 => {
                let lanes = bytes.byte();
                self.say(&Command::Lanes(Lanes { network: lanes & 1 == 0, feedback: lanes & 2 == 0 }));
            }
            13 => self.say(&Command::Brake),
            14 => self.say(&Command::Arm),
            _ => match bytes.choice(8) {
                0 => self.say(&Command::Disarm),
                1 => self.say(&Command::Hello),
                _ => {
                    // Ready to fly.
                    self.setpoint = 0;
                    for tick in 0..100 {
                        let at = TimedSetpoint { tick, position: [0.0; 3], velocity: [0.0; 3], acceleration: [0.0; 3], yaw: 0.0 };
                        self.say(&Command::Setpoint(at));
                        self.setpoint = tick + 1;
                    }
                    for _ in 0..5 {
                        self.tick = self.tick.wrapping_add(1);
                        self.say(&Command::Inertial(Inertial::new(Tick(self.tick), &State::ORIGIN)));
                        self.say(&Command::Position(Position::new(Tick(self.tick), &State::ORIGIN)));
                    }
                    self.say(&Command::Lanes(Lanes::BOTH));
                    self.say(&Command::Arm);
                }
            },
        }
    }
}
