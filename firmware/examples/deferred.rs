//! The network in a task of lower priority: `cargo run -p impromptu-firmware --example deferred`.
//!
//! The control task hands the features over and goes on; while the loop waits for its next tick, the other task evaluates the
//! network; the control task takes the result at that tick. In time it makes no difference, to the bit: the correction is ramped,
//! and a ramp starts where the last one ended. Here both tasks are functions, called in turns that are easy to follow;
//! `firmware/board/examples` has them as tasks of RTIC and embassy.

#[path = "one_axis/servo.rs"]
pub(crate) mod servo;

use std::error::Error;

use impromptu_firmware::{
    AddOn,
    adapter::{Inference, Job, Lanes},
    add_on::Report,
    exchange::Mailbox,
    model::{DEFAULT_OUTPUTS, MAX_FEATURES, Model},
    network::{Network, Scratch},
};
use servo::{CAPS, RATE_HZ, SIGNALS, Servo, TrackingError, desired};

/// What training left.
const MODEL: &[u8] = include_bytes!("one_axis.impromptu");
/// Ticks of a flight: 20 s.
const TICKS: i32 = 20 * RATE_HZ as i32;

/// Between the tasks: the newest job, and the newest result. No lock, no wait.
static JOBS: Mailbox<MAX_FEATURES> = Mailbox::new();
static INFERENCES: Mailbox<DEFAULT_OUTPUTS> = Mailbox::new();

/// The control task, which is never late.
struct Control<'m> {
    add_on: AddOn<'m, 1, 1, 1, 128>,
    servo: Servo,
    error: TrackingError,
}

impl Control<'_> {
    /// One tick of the loop.
    fn tick(&mut self, tick: i32) {
        let measured = [self.servo.angle()];
        if let Some((released, outputs)) = INFERENCES.take_floats() {
            self.add_on.deliver(Inference { tick: released as i32, outputs });
        }
        if let Some(job) = self.add_on.begin(tick, &measured) {
            JOBS.put_floats(job.tick as u32, &job.inputs);
        }
        let [reference] = self.add_on.finish(tick, &measured);
        self.error.add(self.servo.angle(), desired(tick));
        self.servo.track(reference);
    }
}

/// The task of lower priority: does the job that waits.
fn infer(network: &Network<'_>, scratch: &mut Scratch) {
    if let Some((released, inputs)) = JOBS.take_floats() {
        let Inference { tick, outputs } = Job { tick: released as i32, inputs }.run(network, scratch);
        INFERENCES.put_floats(tick as u32, &outputs);
    }
}

/// Follows the trajectory; the task of lower priority gets the processor after the ticks that are `free`.
pub(crate) fn fly(free: impl Fn(i32) -> bool) -> Result<(TrackingError, Report), Box<dyn Error>> {
    let model = Model::from_bytes(MODEL)?;
    let network = model.network().ok_or("the model has no network")?;
    let ahead = model.card().preview_span().1 as i32;
    let add_on = AddOn::new(&model, SIGNALS, RATE_HZ, &CAPS)?;
    let mut control = Control { add_on, servo: Servo::new(), error: TrackingError::new() };
    control.add_on.defer();
    control.add_on.switch(Lanes::BOTH);
    let mut scratch = Scratch::new();
    for tick in 0..TICKS {
        while control.add_on.next_tick() <= tick + ahead {
            control.add_on.push([desired(control.add_on.next_tick())])?;
        }
        control.tick(tick);
        if free(tick) {
            infer(network, &mut scratch);
        }
    }
    Ok((control.error, control.add_on.report()))
}

/// Says after which ticks the task of lower priority gets the processor.
pub(crate) type Free = fn(i32) -> bool;

/// Schedules, by name.
pub(crate) const SCHEDULES: [(&str, Free); 2] =
    [("after each tick", |_| true), ("not at all from 8 s to 9 s", |tick| !(4_000..4_500).contains(&tick))];

/// Prints the errors, and how many results came too late.
pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    for (name, free) in SCHEDULES {
        let (error, report) = fly(free)?;
        let [mean, largest] = error.degrees();
        println!("network evaluated {name}: {mean:.3} degrees RMS, {largest:.2} at most, {} inferences late", report.late);
    }
    Ok(())
}
