//! The autopilot behind its serial line: bytes in, bytes out, one step at each control tick.
//!
//! *in* bytes as they come, control ticks, results of the tasks of lower priority; *out* motor commands, jobs for those tasks,
//! bytes to be sent; *never* a wait, or more work in a tick than the bytes it is given and one step.

mod upload;

use heapless::Vec;
use impromptu_firmware::adapter::{Inference, Job};

use crate::{
    autopilot::{Autopilot, Learns, Meters, NoLearner, Reaction},
    learning::KEPT,
    link::{
        CHUNK, Command, Commands, FRAME, Fault, Message, Order, Outcome, Reason, Received, Receiver, Report, Sender,
        message::{FrameReport, LearnOrder, LearnedPiece},
    },
    types::MotorCommand,
};

pub use upload::{Upload, WORDS, outcome_from_words, outcome_words};

/// Bytes that can wait to be sent: what a tick sends at most, and some acknowledgements.
pub const OUTBOX: usize = FRAME + FRAME / 2;
/// Control ticks from one telemetry report to the next.
const TELEMETRY_TICKS: u8 = 50;

/// Name and version of this firmware.
pub const SOFTWARE: &str = concat!("impromptu ", env!("CARGO_PKG_VERSION"));

/// An autopilot that talks.
#[derive(Debug)]
pub struct Application<'m, L = NoLearner> {
    autopilot: Autopilot<'m, L>,
    receiver: Receiver<Commands>,
    tx: TxQueue,
    /// Control ticks since the last telemetry report.
    telemetry: u8,
    storing: Storing,
}

/// Whether a model, or what was learned, is on its way into the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Storing {
    /// It is not.
    No,
    /// A task of lower priority has a piece in work.
    Piece,
    /// It has the last one in work.
    Last,
    /// A new model flies from the next start on.
    Stored,
    /// What was learned waits for [`Application::take_learned`], with the sequence number of the command to keep it.
    Learned(u8),
}

/// Messages to bytes that wait to be sent.
#[derive(Debug)]
struct TxQueue {
    sender: Sender,
    outbox: Vec<u8, OUTBOX>,
}

impl TxQueue {
    /// A message for which there is no room is dropped: the line is slower than the reports, and the next one tells more.
    fn send(&mut self, message: &impl Message) {
        let waiting = self.outbox.len();
        // It is encoded where it waits.
        let _ = self.outbox.resize_default(OUTBOX.min(waiting.saturating_add(FRAME)));
        let place = self.outbox.get_mut(waiting..).unwrap_or_default();
        let length = match self.sender.encode(message, place) {
            Some((_, frame)) => frame.len(),
            None => {
                self.sender.skip();
                0
            }
        };
        self.outbox.truncate(waiting.saturating_add(length));
    }

    // Apart from the commands, which need none of a report's stack.
    #[inline(never)]
    fn acknowledge(&mut self, sequence: u8, outcome: Outcome) {
        self.send(&Report::Acknowledge { sequence, outcome });
    }
}

#[inline(never)]
fn introduce(tx: &mut TxQueue, autopilot: &Autopilot<'_, impl Learns>) {
    tx.send(&Report::Identity(autopilot.identity(SOFTWARE)));
}

// As `introduce`.
#[inline(never)]
fn tell_learned(tx: &mut TxQueue, autopilot: &Autopilot<'_, impl Learns>, offset: u32) {
    let mut bytes = [0; KEPT];
    let Some(learned) = autopilot.keep(&mut bytes) else { return };
    let rest = learned.get(offset as usize..).unwrap_or_default();
    let bytes = rest.get(..CHUNK).unwrap_or(rest);
    tx.send(&Report::Learned(LearnedPiece { length: learned.len() as u32, offset, bytes }));
}

impl Default for Application<'_> {
    fn default() -> Self {
        Self::new()
    }
}

impl Application<'_> {
    /// An application that has received and sent nothing.
    pub const fn new() -> Self {
        Self::with(NoLearner)
    }
}

impl<'m, L: Learns> Application<'m, L> {
    /// [`Application::new`] whose vehicle learns with this.
    pub const fn with(learner: L) -> Self {
        Self {
            autopilot: Autopilot::with(learner),
            receiver: Receiver::new(),
            tx: TxQueue { sender: Sender::new(), outbox: Vec::new() },
            telemetry: 0,
            storing: Storing::No,
        }
    }

