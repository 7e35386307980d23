//! One reference tick of the adapter.
//!
//! *in* the desired trajectory and what is measured; *out* a job for the network at a sub-rate tick, and the reference; *never* a
//! lane that acts on what the guard has not seen; *source* Zhou 2017, Fig. 1.

use super::{Adapter, EndRule, Fade, HISTORY, Inference, Job, Lanes, Preview, Scratch, View, Wanted, features, feedback, window};
use crate::{
    features::Signals,
    format::{Card, Feature, Interpolation},
    guard::{Features, Observation, Verdict},
    math::{all_finite, finite_or_zero},
    model::Model,
};

impl<const D: usize, const M: usize, const R: usize, const C: usize, const O: usize, const A: usize>
    Adapter<'_, D, M, R, C, O, A>
{
    /// Reference ticks of the desired trajectory that the model looks back at from the one that is flown; 0 without a model.
    pub fn behind(&self) -> i32 {
        self.model.map_or(0, |_| self.behind)
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
            self.deliver(job.run_sized(network, scratch));
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
        if self.clock.phase() != 0 {
            return false;
        }
        let Some(measured) = self.sane(measured) else { return false };
        self.catch_up(tick, preview);
        self.measured.push(measured);
        if !(self.wanted().network || self.network_weight > 0.0) || model.network().is_none() {
            self.ramp.clear();
            self.features = Features::Unknown;
            return false;
        }
        let card = model.card();
        // Sub-rate ticks ahead for which the network is asked.
        let ahead = match card.timing.interpolation {
            Interpolation::Hold => 0,
            Interpolation::Linear => 1,
        };
        let then = tick.wrapping_add(divisor * ahead);
        let view = View {
            desired: preview,
            origin: preview.sample(then),
            measured: &self.measured,
            references: &self.references,
            sub_tick: self.clock.sub_tick().wrapping_add(ahead),
        };
        job.tick = tick;
        let inputs = job.inputs.get_mut(..card.features.len()).unwrap_or_default();
        evaluate(&card.features, &view, then, divisor, inputs);
        self.features = Features::compare(inputs, &model.envelope(), self.guard.settings());
        // What is not stored yet has not been seen.
        let stored = preview.reach(tick).min(self.ahead).max(0);
        let reach = (tick.wrapping_sub(self.behind), tick.wrapping_add(stored));
        let share = if !self.guard.settings().enabled {
            1.0
        } else if self.jumps.within(reach, preview, &self.paces, divisor) {
            0.0
        } else {
            window::share(&card.features, inputs, &self.paces)
        };
        // At once down, and up by fade when the loop has come to rest from what took it away.
        let fade = divisor as f32 / f32::from(card.timing.fade_ticks.max(1));
        let most = match (self.ramp.current(), self.guard.swinging()) {
            (false, _) => 1.0,
            (true, false) => self.share + fade,
            (true, true) => self.share,
        };
        self.share = if share < most { share } else { most };
        self.ramp.release(tick, self.share);
        true
    }

    /// The measurement of this tick or, if a channel is no finite number, the newest one that was; `None` if there never was one.
    fn sane(&mut self, measured: &[f32; M]) -> Option<[f32; M]> {
        if all_finite(measured) {
            self.good = Some(*measured);
        }
        self.good
    }

    /// Brings the histories to the sub-rate tick that begins. Of a short gap they get what was newest; with the first tick that
    /// is seen and after a long gap they start anew, and so do the lanes: the past reference is then the one that the loop
    /// would have got without corrections.
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
    pub fn deliver(&mut self, inference: Inference<O>) {
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
        path: impl FnOnce(&mut [f32; A]),
    ) -> [f32; R] {
        let desired = preview.sample(tick);
        let mut reference = self.desired_reference(preview, &desired, measured);
        let stand_in;
        let repeated = self.repeated(measured);
        let known = if all_finite(measured) {
            (self.good, self.bad) = (Some(*measured), 0);
            Some(measured)
        } else {
            (stand_in, self.bad) = (self.good, self.bad.saturating_add(1));
            stand_in.as_ref()
        };
        let (Some(model), Some(measured)) = (self.model, known) else {
            self.clock.advance(tick, 1);
            self.correction.fade(&self.bounds, &mut reference);
            return reference;
        };
        let card = model.card();
        let divisor = divisor(card);
        self.clock.advance(tick, divisor);
        let interpolation = card.timing.interpolation;
        if interpolation == Interpolation::Hold && !self.deferred {
            self.ramp.publish();
        }
        let network = self.ramp.value(interpolation, self.clock.phase(), divisor);
        let lanes = self.wanted();
        self.starved = self.starved.saturating_add(u32::from(lanes != Lanes::NONE && preview.reach(tick) < self.ahead));
        let Verdict { allowed, handover_step, share } = self.guard.tick(&Observation {
            lane: card.feedback.as_ref(),
            monitor: model.monitor(),
            wanted: lanes,
            last: self.acted.then_some(&self.outcome),
            features: core::mem::replace(&mut self.features, Features::Unchanged),
            finite: all_finite(&desired),
            bad: self.bad,
            late: self.ramp.late_in_a_row(),
            age: self.age.max(self.standing).max(repeated),
            trajectory: !preview.is_empty(),
        });
        // The network lane has a value from its first sub-rate tick on: a fade that began before would end in a step.
        let present = Lanes { network: self.ramp.current() && model.network().is_some(), feedback: model.feedback().is_some() };
        let fade = Fade::new(card.timing.fade_ticks, handover_step);
        self.network_weight = fade.next(self.network_weight, lanes.network, allowed.network, present.network);
        self.feedback_weight = fade.next(self.feedback_weight, lanes.feedback, allowed.feedback, present.feedback);
        let errors = feedback::errors(model, tick, preview, measured);
        let active = allowed.feedback && self.feedback_weight > 0.0;
        let wanted = Wanted {
            network,
            feedback: self.feedback.step(model, tick, preview, &errors, active),
            network_weight: self.network_weight,
            feedback_weight: self.feedback_weight * share,
        };
        let acting = self.correction.left() || self.network_weight > 0.0 || self.feedback_weight > 0.0;
        let applied = if acting {
            self.correction.apply(card, &self.bounds, &wanted, path, &mut reference, &mut self.outcome)
        } else {
            self.correction.clear(card, &wanted, &mut self.outcome)
        };
        self.feedback.applied(model, &applied);
        // What the guard learns of it begins one reference tick after a sub-rate tick: where it sums up as often as the network
        // is evaluated, no tick pays for both.
        let turn = self.acted || self.clock.phase() == 1 % divisor;
        self.acted = turn && (acting || lanes != Lanes::NONE);
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
            self.held = Some(reference);
            return reference;
        }
        let origin = &self.origin;
        let mut held = *self.held.get_or_insert_with(|| {
            let here = |channel: u8| measured.get(usize::from(channel)).copied().map_or(0.0, finite_or_zero);
            core::array::from_fn(|r| origin.get(r).copied().flatten().map_or(0.0, here))
        });
        // Behind the trajectory's end velocities vanish: that is how it is held.
        for (value, channel) in held.iter_mut().zip(&self.base) {
            if preview.rule(*channel) == EndRule::Zero {
                *value = 0.0;
            }
        }
        held
    }
}

/// The features of a sub-rate tick. Apart from the rest of the tick, which would leave these loops no registers.
#[inline(never)]
fn evaluate(features: &[Feature], signals: &impl Signals, tick: i32, divisor: i32, inputs: &mut [f32]) {
    features::evaluate(features, signals, tick, divisor, inputs);
}

/// The reference without any correction, of these desired channels.
pub(super) fn base<const R: usize>(channels: &[usize; R], desired: &[f32]) -> [f32; R] {
    channels.map(|channel| desired.get(channel).copied().unwrap_or(0.0))
}

/// Reference ticks in a sub-rate tick. A checked model has at least one; here the compiler sees it too and leaves no panic.
fn divisor<const C: usize, const O: usize, const A: usize>(card: &Card<'_, C, O, A>) -> i32 {
    i32::from(card.timing.divisor).max(1)
}
