//! The adapter alone, with as many channels as its signal table has at run time.
//!
//! *in* desired and measured channels, counted; *out* reference channels; *never* other bits than those of an adapter whose arrays have just these
//! channels; *source* [`impromptu_firmware::adapter`].

use impromptu_firmware::{
    adapter::{Adapter, Inference, Job, Lanes},
    model,
    network::Scratch,
    preview::{EndRule, Preview},
};

use crate::{
    status::Status,
    values::{MAX_CHANNELS, PREVIEW, Report},
};

/// As many numbers as a signal can have; those behind its channels are zero.
pub type Channels = [f32; MAX_CHANNELS];

/// An adapter and the trajectory ahead of it.
#[derive(Debug)]
pub struct Stage {
    pub(crate) adapter: Adapter<'static, MAX_CHANNELS, MAX_CHANNELS, MAX_CHANNELS>,
    pub(crate) preview: Preview<MAX_CHANNELS, PREVIEW>,
    pub(crate) layout: Layout,
}

/// What the signal table says of the arrays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    pub(crate) rules: [EndRule; MAX_CHANNELS],
    counts: [usize; 3],
}

impl Layout {
    /// Of the application's table.
    pub(crate) fn new(table: &model::Channels<'_>) -> Self {
        let mut rules = [EndRule::Hold; MAX_CHANNELS];
        for (rule, channel) in rules.iter_mut().zip(table.desired) {
            *rule = channel.end;
        }
        Self { rules, counts: [table.desired.len(), table.measured.len(), table.reference.len()] }
    }
}

/// A preview without a sample, and an adapter without a model: all zeros, so that they are written in place.
pub(crate) const EMPTY: Preview<MAX_CHANNELS, PREVIEW> = Preview::new([EndRule::Hold; MAX_CHANNELS], 0);
pub(crate) const PARKED: Adapter<'static, MAX_CHANNELS, MAX_CHANNELS, MAX_CHANNELS> = Adapter::empty();

impl Stage {
    /// Whether these are the counts of desired, measured and reference channels; `None` is not asked.
    ///
    /// # Errors
    /// If one differs.
    pub fn counted(&self, counts: [Option<usize>; 3]) -> Result<(), Status> {
        let same = self.layout.counts.iter().zip(counts).all(|(own, given)| given.is_none_or(|given| given == *own));
        same.then_some(()).ok_or(Status::Count)
    }

    /// Appends the sample of the next reference tick.
    ///
    /// # Errors
    /// If a number is not finite; then nothing is stored.
    pub fn push(&mut self, desired: Channels) -> Result<(), Status> {
        if !desired.iter().all(|value| value.is_finite()) {
            return Err(Status::NotFinite);
        }
        self.preview.push(desired);
        Ok(())
    }

    /// Forgets the trajectory: the next sample is that of `first_tick`.
    pub fn restart(&mut self, first_tick: i32) {
        self.preview.restart(self.layout.rules, first_tick);
    }

    /// Switches lanes.
    pub fn switch(&mut self, lanes: Lanes) {
        self.adapter.switch(lanes);
    }

    /// Gives inferences time until the next reference tick.
    pub fn defer(&mut self) {
        self.adapter.defer();
    }

    /// A whole reference tick.
    pub fn step(&mut self, tick: i32, measured: &Channels, scratch: &mut Scratch) -> Channels {
        self.adapter.step(tick, &self.preview, measured, scratch)
    }

    /// First part of a reference tick.
    pub fn begin(&mut self, tick: i32, measured: &Channels) -> Option<Job> {
        self.adapter.begin(tick, &self.preview, measured)
    }

    /// Takes the result of a job.
    pub fn deliver(&mut self, inference: Inference) {
        self.adapter.deliver(inference);
    }

    /// Second part of a reference tick.
    pub fn finish(&mut self, tick: i32, measured: &Channels) -> Channels {
        self.adapter.finish(tick, &self.preview, measured)
    }

    /// What was done.
    pub fn report(&self) -> Report {
        Report::new(&self.adapter, self.preview.next_tick())
    }
}
