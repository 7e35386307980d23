//! The add-on: corrects the references of any stable loop.
//!
//! *in* desired channels (pushed ahead of time) and measured channels, at every reference tick; *out* the reference channels;
//! *never* a correction beyond the model's limits and slew, never any change of the desired reference when both lanes are off, be it by the
//! user or by the [guard](crate::guard); *source* Zhou 2017, Fig. 1. What differs: the correction is ramped between sub-rate ticks, and a feedback lane adds to it.

mod correction;
mod feedback;
mod inference;
mod lanes;
mod ramp;
mod signals;

use crate::{
    features,
    guard::{Findings, Guard, GuardSettings, finite},
    math::{clamp, finite_or_zero},
    model::{Interpolation, MAX_FEATURES, MAX_OUTPUTS, Model, Refusal, SignalTable},
    network::Scratch,
    preview::{EndRule, Preview},
};
use correction::{Correction, Wanted};
use feedback::Feedback;
pub use inference::{Inference, Job};
pub use lanes::Lanes;
use ramp::Ramp;
use signals::{History, View, base_channels, same_signals};

/// Sub-rate ticks of measured and reference history that features can read.
pub const HISTORY: usize = 16;

/// Adapter for a loop with `D` desired, `M` measured and `R` reference channels.
///
/// A reference tick is [`Adapter::begin`] and [`Adapter::finish`]. At a sub-rate tick the first gives the [`Job`] of evaluating the network,
/// whose [`Inference`] is [delivered](Adapter::deliver): between the two ([`Adapter::step`] does it all), or, by a task that the
/// control loop interrupts, until the next reference tick ([`Adapter::defer`]).
#[derive(Debug)]
pub struct Adapter<'m, const D: usize, const M: usize, const R: usize> {
    model: &'m Model<'m>,
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
    guard: Guard,
    /// How far each lane is faded in, 0..=1.
    network_weight: f32,
    feedback_weight: f32,
    correction: Correction,
    loop_gain: f32,
}

impl<'m, const D: usize, const M: usize, const R: usize> Adapter<'m, D, M, R> {
    /// Ties a model to an application whose signals are `table`, whose references run at `rate_hz` and whose preview keeps
    /// `capacity` samples. Both lanes are off.
    ///
    /// # Errors
    /// If signals, rate or preview length do not fit.
    pub fn new(model: &'m Model<'m>, table: &SignalTable<'_>, rate_hz: f32, capacity: usize) -> Result<Self, Refusal> {
        Self::check(model, table, rate_hz, capacity)?;
        Ok(Self::tied(model, Self::base(table)))
    }

