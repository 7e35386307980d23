//! What the tasks of a board do; which interrupt runs them is the board's affair.
//!
//! *in* bytes, control ticks, jobs, pieces of models; *out* motor commands, and which task of lower priority has something to do;
//! *never* a wait for a task of lower priority: everything between them goes through mailboxes.

use core::{
    hint::black_box,
    sync::atomic::{AtomicU32, Ordering},
};

use impromptu_firmware::{
    adapter::{Inference, Job},
    exchange::Mailbox,
    model::{DEFAULT_OUTPUTS, MAX_FEATURES},
    network::{Network, Scratch},
    storage::{Arming, Journal, Slot, Uploader},
};
use impromptu_flight::{
    application::{Application, Upload, WORDS, outcome_from_words, outcome_words},
    autopilot::{Learns, Meters},
    learning::KEPT,
    link::{Outcome, Reason},
    types::MotorCommand,
};

use crate::start::fits;

/// Measures what a task costs, in instructions or cycles.
pub trait Cost {
    /// The reading now.
    fn now(&self) -> u32;

    /// What was spent since a reading.
    fn since(&self, start: u32) -> u32;

    /// Result of `stage` and what it cost.
    ///
    /// Without the black boxes the compiler may move arithmetic out of the stage, across the readings.
    #[inline(always)]
    fn measure<R>(&self, stage: impl FnOnce() -> R) -> (R, u32) {
        let start = self.now();
        let result = black_box(stage)();
        // By reference: a large result shall not be copied within the stage.
        black_box(&result);
        (result, self.since(start))
    }
}

/// The hand-over between the tasks, in a static. Each method belongs to one task.
#[derive(Debug)]
pub struct Tasks {
    jobs: Mailbox<MAX_FEATURES>,
    inferences: Mailbox<DEFAULT_OUTPUTS>,
    uploads: Mailbox<WORDS>,
    outcomes: Mailbox<2>,
    /// Cost of the control task so far, which interrupts the inference; the largest inference without it.
    control_total: AtomicU32,
    inference_max: AtomicU32,
    /// Bytes of the stack that were ever used.
    stack: AtomicU32,
}

/// What was learned, on its way from the control task to the storage task: of a board whose vehicle has a learner, in a static.
#[derive(Debug)]
pub struct Keeping(Mailbox<KEPT_WORDS>);

impl Keeping {
    /// Nothing to keep.
    pub const fn new() -> Self {
        Self(Mailbox::new())
    }

    // Apart from the flight, as `on_bytes`.
    #[inline(never)]
    fn put(&self, application: &mut Application<'_, impl Learns>) -> bool {
        let mut bytes = [0; KEPT];
        let Some(sequence) = application.take_learned(&mut bytes) else { return false };
        self.0.put_from(sequence.into(), bytes.as_chunks().0.iter().map(|bytes| u32::from_le_bytes(*bytes)));
        true
    }
}

impl Default for Keeping {
    fn default() -> Self {
        Self::new()
    }
}

const KEPT_WORDS: usize = KEPT / 4;
const _: () = assert!(KEPT.is_multiple_of(4));

/// What a tick of the control task leaves to do.
#[derive(Clone, Copy, Debug)]
pub struct Tick {
    /// What the motors get.
    pub command: MotorCommand,
    /// The inference has a job.
    pub job: bool,
    /// Cost of the tick.
    pub cost: u32,
}

impl Tasks {
    /// Nothing to do.
    pub const fn new() -> Self {
        Self {
            jobs: Mailbox::new(),
            inferences: Mailbox::new(),
            uploads: Mailbox::new(),
            outcomes: Mailbox::new(),
            control_total: AtomicU32::new(0),
            inference_max: AtomicU32::new(0),
            stack: AtomicU32::new(0),
        }
    }

    /// Control: takes bytes of the link; whether the storage has a piece to store.
    // Apart from the flight, which needs none of its stack.
    #[inline(never)]
    pub fn on_bytes(&self, application: &mut Application<'_, impl Learns>, bytes: &[u8]) -> bool {
        let mut piece = false;
        for byte in bytes {
            if let Some(upload) = application.on_byte(*byte) {
                self.post(&upload);
                piece = true;
            }
        }
        piece
    }

