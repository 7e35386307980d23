//! The microcontroller as a flight stack.

use std::time::{Duration, Instant};

use impromptu_firmware::{adapter::Lanes, guard::Trips};
use impromptu_flight::{
    flight::Settings,
    link::{
        Command, FRAME, Outcome, Reason, Receiver, Report, Reports, Sender,
        message::{Inertial, LaneReport, LearningReport, Position, Telemetry, TimedSetpoint},
    },
    types::{MotorCommand, Reference, Setpoint, State, Tick},
};
use impromptu_sim::rollout::FlightStack;
use nalgebra::Vector3;
use serde::Serialize;

use crate::{error::PilError, line::Line};

/// How long a serial line may take to answer: long beside a busy machine, on which the emulator waits for its turn.
const PATIENCE: Duration = Duration::from_secs(5);
/// Bytes that the firmware's queue of a serial line takes at once.
const QUEUE: usize = 1024;
/// Ticks in which the firmware catches up after an upload.
const CATCH_UP: usize = 5;

/// A piece of a model among the commands.
const PIECE: &str = "a piece of the model";
/// How often a piece is sent, and how many control ticks in lockstep its outcome is awaited: a commit runs the model's probes.
pub(super) const ATTEMPTS: usize = 50;
const LOCKSTEP_WAIT: usize = 25;

/// What the microcontroller measured of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Figures {
    /// Control ticks that were not done when the next one was due.
    pub deadline_misses: u32,
    /// Most instructions of a control tick, the link included.
    pub control_instructions_max: u32,
    /// Most instructions of an inference.
    pub inference_instructions_max: u32,
    /// Most instructions from the tick's interrupt to the control task.
    pub entry_instructions_max: u32,
    /// High-water mark of the stack, bytes.
    pub stack_bytes: u32,
    /// Inferences that were late.
    pub late_inferences: u32,
    /// Frames that did not arrive as they were sent.
    pub dropped: u32,
}

