//! The add-on: corrects the references of any stable loop.
//!
//! *in* desired channels (pushed ahead of time) and measured channels, at every reference tick; *out* the reference channels;
//! *never* a correction beyond the application's [caps](crate::caps) or the model's limits, never a change of it beyond their
//! slew, never any change of the desired reference when both lanes are off and faded out, be it by the user or by the
//! [guard](crate::guard); *source* Zhou 2017, Fig. 1. What differs: the correction is ramped between
//! sub-rate ticks, and a feedback lane adds to it.

mod clock;
mod correction;
mod fade;
mod feedback;
mod inference;
mod ramp;
mod signals;
mod window;

use crate::{
    caps::{Bounds, Caps},
    features,
    format::{Card, Channels, EndRule, Interpolation, MAX_AXES, MAX_FEATURES, MAX_OUTPUTS, Refusal},
    guard::{Features, Guard, GuardSettings, Observation, Outcome, Trips, Verdict, finite},
    math::finite_or_zero,
    model::Model,
    network::Scratch,
    preview::Preview,
};
use clock::Clock;
use correction::{Correction, Wanted};
use fade::Fade;
use feedback::Feedback;
pub use inference::{Inference, Job};
use ramp::Ramp;
use signals::{History, View, base_channels, measured_channels, same_signals, whole_signals};

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
    /// Sub-rate ticks.
    clock: Clock,
    ramp: Ramp,
    /// Whether an inference may take up to the next reference tick.
    deferred: bool,
    feedback: Feedback,
    /// Lanes that are wanted.
    lanes: Lanes,
    /// How far each lane is faded in, 0..=1.
    network_weight: f32,
    feedback_weight: f32,
    correction: Correction<R>,
    /// What the application lets the correction be.
    bounds: Bounds<R>,
    /// Largest change in a sub-rate tick of each desired channel in training.
    changes: [f32; D],
    /// The newest measurement that was one,
    good: Option<[f32; M]>,
    /// and how many reference ticks in a row brought none since.
    bad: u16,
    /// The desired reference of the last tick that had one, which stands in when there is no trajectory;
    held: Option<[f32; R]>,
    /// measured channel from which each reference channel starts when there never was one.
    origin: [Option<u8>; R],
    /// Reference ticks that the model looks ahead,
    ahead: i32,
    /// and ticks in which the trajectory did not reach as far.
    starved: u32,
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
            clock: Clock::EMPTY,
            ramp: Ramp::EMPTY,
            deferred: false,
            feedback: Feedback::EMPTY,
            lanes: Lanes::NONE,
            network_weight: 0.0,
            feedback_weight: 0.0,
            correction: Correction::NONE,
            bounds: Bounds::EMPTY,
            changes: [0.0; D],
            good: None,
            bad: 0,
            held: None,
            origin: [None; R],
            ahead: 0,
            starved: 0,
            outcome: Outcome::NONE,
            acted: false,
            features: Features::Unchanged,
            age: 0,
        }
    }

    /// Loads a model into an application whose signals are `table`, whose references run at `rate_hz`, which lets corrections be
    /// within `caps`, and whose preview keeps `capacity` samples. Both lanes are off.
    ///
    /// # Errors
    /// If signals, rate, bounds or preview length do not fit.
    pub fn new<'t>(
        model: &'m Model<'m>,
        table: impl Into<Channels<'t>>,
        rate_hz: f32,
        caps: &Caps<'_>,
        capacity: usize,
    ) -> Result<Self, Refusal> {
        let table = table.into();
        Self::check(model, &table, rate_hz, caps, capacity)?;
        let mut adapter = Self::empty();
        adapter.load(model, &table, caps);
        Ok(adapter)
    }

    /// Whether [`Adapter::new`] takes a model.
    ///
    /// # Errors
    /// As [`Adapter::new`].
    pub fn check(model: &Model<'_>, table: &Channels<'_>, rate_hz: f32, caps: &Caps<'_>, capacity: usize) -> Result<(), Refusal> {
        let card = model.card();
        same_signals(card, table, [D, M, R])?;
        Bounds::<R>::check(caps, table.reference.len())?;
        let rate = card.timing.reference_rate_hz;
        // Written so that NaN and infinity are refused.
        let near = rate_hz < f32::MAX && (rate - rate_hz).abs() <= 1e-3 * rate_hz;
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
    pub fn load(&mut self, model: &'m Model<'m>, table: &Channels<'_>, caps: &Caps<'_>) {
        let rate_hz = model.card().timing.reference_rate_hz;
        self.model = Some(model);
        self.guard.load(GuardSettings::default(), rate_hz);
        self.bounds.load(caps, rate_hz);
        self.ahead = model.card().preview_span().1 as i32;
        self.changes = window::changes(model.card(), &model.envelope());
        self.know(table);
        self.deferred = false;
        self.restart();
    }

    /// Learns where references come from.
    fn know(&mut self, table: &Channels<'_>) {
        self.base = base_channels(table);
        self.origin = measured_channels(table);
    }

    /// Takes the model away, in place: from now on the reference is the desired one of an application whose signals are `table`.
    ///
    /// # Errors
    /// If a signal has too many channels, or a reference channel the name of no desired one; then nothing changes.
    pub fn bypass(&mut self, table: &Channels<'_>) -> Result<(), Refusal> {
        whole_signals(table, [D, M, R])?;
        self.model = None;
        self.know(table);
        self.restart();
        Ok(())
    }

    /// Forgets everything but the model and its guard's settings, also the counts: as it was when the model came. Both lanes are
    /// off. A correction that was left goes by its slew.
    pub fn restart(&mut self) {
        self.forget();
        self.ramp = Ramp::EMPTY;
        (self.correction.saturations, self.starved) = (0, 0);
        self.guard.restart();
        self.switch(Lanes::NONE);
    }

    /// Forgets everything but the lanes that are wanted and the counts: the next tick is the first one, of a loop at rest. The
    /// correction is gone at once.
    pub fn reset(&mut self) {
        self.forget();
        self.correction.reset();
    }

    /// Forgets what was seen.
    fn forget(&mut self) {
        (self.clock, self.good, self.bad, self.held) = (Clock::EMPTY, None, 0, None);
        self.measured.clear(0);
        self.references.clear(0);
        self.forget_lanes();
        self.features = Features::Unchanged;
        self.age = 0;
        self.guard.reset();
    }

    /// The lanes begin anew, and fade in again.
    fn forget_lanes(&mut self) {
        self.ramp.clear();
        self.feedback.reset();
        (self.network_weight, self.feedback_weight, self.acted) = (0.0, 0.0, false);
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
    pub fn correction(&self) -> [f32; MAX_OUTPUTS] {
        self.model.map_or([0.0; MAX_OUTPUTS], |model| self.correction.of_outputs(model.card()))
    }

    /// How far the network lane and the feedback lane are faded in, 0..=1.
    pub fn weights(&self) -> [f32; 2] {
        [self.network_weight, self.feedback_weight]
    }

    /// Ticks in which a limit or the slew bounded the correction.
    pub fn saturations(&self) -> u32 {
        self.correction.saturations
    }

    /// Ticks in which the trajectory did not reach as far ahead as the model looks while a lane was wanted: what was missing was
    /// taken as its end.
    pub fn starved(&self) -> u32 {
        self.starved
    }

    /// The last reference tick that was begun or finished with a model, since the start.
    pub fn last_tick(&self) -> Option<i32> {
        self.clock.last()
    }

    /// Whether the newest measurement was refused, as a channel was not a finite number, and the last one stood in.
    pub fn bad_sample(&self) -> bool {
        self.bad > 0
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
        if self.clock.advance(tick, divisor) {
            self.ramp.hold();
        }
        let Some(measured) = self.sane(measured) else { return false };
        if self.clock.phase() != 0 {
            return false;
        }
        self.catch_up(tick, preview);
        self.measured.push(measured);
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
        let (now, sub_tick) = (tick, self.clock.sub_tick());
        let view = View { desired: preview, measured: &self.measured, references: &self.references, divisor, now, sub_tick };
        features::evaluate(&card.features, &view, tick.wrapping_add(ahead), divisor, &mut job.inputs);
        let (inputs, _) = job.inputs.split_at_checked(card.features.len()).unwrap_or_default();
        self.features = Features::compare(inputs, &model.envelope(), self.guard.settings());
        let share = if self.guard.settings().enabled {
            window::share(&card.features, inputs, &self.changes, self.guard.settings())
        } else {
            1.0
        };
        self.ramp.release(tick, share);
        true
    }

    /// The measurement of this tick or, if a channel is no finite number, the newest one that was; `None` if there never was one.
    fn sane(&mut self, measured: &[f32; M]) -> Option<[f32; M]> {
        if finite(measured) {
            self.good = Some(*measured);
        }
        self.good
    }

    /// Brings the histories to the sub-rate tick that begins. Of a short gap they get what was newest; with the first tick that is
    /// seen and after a long gap they start anew, and so do the lanes: the past reference is then the one that the loop would have
    /// got without corrections.
    fn catch_up<const N: usize>(&mut self, tick: i32, preview: &Preview<D, N>) {
        let sub_tick = self.clock.sub_tick();
        let missed = sub_tick.wrapping_sub(self.references.next_tick());
        if self.references.is_empty() || !(0..HISTORY as i32).contains(&missed) {
            self.measured.clear(sub_tick);
            self.references.clear(sub_tick.wrapping_sub(1));
            self.references.push(base(&self.base, &preview.sample(tick)));
            self.forget_lanes();
            return;
        }
        while self.references.next_tick() != sub_tick {
            self.references.push(self.references.sample(sub_tick));
        }
        while self.measured.next_tick().wrapping_sub(sub_tick) < 0 {
            self.measured.push(self.measured.sample(sub_tick));
        }
        self.measured.truncate(sub_tick);
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
        let mut reference = self.desired_reference(preview, &desired, measured);
        self.bad = if finite(measured) { 0 } else { self.bad.saturating_add(1) };
        let (Some(model), Some(measured)) = (self.model, self.sane(measured)) else {
            self.clock.advance(tick, 1);
            self.correction.fade(&self.bounds, &mut reference);
            return reference;
        };
        let measured = &measured;
        let card = model.card();
        let divisor = divisor(card);
        self.clock.advance(tick, divisor);
        let interpolation = card.timing.interpolation;
        if interpolation == Interpolation::Hold && !self.deferred {
            self.ramp.publish();
        }
        let network = self.ramp.value(interpolation, self.clock.phase(), divisor);
        let wanted_at_all = self.lanes != Lanes::NONE;
        self.starved = self.starved.saturating_add(u32::from(wanted_at_all && preview.reach(tick) < self.ahead));
        let Verdict { allowed, handover_step } = self.guard.tick(&Observation {
            lane: card.feedback.as_ref(),
            monitor: model.monitor(),
            wanted: self.lanes,
            last: self.acted.then_some(&self.outcome),
            features: core::mem::replace(&mut self.features, Features::Unchanged),
            finite: finite(&desired),
            bad: self.bad,
            late: self.ramp.late_in_a_row(),
            age: self.age,
            trajectory: !preview.is_empty(),
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
            self.correction.apply(card, &self.bounds, &wanted, path, &mut reference, &mut self.outcome)
        } else {
            self.correction.clear(card, &wanted, &mut self.outcome)
        };
        self.feedback.applied(model, &applied);
        self.acted = acting || self.lanes != Lanes::NONE;
        if self.acted {
            (self.outcome.active, self.outcome.asked) = (active, wanted.feedback);
            self.outcome.network = self.network_weight * self.ramp.share();
            self.outcome.errors = feedback::monitored(model, tick, preview, measured, &errors);
            let base = |channel: usize| self.base.get(channel).copied().unwrap_or(0);
            let desired = feedback::desired(model, tick, preview, base);
            (self.outcome.desired, self.outcome.references) = desired;
        }
        if self.feedback_weight == 0.0 {
            self.feedback.clear_integrals();
        }
        if self.clock.phase() == 0 && self.references.next_tick() == self.clock.sub_tick() {
            self.references.push(reference);
        }
        reference
    }

    /// The reference without any correction. Where there is no trajectory, the loop holds what was desired last or, if nothing
    /// ever was, where it is.
    fn desired_reference<const N: usize>(
        &mut self,
        preview: &Preview<D, N>,
        desired: &[f32; D],
        measured: &[f32; M],
    ) -> [f32; R] {
        if !preview.is_empty() {
            let reference = base(&self.base, desired);
            // Behind the trajectory's end velocities vanish: that is how it is held.
            self.held = Some(core::array::from_fn(|r| {
                let rest = preview.rule(self.base.get(r).copied().unwrap_or(0)) == EndRule::Zero;
                if rest { 0.0 } else { reference.get(r).copied().unwrap_or(0.0) }
            }));
            return reference;
        }
        let origin = &self.origin;
        *self.held.get_or_insert_with(|| {
            let here = |channel: u8| measured.get(usize::from(channel)).copied().map_or(0.0, finite_or_zero);
            core::array::from_fn(|r| origin.get(r).copied().flatten().map_or(0.0, here))
        })
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
