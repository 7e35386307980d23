//! The add-on: corrects the references of any stable loop.
//!
//! *in* desired channels (pushed ahead of time) and measured channels, at every reference tick; *out* the reference channels;
//! *never* a correction beyond the model's limits and slew, never any change of the desired reference when both lanes are off, be
//! it by the user or by the [guard](crate::guard); *source* Zhou 2017, Fig. 1. What differs: the correction is ramped between
//! sub-rate ticks, and a feedback lane adds to it.

mod correction;
mod fade;
mod feedback;
mod inference;
mod ramp;
mod signals;

use crate::{
    features,
    format::{Card, Channels, EndRule, Interpolation, MAX_AXES, MAX_FEATURES, MAX_OUTPUTS, Refusal},
    guard::{Features, Guard, GuardSettings, Observation, Outcome, Trips, Verdict, finite},
    math::finite_or_zero,
    model::Model,
    network::Scratch,
    preview::Preview,
};
use correction::{Correction, Wanted};
use fade::Fade;
use feedback::Feedback;
pub use inference::{Inference, Job};
use ramp::Ramp;
use signals::{History, View, base_channels, same_signals, whole_signals};

pub use crate::{format::HISTORY, lanes::Lanes};

/// Adapter for a loop with `D` desired, `M` measured and `R` reference channels.
///
/// A reference tick is [`Adapter::begin`] and [`Adapter::finish`]. At a sub-rate tick the first gives the [`Job`] of evaluating
/// the network, whose [`Inference`] is [delivered](Adapter::deliver): between the two ([`Adapter::step`] does it all), or, by a
/// task that the control loop interrupts, until the next reference tick ([`Adapter::defer`]).
#[derive(Debug)]
pub struct Adapter<'m, const D: usize, const M: usize, const R: usize> {
    model: Option<&'m Model<'m>>,
    guard: Guard,
    /// Desired channel from which each reference channel starts.
    base: [usize; R],
    measured: History<M>,
    references: History<R>,
    ramp: Ramp,
    /// Whether an inference may take up to the next reference tick.
    deferred: bool,
    feedback: Feedback,
    /// Lanes that are wanted.
    lanes: Lanes,
    /// How far each lane is faded in, 0..=1.
    network_weight: f32,
    feedback_weight: f32,
    correction: Correction,
    /// What the guard is shown at the next tick: what the lanes did in this one,
    outcome: Outcome,
    /// whether a lane was wanted or acted, so that it counts,
    acted: bool,
    /// the features since then,
    features: Features,
    /// and how old the newest measurement is, reference ticks.
    age: u16,
}

impl<'m, const D: usize, const M: usize, const R: usize> Adapter<'m, D, M, R> {
    /// An adapter without a model, which corrects nothing: all zeros. It is 6 KB large, so a microcontroller has it in a static,
    /// or in something that is one, and [loads](Adapter::load) it there.
    pub const fn empty() -> Self {
        Self {
            model: None,
            guard: Guard::EMPTY,
            base: [0; R],
            measured: History::new([EndRule::Hold; M], 0),
            references: History::new([EndRule::Hold; R], 0),
            ramp: Ramp::EMPTY,
            deferred: false,
            feedback: Feedback::EMPTY,
            lanes: Lanes::NONE,
            network_weight: 0.0,
            feedback_weight: 0.0,
            correction: Correction::NONE,
            outcome: Outcome::NONE,
            acted: false,
            features: Features::Unchanged,
            age: 0,
        }
    }