/// A firmware at the other end of a line.
pub struct Board<L> {
    line: L,
    sender: Sender,
    receiver: Receiver<Reports>,
    /// Frames of the next exchange.
    outgoing: Vec<u8>,
    telemetry: Telemetry,
    pub(super) learning: Option<LearningReport>,
    /// What came of what was learned, and its whole length.
    pub(super) learned: (Vec<u8>, usize),
    /// What the last exchange brought.
    motors: Option<(Tick, MotorCommand, Reference)>,
    pub(super) refusals: Vec<(&'static str, Reason)>,
    /// Commands whose acknowledgement is awaited.
    pub(super) awaited: Vec<(u8, &'static str)>,
    model: Option<Option<u32>>,
    /// Reports that did not arrive.
    lost: u32,
    failure: Option<std::io::Error>,
    pub(super) lockstep: bool,
    /// What became of the piece of a model that was sent last.
    pub(super) stored: Option<Outcome>,
}

impl<L: Line> Board<L> {
    /// A firmware that has just started; `lockstep`: its control ticks wait for the line.
    pub fn new(line: L, lockstep: bool) -> Self {
        Self {
            line,
            sender: Sender::new(),
            receiver: Receiver::new(),
            outgoing: Vec::new(),
            telemetry: Telemetry::default(),
            learning: None,
            learned: (Vec::new(), 0),
            motors: None,
            refusals: Vec::new(),
            awaited: Vec::new(),
            model: None,
            lost: 0,
            failure: None,
            lockstep,
            stored: None,
        }
    }

    /// Asks the firmware who it is; the check sum of its model.
    ///
    /// # Errors
    /// If it does not answer.
    pub fn introduce(&mut self) -> Result<Option<u32>, PilError> {
        for _ in 0..3 {
            self.tell("who it is", &Command::Hello);
            self.talk(|board| board.model.is_some());
            if let Some(model) = self.model {
                return Ok(model);
            }
        }
        Err(self.failed("who it is"))
    }

    /// Prepares a flight: settings, lanes. The trajectory is uploaded by [`FlightStack::push_setpoint`].
    ///
    /// # Errors
    /// If the firmware refuses.
    pub fn prepare(&mut self, settings: &Settings, lanes: Option<Lanes>) -> Result<BoardFlight<'_, L>, PilError> {
        self.tell("disarm", &Command::Disarm);
        self.tell("settings", &Command::Settings(*settings));
        self.tell("lanes", &Command::Lanes(lanes.unwrap_or(Lanes::NONE)));
        self.talk(|board| board.awaited.is_empty());
        self.refused()?;
        if let Some((_, command)) = self.awaited.first() {
            return Err(PilError::Silence(command));
        }
        Ok(BoardFlight { divisor: settings.rates.position_divisor.max(1), next: 0, reference: Reference::default(), board: self })
    }

    /// Motors off after a flight, until another is [prepared](Board::prepare).
    ///
    /// # Errors
    /// If the firmware does not answer.
    pub fn disarm(&mut self) -> Result<(), PilError> {
        self.tell("disarm", &Command::Disarm);
        self.talk(|board| board.awaited.is_empty());
        self.refused()
    }

    /// What the firmware measured of itself, as it last told.
    pub fn figures(&self) -> Figures {
        let telemetry = &self.telemetry;
        Figures {
            deadline_misses: telemetry.deadline_misses,
            control_instructions_max: telemetry.control_max,
            inference_instructions_max: telemetry.inference_max,
            entry_instructions_max: telemetry.entry_latency_max,
            stack_bytes: telemetry.stack_bytes,
            late_inferences: telemetry.late_inferences,
            dropped: telemetry.frames.dropped + telemetry.frames.damaged + self.lost,
        }
    }

    /// The last telemetry report.
    pub fn telemetry(&self) -> &Telemetry {
        &self.telemetry
    }

    /// The line to the firmware.
    pub fn line(&self) -> &L {
        &self.line
    }

    /// Ends the firmware.
    pub fn end(mut self) {
        self.line.end();
    }

    /// Sends a piece of a model, as often as it takes to hear its outcome.
    pub(super) fn store(&mut self, piece: &Command<'_>) -> Result<Outcome, PilError> {
        // Answers to earlier pieces are of no interest.
        self.awaited.clear();
        for _ in 0..ATTEMPTS {
            self.refusals.clear();
            self.stored = None;
            // Ends whatever the line has invented.
            self.outgoing.push(0);
            self.tell(PIECE, piece);
            self.talk_until(|board| board.stored.is_some());
            if self.failure.is_some() {
                return Err(self.failed(PIECE));
            }
            match self.stored {
                // An answer to an earlier attempt is on its way, or comes again.
                None | Some(Outcome::Refused(Reason::Busy)) => {}
                Some(outcome) => return Ok(outcome),
            }
        }
        match self.stored {
            Some(Outcome::Refused(reason)) => Err(PilError::Refused { command: PIECE, reason }),
            _ => Err(PilError::Silence(PIECE)),
        }
    }

    pub(super) fn tell(&mut self, name: &'static str, command: &Command<'_>) {
        let mut frame = [0; FRAME];
        // Every command of this file fits into a frame.
        let Some((sequence, frame)) = self.sender.encode(command, &mut frame) else { return };
        self.outgoing.extend(frame);
        if !matches!(command, Command::Hello | Command::Inertial(_) | Command::Position(_) | Command::Setpoint(_)) {
            self.awaited.push((sequence, name));
        }
    }

    /// Sends what was told and hears until `done`, or until patience ends.
    pub(super) fn talk(&mut self, done: impl Fn(&Self) -> bool) {
        // A zero first: what was left on the line shall not cost a frame.
        let outgoing = std::mem::replace(&mut self.outgoing, vec![0]);
        let answer = self.line.exchange(&outgoing);
        self.on_bytes(answer);
        let start = Instant::now();
        while !self.lockstep && !done(self) && self.failure.is_none() && start.elapsed() < PATIENCE {
            let answer = self.line.wait(PATIENCE);
            self.on_bytes(answer);
        }
    }

    /// [`Board::talk`] of what a task of lower priority does: in lockstep, where each exchange is one tick, for some ticks.
    pub(super) fn talk_until(&mut self, done: impl Fn(&Self) -> bool) {
        self.talk(&done);
        for _ in 0..LOCKSTEP_WAIT {
            if done(self) || !self.lockstep {
                break;
            }
            self.talk(|_| true);
        }
    }

    fn on_bytes(&mut self, bytes: std::io::Result<Vec<u8>>) {
        let bytes = match bytes {
            Ok(bytes) => bytes,
            Err(error) => {
                self.failure.get_or_insert(error);
                return;
            }
        };
        for byte in bytes {
            match self.receiver.push(byte) {
                Some(Ok(received)) => match received.message {
                    Report::Motors(motors) => {
                        let [px, py, pz, vx, vy, vz] = motors.reference;
                        let reference =
                            Reference { position: Vector3::new(px, py, pz), velocity: Vector3::new(vx, vy, vz), yaw: 0.0 };
                        self.motors = Some((Tick(motors.tick), motors.command(), reference));
                    }
                    Report::Telemetry(telemetry) => self.telemetry = telemetry,
                    Report::Inputs(_) => {}
                    Report::Learning(learning) => self.learning = Some(learning),
                    Report::Learned(piece) => {
                        let (bytes, length) = &mut self.learned;
                        if piece.offset as usize == bytes.len() {
                            bytes.extend(piece.bytes);
                            *length = piece.length as usize;
                        }
                    }
                    Report::Identity(identity) => self.model = Some(identity.model.map(|model| model.checksum)),
                    Report::Acknowledge { sequence, outcome } => {
                        let place = self.awaited.iter().position(|(awaited, _)| *awaited == sequence);
                        let command = place.map_or("a command", |place| self.awaited.remove(place).1);
                        if command == PIECE {
                            self.stored = Some(outcome);
                        } else if let Outcome::Refused(reason) = outcome {
                            self.refusals.push((command, reason));
                        }
                    }
                },
                Some(Err(_)) => self.lost += 1,
                None => {}
            }
        }
    }

    pub(super) fn refused(&mut self) -> Result<(), PilError> {
        match self.refusals.pop() {
            Some((command, reason)) => Err(PilError::Refused { command, reason }),
            None => self.failure.take().map_or(Ok(()), |error| Err(PilError::Line(error, String::new()))),
        }
    }

    fn failed(&mut self, what: &'static str) -> PilError {
        self.failure.take().map_or(PilError::Silence(what), |error| PilError::Line(error, String::new()))
    }
}

/// One flight of a [`Board`].
pub struct BoardFlight<'b, L> {
    board: &'b mut Board<L>,
    divisor: u32,
    next: i32,
    reference: Reference,
}