    /// The vehicle.
    pub fn autopilot(&mut self) -> &mut Autopilot<'m, L> {
        &mut self.autopilot
    }

    /// Takes a byte from the line. A command that concerns the flash is for a task which may wait; its outcome is for
    /// [`Application::acknowledge`].
    pub fn on_byte(&mut self, byte: u8) -> Option<Upload> {
        let Self { autopilot, receiver, tx, storing, .. } = self;
        let (sequence, outcome) = match receiver.push(byte)? {
            Ok(Received { sequence, order, message }) => {
                let in_work = !matches!(storing, Storing::No | Storing::Stored);
                if Upload::is_made_of(&message) && order != Order::Late {
                    let reason = if autopilot.armed() {
                        Reason::Armed
                    } else if in_work {
                        Reason::Busy
                    } else {
                        if *storing == Storing::No {
                            *storing = if matches!(message, Command::ModelCommit) { Storing::Last } else { Storing::Piece };
                        }
                        // Made last of all: it is large, and the stack holds it once.
                        return Upload::new(sequence, &message);
                    };
                    (sequence, Outcome::Refused(reason))
                } else if matches!(message, Command::Learn(LearnOrder::Keep)) && order != Order::Late {
                    match autopilot.keeps() {
                        Ok(()) if *storing != Storing::No => (sequence, Outcome::Refused(Reason::Busy)),
                        Ok(()) => {
                            *storing = Storing::Learned(sequence);
                            return None;
                        }
                        Err(reason) => (sequence, Outcome::Refused(reason)),
                    }
                } else if *storing != Storing::No && matches!(message, Command::Arm) && order != Order::Late {
                    // The core stands still while the flash is erased.
                    (sequence, Outcome::Refused(Reason::Busy))
                } else {
                    match autopilot.carry_out(&Received { sequence, order, message }) {
                        Reaction::Silence => return None,
                        Reaction::Introduce => {
                            introduce(tx, autopilot);
                            return None;
                        }
                        Reaction::TellLearned(offset) => {
                            tell_learned(tx, autopilot, offset);
                            return None;
                        }
                        Reaction::Acknowledge(outcome) => (sequence, outcome),
                    }
                }
            }
            Err(Fault::Message { sequence, reason }) => (sequence, Outcome::Refused(reason)),
            Err(_) => return None,
        };
        tx.acknowledge(sequence, outcome);
        None
    }

    /// Writes what was learned, if there is a command to keep it, and gives its sequence number, once: for a task that may wait
    /// for the flash, and whose outcome is for [`Application::acknowledge`]. A board whose vehicle learns asks in every control
    /// tick.
    pub fn take_learned(&mut self, bytes: &mut [u8; KEPT]) -> Option<u8> {
        let Storing::Learned(sequence) = self.storing else { return None };
        self.storing = Storing::Piece;
        if self.autopilot.keep(bytes).is_none() {
            self.acknowledge(sequence, Outcome::Refused(Reason::NoLearner));
            return None;
        }
        Some(sequence)
    }

    /// Tells the sender what became of a command that a task of lower priority carried out.
    pub fn acknowledge(&mut self, sequence: u8, outcome: Outcome) {
        self.storing = match (self.storing, outcome) {
            (Storing::Stored, _) | (Storing::Last, Outcome::Done) => Storing::Stored,
            _ => Storing::No,
        };
        self.tx.acknowledge(sequence, outcome);
    }

    /// Whether a task of lower priority has a piece of a model in work, so that the core may stand still for seconds.
    pub fn storing(&self) -> bool {
        !matches!(self.storing, Storing::No | Storing::Stored)
    }

    /// Whether what was learned waits for [`Application::take_learned`].
    pub fn keeps_learned(&self) -> bool {
        matches!(self.storing, Storing::Learned(_))
    }

    /// Whether a new model waits to be flown from the next start on. Until then the vehicle is not armed.
    pub fn restart_due(&self) -> bool {
        self.storing == Storing::Stored
    }

    /// Whether a new attitude came since the last tick.
    pub fn informed(&self) -> bool {
        self.autopilot.informed()
    }

    /// Takes what came of a job.
    pub fn deliver(&mut self, inference: Inference) {
        self.autopilot.deliver(inference);
    }

    /// One control tick; whether it leaves a job.
    pub fn step(&mut self, meters: &Meters, job: &mut Job) -> (MotorCommand, bool) {
        let flew = self.autopilot.armed();
        let (command, released) = self.autopilot.step(job);
        self.report(meters, flew.then_some(&command));
        (command, released)
    }

    // Apart from the flight, which needs none of a report's stack.
    #[inline(never)]
    fn report(&mut self, meters: &Meters, flown: Option<&MotorCommand>) {
        if let Some(command) = flown {
            self.tx.send(&Report::Motors(self.autopilot.motors(command)));
        }
        self.telemetry = self.telemetry.saturating_add(1);
        if self.telemetry >= TELEMETRY_TICKS {
            self.telemetry = 0;
            let frames = self.frames();
            self.tx.send(&Report::Telemetry(self.autopilot.telemetry(meters, frames)));
            self.tx.send(&Report::Inputs(self.autopilot.inputs()));
            if let Some(learning) = self.autopilot.learning() {
                self.tx.send(&Report::Learning(learning));
            }
        }
    }

    /// The bytes that wait to be sent.
    pub fn outbox(&self) -> &[u8] {
        &self.tx.outbox
    }

    /// Forgets the bytes that waited: they are sent.
    pub fn sent(&mut self) {
        self.tx.outbox.clear();
    }

    fn frames(&self) -> FrameReport {
        self.receiver.counts().report()
    }
}

#[cfg(test)]
mod tests;