    /// Whether [`Adapter::new`] takes a model.
    ///
    /// # Errors
    /// As [`Adapter::new`].
    pub fn check(model: &Model<'_>, table: &SignalTable<'_>, rate_hz: f32, capacity: usize) -> Result<(), Refusal> {
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

    /// Desired channel that each reference channel starts from.
    pub(crate) fn base(table: &SignalTable<'_>) -> [usize; R] {
        base_channels(table)
    }

    /// Of a model that was checked. Inlined, so that its 4 KB are made where they stay.
    #[inline(always)]
    pub(crate) fn tied(model: &'m Model<'m>, base: [usize; R]) -> Self {
        Self {
            model,
            base,
            measured: History::new([EndRule::Hold; M], 0),
            // No sub-rate tick is that low: the first one that is seen starts the histories.
            references: History::new([EndRule::Hold; R], i32::MIN),
            ramp: Ramp::EMPTY,
            deferred: false,
            feedback: Feedback::REST,
            lanes: Lanes::NONE,
            guard: Guard::new(GuardSettings::default(), model.card().timing.reference_rate_hz),
            network_weight: 0.0,
            feedback_weight: 0.0,
            correction: Correction::NONE,
            loop_gain: 1.0,
        }
    }

    /// Forgets everything but the lanes that are wanted and the counts: the next tick is the first one.
    pub fn reset(&mut self) {
        self.measured = History::new([EndRule::Hold; M], 0);
        self.references = History::new([EndRule::Hold; R], i32::MIN);
        self.ramp.clear();
        self.feedback = Feedback::REST;
        (self.network_weight, self.feedback_weight) = (0.0, 0.0);
        self.correction = Correction { saturations: self.correction.saturations, ..Correction::NONE };
        self.guard.land();
    }

    /// The model that is flown.
    pub fn model(&self) -> &'m Model<'m> {
        self.model
    }

    /// Switches lanes; they are faded in and out over the model's fade time.
    pub fn switch(&mut self, lanes: Lanes) {
        self.lanes = lanes;
        self.guard.switched(lanes);
    }

    /// Which lanes the guard lets act, its trips and its evidence.
    pub fn guard(&self) -> &Guard {
        &self.guard
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
        self.guard.set_age(ticks);
    }

    /// Multiplies what the loop receives of the feedback lane, unknown to the lane: the loop gain of a robustness test. 1 in flight.
    pub fn set_loop_gain(&mut self, gain: f32) {
        self.loop_gain = gain;
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
    /// [`crate::model::Card::preview_span`]'s future ahead; what is missing is taken as the trajectory's end. The scratch needs
    /// [`crate::network::Network::scratch_words`].
    pub fn step<const N: usize, const S: usize>(
        &mut self,
        tick: i32,
        preview: &Preview<D, N>,
        measured: &[f32; M],
        scratch: &mut Scratch<S>,
    ) -> [f32; R] {
        if let Some(job) = self.begin(tick, preview, measured)
            && let Some(network) = self.model.network()
        {
            self.deliver(job.run(network, scratch));
        }
        self.finish(tick, preview, measured)
    }

    /// First part of a reference tick: takes the inference that is due, remembers what was measured and, at a sub-rate tick of the network
    /// lane, gives the job of evaluating the network.
    pub fn begin<const N: usize>(&mut self, tick: i32, preview: &Preview<D, N>, measured: &[f32; M]) -> Option<Job> {
        // A ramp ends where the inference of its start says, which is needed from the next reference tick on.
        self.ramp.settle(tick);
        let divisor = self.divisor();
        if tick.rem_euclid(divisor) != 0 {
            return None;
        }
        let base = self.base_reference(tick, preview);
        self.align(tick.div_euclid(divisor), measured, &base);
        if !(self.lanes.network || self.network_weight > 0.0) || self.model.network().is_none() {
            self.ramp.clear();
            self.guard.no_features();
            return None;
        }
        let card = self.model.card();
        let ahead = match card.timing.interpolation {
            Interpolation::Hold => 0,
            Interpolation::Linear => divisor,
        };
        let mut job = Job { tick, inputs: [0.0; MAX_FEATURES] };
        let view = View { desired: preview, measured: &self.measured, references: &self.references, divisor };
        features::evaluate(&card.features, &view, tick.wrapping_add(ahead), divisor, &mut job.inputs);
        let (inputs, _) = job.inputs.split_at_checked(card.features.len()).unwrap_or_default();
        self.guard.features(inputs, &self.model.envelope());
        self.ramp.release(tick);
        Some(job)
    }

    /// Takes the result of the last job; one that is not awaited any more is dropped.
    pub fn deliver(&mut self, inference: Inference) {
        self.ramp.deliver(inference);
    }

    /// Second part of a reference tick: the reference that the loop shall track.
    pub fn finish<const N: usize>(&mut self, tick: i32, preview: &Preview<D, N>, measured: &[f32; M]) -> [f32; R] {
        let desired = preview.sample(tick);
        let mut reference = self.base.map(|channel| desired.get(channel).copied().unwrap_or(0.0));
        let network = self.network(tick);
        self.guard
            .judge(self.lanes, Findings { not_finite: !(finite(measured) && finite(&desired)), late: self.ramp.late_in_a_row() });
        self.fade();
        let errors = feedback::errors(self.model, tick, preview, measured);
        let engaged = self.guard.allowed(self.lanes).feedback && self.feedback_weight > 0.0;
        let wanted = Wanted {
            network,
            feedback: self.feedback.step(self.model, tick, preview, &errors, engaged),
            network_weight: self.network_weight,
            feedback_weight: self.feedback_weight,
            loop_gain: self.loop_gain,
        };
        let card = self.model.card();
        let acting = self.correction.left() || self.network_weight > 0.0 || self.feedback_weight > 0.0;
        let applied =
            if acting { self.correction.apply(card, &wanted, &mut reference) } else { self.correction.clear(card, &wanted) };
        self.feedback.applied(self.model, &applied.feedback);
        if acting || self.lanes != Lanes::NONE {
            self.guard.excess(applied.excess);
            self.guard.swing(card.lane.as_ref().filter(|_| engaged).map(|lane| (lane, &wanted.feedback)));
            if let Some(monitor) = self.model.monitor() {
                let errors = feedback::monitored(self.model, tick, preview, measured, &errors);
                self.guard.observe(monitor, &errors, &applied.shares);
            }
        } else {
            self.guard.restart();
        }
        if self.feedback_weight == 0.0 {
            self.feedback.release();
        }
        let divisor = self.divisor();
        if tick.rem_euclid(divisor) == 0 {
            self.references.push(reference);
        }
        reference
    }

    /// Reference ticks in a sub-rate tick. A checked model has at least one; here the compiler sees it too and leaves no panic.
    fn divisor(&self) -> i32 {
        i32::from(self.model.card().timing.divisor).max(1)
    }

    fn fade(&mut self) {
        let ticks = self.model.card().timing.fade_ticks;
        let step = if ticks == 0 { 1.0 } else { 1.0 / f32::from(ticks) };
        let allowed = self.guard.allowed(self.lanes);
        let handover = step.max(self.guard.handover_step());
        let approach = |weight: f32, on: bool, tripped: bool| {
            let change = if on {
                step
            } else if tripped {
                -handover
            } else {
                -step
            };
            clamp(weight + change, 0.0, 1.0)
        };
        // The network lane has a value from its first sub-rate tick on: a fade that began before would end in a step.
        let network = allowed.network && self.ramp.current() && self.model.network().is_some();
        let tripped = [self.lanes.network && !allowed.network, self.lanes.feedback && !allowed.feedback];
        self.network_weight = approach(self.network_weight, network, tripped[0]);
        self.feedback_weight = approach(self.feedback_weight, allowed.feedback && self.model.lane().is_some(), tripped[1]);
    }

    /// The reference without any correction.
    fn base_reference<const N: usize>(&self, tick: i32, preview: &Preview<D, N>) -> [f32; R] {
        let desired = preview.sample(tick);
        self.base.map(|channel| desired.get(channel).copied().unwrap_or(0.0))
    }

    /// The network lane's correction at this tick.
    fn network(&mut self, tick: i32) -> [f32; MAX_OUTPUTS] {
        let interpolation = self.model.card().timing.interpolation;
        if interpolation == Interpolation::Hold && !self.deferred {
            self.ramp.publish();
        }
        let divisor = self.divisor();
        self.ramp.value(interpolation, tick.rem_euclid(divisor), divisor)
    }

    /// Stores the measured channels of sub-rate tick `sub_tick`. Histories start anew with the first tick that is seen and after a gap;
    /// the past reference is then the one that the loop would have got without corrections.
    fn align(&mut self, sub_tick: i32, measured: &[f32; M], base: &[f32; R]) {
        if self.references.next_tick() != sub_tick {
            self.measured = History::new([EndRule::Hold; M], sub_tick);
            self.references = History::new([EndRule::Hold; R], sub_tick.wrapping_sub(1));
            self.references.push(*base);
            self.ramp.clear();
            self.guard.restart();
        }
        self.measured.push(measured.map(finite_or_zero));
    }
}