    /// Apart from the commands, which need none of its stack.
    #[inline(never)]
    fn post(&self, upload: &Upload) {
        self.uploads.put(0, upload.words());
    }

    /// Control: flies a tick; `received` is what taking its bytes cost.
    #[inline(never)]
    pub fn fly(
        &self,
        application: &mut Application<'_, impl Learns>,
        meters: &mut Meters,
        counter: &impl Cost,
        received: u32,
    ) -> Tick {
        // With the first tick of a flight comes its trajectory.
        let flying = application.autopilot().in_flight();
        let mut job = Job::EMPTY;
        let ((command, released), flown) = counter.measure(|| {
            if let Some((tick, outputs)) = self.inferences.take_floats() {
                application.deliver(Inference { tick: tick as i32, outputs });
            }
            self.acknowledge(application);
            let (command, released) = application.step(meters, &mut job);
            if released {
                self.jobs.put_floats(job.tick as u32, &job.inputs);
            }
            (command, released)
        });
        let cost = received.saturating_add(flown);
        if flying {
            meters.control_max = meters.control_max.max(cost);
        }
        meters.inference_max = self.inference_max.load(Ordering::Relaxed);
        meters.stack_bytes = self.stack.load(Ordering::Relaxed);
        self.control_total.fetch_add(cost, Ordering::Relaxed);
        Tick { command, job: released, cost }
    }

    /// Control: tells what became of a piece. Apart from the flight, as [`Tasks::on_bytes`].
    #[inline(never)]
    fn acknowledge(&self, application: &mut Application<'_, impl Learns>) {
        if let Some((sequence, words)) = self.outcomes.take()
            && let Some(outcome) = outcome_from_words(words)
        {
            application.acknowledge(sequence as u8, outcome);
        }
    }

    /// Inference: does the job that waits.
    #[inline]
    pub fn infer(&self, network: Option<&Network<'_>>, scratch: &mut Scratch, counter: &impl Cost) {
        let Some(network) = network else { return };
        let Some((tick, inputs)) = self.jobs.take_floats() else { return };
        let interrupted = self.control_total.load(Ordering::Relaxed);
        let ((), cost) = counter.measure(|| {
            let Inference { tick, outputs } = Job { tick: tick as i32, inputs }.run(network, scratch);
            self.inferences.put_floats(tick as u32, &outputs);
        });
        let interrupted = self.control_total.load(Ordering::Relaxed).wrapping_sub(interrupted);
        self.inference_max.fetch_max(cost.saturating_sub(interrupted), Ordering::Relaxed);
    }

    /// Storage: stores the piece that waits.
    #[inline]
    pub fn store<S: Slot>(&self, uploader: &mut Uploader<S>, scratch: &mut Scratch) {
        // Where it was put, not moved: it is large.
        let piece = self.piece();
        let Some(upload) = &piece else { return };
        let outcome = upload.carry_out(uploader, scratch, fits);
        self.outcomes.put(upload.sequence.into(), &outcome_words(&outcome));
    }

    /// Control: hands over what was learned, if it is to be kept: `true`.
    pub fn keep(&self, application: &mut Application<'_, impl Learns>, keeping: &Keeping) -> bool {
        application.keeps_learned() && keeping.put(application)
    }

    /// Storage: keeps what was learned, if it waits.
    #[inline(never)]
    pub fn store_learned<S: Slot>(&self, journal: &mut Journal<S, KEPT>, keeping: &Keeping) {
        let mut words = [0; KEPT_WORDS];
        let Some(sequence) = keeping.0.take_into(&mut words) else { return };
        let bytes = words.iter().flat_map(|word| word.to_le_bytes());
        let outcome = match journal.append(Arming::Disarmed, bytes) {
            Ok(()) => Outcome::Done,
            Err(_) => Outcome::Refused(Reason::Storage),
        };
        self.outcomes.put(sequence, &outcome_words(&outcome));
    }

    /// Apart, so that it is on the stack once.
    #[inline(never)]
    fn piece(&self) -> Option<Upload> {
        self.uploads.take().map(|(_, words)| Upload::from_words(words))
    }

    /// Idle: the high-water mark of the stack.
    pub fn report_stack(&self, bytes: u32) {
        self.stack.store(bytes, Ordering::Relaxed);
    }
}

impl Default for Tasks {
    fn default() -> Self {
        Self::new()
    }
}