    /// Loads a model into an application whose signals are `table`, whose references run at `rate_hz` and whose preview keeps
    /// `capacity` samples. Both lanes are off.
    ///
    /// # Errors
    /// If signals, rate or preview length do not fit.
    pub fn new<'t>(model: &'m Model<'m>, table: impl Into<Channels<'t>>, rate_hz: f32, capacity: usize) -> Result<Self, Refusal> {
        let table = table.into();
        Self::check(model, &table, rate_hz, capacity)?;
        let mut adapter = Self::empty();
        adapter.load(model, &table);
        Ok(adapter)
    }

    /// Whether [`Adapter::new`] takes a model.
    ///
    /// # Errors
    /// As [`Adapter::new`].
    pub fn check(model: &Model<'_>, table: &Channels<'_>, rate_hz: f32, capacity: usize) -> Result<(), Refusal> {
        let card = model.card();
        same_signals(card, table, [D, M, R])?;
        let rate = card.timing.reference_rate_hz;
        let near = (rate - rate_hz).abs() <= 1e-3 * rate_hz;
        if !near {
            return Err(Refusal::Rate { model: rate, application: rate_hz });
        }
        let (past, future) = card.preview_span();
        if past + future + 1 > capacity as u32 {
            return Err(Refusal::Preview { needed: past + future + 1, available: capacity as u32 });
        }
        Ok(())
    }

    /// Makes this, in its place, what [`Adapter::new`] makes of a model that passes [`Adapter::check`]. With another one it is as
    /// safe, and of no use.
    pub fn load(&mut self, model: &'m Model<'m>, table: &Channels<'_>) {
        self.model = Some(model);
        self.guard.load(GuardSettings::default(), model.card().timing.reference_rate_hz);
        self.base = base_channels(table);
        self.deferred = false;
        self.restart();
    }

    /// Takes the model away, in place: from now on the reference is the desired one of an application whose signals are `table`.
    ///
    /// # Errors
    /// If a signal has too many channels, or a reference channel the name of no desired one; then nothing changes.
    pub fn bypass(&mut self, table: &Channels<'_>) -> Result<(), Refusal> {
        whole_signals(table, [D, M, R])?;
        self.model = None;
        self.base = base_channels(table);
        self.restart();
        Ok(())
    }

    /// Forgets everything but the model and its guard's settings, also the counts: as it was when the model came. Both lanes are
    /// off.
    pub fn restart(&mut self) {
        self.reset();
        self.ramp = Ramp::EMPTY;
        self.correction = Correction::NONE;
        self.guard.restart();
        self.switch(Lanes::NONE);
    }

    /// Forgets everything but the lanes that are wanted and the counts: the next tick is the first one.
    pub fn reset(&mut self) {
        // No sub-rate tick is that low: the first one that is seen starts the histories.
        self.measured.restart([EndRule::Hold; M], 0);
        self.references.restart([EndRule::Hold; R], i32::MIN);
        self.ramp.clear();
        self.feedback.reset();
        (self.network_weight, self.feedback_weight) = (0.0, 0.0);
        self.correction.values = [0.0; MAX_OUTPUTS];
        (self.acted, self.features, self.age) = (false, Features::Unchanged, 0);
        self.guard.reset();
    }

    /// The model that is flown.
    pub fn model(&self) -> Option<&'m Model<'m>> {
        self.model
    }

    /// Switches lanes; they are faded in and out over the model's fade time.
    pub fn switch(&mut self, lanes: Lanes) {
        self.lanes = lanes;
        self.guard.switched(lanes);
    }

    /// Which lanes the guard lets act, and its counterfactual monitor.
    pub fn guard(&self) -> Option<&Guard> {
        self.model.map(|_| &self.guard)
    }

    /// The guard's trips since the model came, or [`Adapter::restart`].
    pub fn trips(&self) -> Trips {
        self.guard.trips()
    }

    /// Sets the guard, which is on with [`GuardSettings::default`] from the start.
    pub fn set_guard(&mut self, settings: GuardSettings) {
        self.guard.set(settings);
    }

    /// Lets lanes act again that the guard has locked out.
    pub fn rearm(&mut self) {
        self.guard.rearm();
    }

    /// Tells how many reference ticks ago the newest measurement arrived; 0 from the start.
    pub fn set_age(&mut self, ticks: u16) {
        self.age = ticks;
    }

    /// Correction of each output of the model in the last tick.
    pub fn correction(&self) -> &[f32; MAX_OUTPUTS] {
        &self.correction.values
    }

    /// How far the network lane and the feedback lane are faded in, 0..=1.
    pub fn weights(&self) -> [f32; 2] {
        [self.network_weight, self.feedback_weight]
    }

    /// Ticks in which a limit or the slew bounded the correction.
    pub fn saturations(&self) -> u32 {
        self.correction.saturations
    }

    /// Gives inferences time until the next reference tick. A ramped correction is the same as before: it starts from what was
    /// evaluated a sub-rate tick ago. A held one comes a reference tick later.
    pub fn defer(&mut self) {
        self.deferred = true;
    }

    /// Inferences that did not come in time. The correction then stays as it is and fades out until one does.
    pub fn late(&self) -> u32 {
        self.ramp.late()
    }

    /// One reference tick with all that belongs to it: the reference that the loop shall track. `preview` should reach
    /// [`crate::format::Card::preview_span`]'s future ahead; what is missing is taken as the trajectory's end. The scratch needs
    /// [`crate::network::Network::scratch_words`].
    pub fn step<const N: usize, const S: usize>(
        &mut self,
        tick: i32,
        preview: &Preview<D, N>,
        measured: &[f32; M],
        scratch: &mut Scratch<S>,
    ) -> [f32; R] {
        if let Some(job) = self.begin(tick, preview, measured)
            && let Some(network) = self.model().and_then(Model::network)
        {
            self.deliver(job.run(network, scratch));
        }
        self.finish(tick, preview, measured)
    }

    /// First part of a reference tick: takes the inference that is due, remembers what was measured and, at a sub-rate tick of
    /// the network lane, gives the job of evaluating the network.
    pub fn begin<const N: usize>(&mut self, tick: i32, preview: &Preview<D, N>, measured: &[f32; M]) -> Option<Job> {
        let mut job = Job::EMPTY;
        self.begin_into(tick, preview, measured, &mut job).then_some(job)
    }

    /// [`Adapter::begin`] that puts the job, if there is one, where the caller has room for it: `true`.
    pub fn begin_into<const N: usize>(&mut self, tick: i32, preview: &Preview<D, N>, measured: &[f32; M], job: &mut Job) -> bool {
        // A ramp ends where the inference of its start says, which is needed from the next reference tick on.
        self.ramp.settle(tick);
        let Some(model) = self.model else { return false };
        let divisor = divisor(model.card());
        if tick.rem_euclid(divisor) != 0 {
            return false;
        }
        // Histories start anew with the first tick that is seen and after a gap; the past reference is then the one that the loop
        // would have got without corrections.
        let sub_tick = tick.div_euclid(divisor);
        if self.references.next_tick() != sub_tick {
            self.measured.restart([EndRule::Hold; M], sub_tick);
            self.references.restart([EndRule::Hold; R], sub_tick.wrapping_sub(1));
            self.references.push(base(&self.base, &preview.sample(tick)));
            self.ramp.clear();
            self.acted = false;
        }
        self.measured.push(measured.map(finite_or_zero));
        if !(self.lanes.network || self.network_weight > 0.0) || model.network().is_none() {
            self.ramp.clear();
            self.features = Features::Unknown;
            return false;
        }
        let card = model.card();
        let ahead = match card.timing.interpolation {
            Interpolation::Hold => 0,
            Interpolation::Linear => divisor,
        };
        (job.tick, job.inputs) = (tick, [0.0; MAX_FEATURES]);
        let view = View { desired: preview, measured: &self.measured, references: &self.references, divisor };
        features::evaluate(&card.features, &view, tick.wrapping_add(ahead), divisor, &mut job.inputs);
        let (inputs, _) = job.inputs.split_at_checked(card.features.len()).unwrap_or_default();
        self.features = Features::compare(inputs, &model.envelope(), self.guard.settings());
        self.ramp.release(tick);
        true
    }

    /// Takes the result of the last job; one that is not awaited any more is dropped.
    pub fn deliver(&mut self, inference: Inference) {
        self.ramp.deliver(inference);
    }

    /// Second part of a reference tick: the reference that the loop shall track.
    pub fn finish<const N: usize>(&mut self, tick: i32, preview: &Preview<D, N>, measured: &[f32; M]) -> [f32; R] {
        self.finish_through(tick, preview, measured, |_| ())
    }

    /// [`Adapter::finish`] in which what the feedback lane asks for on each axis, in the output's unit, goes through `path` on
    /// its way to the bounds, unknown to the lane: in flight the identity, in a simulator what a robustness study asks (another
    /// loop gain).
    #[inline]
    pub fn finish_through<const N: usize>(
        &mut self,
        tick: i32,
        preview: &Preview<D, N>,
        measured: &[f32; M],
        path: impl FnOnce(&mut [f32; MAX_AXES]),
    ) -> [f32; R] {
        let desired = preview.sample(tick);
        let mut reference = base(&self.base, &desired);
        let Some(model) = self.model else { return reference };
        let card = model.card();
        let divisor = divisor(card);
        let interpolation = card.timing.interpolation;
        if interpolation == Interpolation::Hold && !self.deferred {
            self.ramp.publish();
        }
        let network = self.ramp.value(interpolation, tick.rem_euclid(divisor), divisor);
        let Verdict { allowed, handover_step } = self.guard.tick(&Observation {
            lane: card.feedback.as_ref(),
            monitor: model.monitor(),
            wanted: self.lanes,
            last: self.acted.then_some(&self.outcome),
            features: core::mem::replace(&mut self.features, Features::Unchanged),
            finite: finite(measured) && finite(&desired),
            late: self.ramp.late_in_a_row(),
            age: self.age,
        });
        // The network lane has a value from its first sub-rate tick on: a fade that began before would end in a step.
        let present = Lanes { network: self.ramp.current() && model.network().is_some(), feedback: model.feedback().is_some() };
        let fade = Fade::new(card.timing.fade_ticks, handover_step);
        self.network_weight = fade.next(self.network_weight, self.lanes.network, allowed.network, present.network);
        self.feedback_weight = fade.next(self.feedback_weight, self.lanes.feedback, allowed.feedback, present.feedback);
        let errors = feedback::errors(model, tick, preview, measured);
        let active = allowed.feedback && self.feedback_weight > 0.0;
        let wanted = Wanted {
            network,
            feedback: self.feedback.step(model, tick, preview, &errors, active),
            network_weight: self.network_weight,
            feedback_weight: self.feedback_weight,
        };
        let acting = self.correction.left() || self.network_weight > 0.0 || self.feedback_weight > 0.0;
        let applied = if acting {
            self.correction.apply(card, &wanted, path, &mut reference, &mut self.outcome)
        } else {
            self.correction.clear(card, &wanted, &mut self.outcome)
        };
        self.feedback.applied(model, &applied);
        self.acted = acting || self.lanes != Lanes::NONE;
        if self.acted {
            (self.outcome.active, self.outcome.asked) = (active, wanted.feedback);
            self.outcome.errors = feedback::monitored(model, tick, preview, measured, &errors);
        }
        if self.feedback_weight == 0.0 {
            self.feedback.clear_integrals();
        }
        if tick.rem_euclid(divisor) == 0 {
            self.references.push(reference);
        }
        reference
    }
}

/// The reference without any correction, of these desired channels.
fn base<const R: usize>(channels: &[usize; R], desired: &[f32]) -> [f32; R] {
    channels.map(|channel| desired.get(channel).copied().unwrap_or(0.0))
}

/// Reference ticks in a sub-rate tick. A checked model has at least one; here the compiler sees it too and leaves no panic.
fn divisor(card: &Card<'_>) -> i32 {
    i32::from(card.timing.divisor).max(1)
}