impl<L: Line> FlightStack for BoardFlight<'_, L> {
    fn push_setpoint(&mut self, setpoint: &Setpoint) {
        self.board.tell("a setpoint", &Command::Setpoint(TimedSetpoint::new(self.next, setpoint)));
        self.next += 1;
        if self.board.outgoing.len() > QUEUE {
            self.flush();
        }
    }

    fn next_setpoint(&self) -> i32 {
        self.next
    }

    fn set_dither(&mut self, _: Vector3<f32>) {
        // Dithered flights are for identification, which is the host's.
    }

    fn step(&mut self, tick: Tick, state: &State) -> MotorCommand {
        if tick.0 == 0 {
            // The rest of the upload shall not be heard within the first tick.
            self.flush();
        }
        let board = &mut *self.board;
        if tick.0.is_multiple_of(self.divisor) {
            board.tell("the position", &Command::Position(Position::new(tick, state)));
        }
        if tick.0 == 0 {
            // Armed between two attitudes: the second one is that of tick 0, however the line groups them.
            board.tell("the attitude", &Command::Inertial(Inertial::new(Tick(u32::MAX), state)));
            board.tell("arm", &Command::Arm);
        }
        board.tell("the attitude", &Command::Inertial(Inertial::new(tick, state)));
        board.motors = None;
        board.talk(|board| board.motors.is_some_and(|(answered, ..)| answered == tick));
        match board.motors {
            Some((_, command, reference)) => {
                self.reference = Reference { yaw: self.reference.yaw, ..reference };
                command
            }
            // Disarmed, or the report was lost.
            None => MotorCommand::OFF,
        }
    }

    fn reference(&self) -> &Reference {
        &self.reference
    }

    /// Of all flights since the start.
    fn trips(&mut self) -> Trips {
        let lane = |lane: &LaneReport| lane.trips.first_chunk().copied().unwrap_or_default();
        let telemetry = &self.board.telemetry;
        Trips { network: lane(&telemetry.network), feedback: lane(&telemetry.feedback) }
    }
}

impl<L: Line> BoardFlight<'_, L> {
    /// Sends what was told, and waits for an answer: it says that the firmware's queue is empty again.
    fn flush(&mut self) {
        self.board.model = None;
        self.board.tell("who it is", &Command::Hello);
        self.board.talk(|board| board.model.is_some());
        if self.board.lockstep {
            // To hear a thousand bytes takes longer than a tick: the ticks that are behind catch up.
            for _ in 0..CATCH_UP {
                self.board.talk(|_| true);
            }
        }
    }

    /// What went wrong in the flight.
    ///
    /// # Errors
    /// If a command was refused or the line broke.
    pub fn check(&mut self) -> Result<(), PilError> {
        self.board.refused()
    }
}
