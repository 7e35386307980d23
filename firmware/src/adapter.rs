//! The add-on: corrects the references of any stable loop.
//!
//! *in* desired channels (pushed ahead of time) and measured channels, at every reference tick; *out* the reference channels;
//! *never* a correction beyond the model's limits and slew, never any change of the desired reference when both lanes are off;
//! *source* Zhou 2017, Fig. 1. What differs: the correction is ramped between sub-rate ticks, and a feedback lane adds to it.

mod inference;
mod ramp;
mod signals;

use serde::{Deserialize, Serialize};

use crate::{
    features,
    feedback::AxisState,
    math::{clamp, finite_or_zero},
    model::{Interpolation, MAX_AXES, MAX_ERRORS, MAX_FEATURES, MAX_OUTPUTS, Model, Refusal, SignalTable},
    network::Scratch,
    preview::{EndRule, Preview},
};

pub use inference::{Inference, Job};
use ramp::Ramp;
use signals::{History, View, base_channels, same_signals};

/// Sub-rate ticks of measured and reference history that features can read.
pub const HISTORY: usize = 16;

/// Bound of what lowers the feedback lane's authority: a millionth of it is left.
const VIGOUR_LIMIT: f32 = 1e6;

/// Which lanes act.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lanes {
    /// The network lane.
    pub network: bool,
    /// The feedback lane.
    pub feedback: bool,
}

impl Lanes {
    /// Both lanes.
    pub const BOTH: Self = Self { network: true, feedback: true };
    /// No lane: the loop gets the desired reference, to the bit.
    pub const NONE: Self = Self { network: false, feedback: false };
}

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
    axes: [AxisState; MAX_AXES],
    lanes: Lanes,
    /// How far each lane is faded in, 0..=1.
    network_weight: f32,
    feedback_weight: f32,
    correction: [f32; MAX_OUTPUTS],
    saturations: u32,
    loop_gain: f32,
    /// Recent peak of what is desired of the loop and of its errors ([`crate::model::Authority`]).
    vigour: f32,
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
            axes: [AxisState::REST; MAX_AXES],
            lanes: Lanes::NONE,
            network_weight: 0.0,
            feedback_weight: 0.0,
            correction: [0.0; MAX_OUTPUTS],
            saturations: 0,
            loop_gain: 1.0,
            vigour: 0.0,
        }
    }

    /// Forgets everything but the lanes that are wanted and the counts: the next tick is the first one.
    pub fn reset(&mut self) {
        self.measured = History::new([EndRule::Hold; M], 0);
        self.references = History::new([EndRule::Hold; R], i32::MIN);
        self.ramp.clear();
        self.axes = [AxisState::REST; MAX_AXES];
        (self.network_weight, self.feedback_weight, self.vigour) = (0.0, 0.0, 0.0);
        self.correction = [0.0; MAX_OUTPUTS];
    }

    /// The model that is flown.
    pub fn model(&self) -> &'m Model<'m> {
        self.model
    }

    /// Switches lanes; they are faded in and out over the model's fade time.
    pub fn switch(&mut self, lanes: Lanes) {
        self.lanes = lanes;
    }

    /// Multiplies what the loop receives of the feedback lane, unknown to the lane: the loop gain of a robustness test. 1 in flight.
    pub fn set_loop_gain(&mut self, gain: f32) {
        self.loop_gain = gain;
    }

    /// Correction of each output of the model in the last tick.
    pub fn correction(&self) -> &[f32; MAX_OUTPUTS] {
        &self.correction
    }

    /// How far the network lane and the feedback lane are faded in, 0..=1.
    pub fn weights(&self) -> [f32; 2] {
        [self.network_weight, self.feedback_weight]
    }

    /// Ticks in which a limit or the slew bounded the correction.
    pub fn saturations(&self) -> u32 {
        self.saturations
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
        self.ramp.release(tick);
        Some(job)
    }

    /// Takes the result of the last job; one that is not awaited any more is dropped.
    pub fn deliver(&mut self, inference: Inference) {
        self.ramp.deliver(inference);
    }

    /// Second part of a reference tick: the reference that the loop shall track.
    pub fn finish<const N: usize>(&mut self, tick: i32, preview: &Preview<D, N>, measured: &[f32; M]) -> [f32; R] {
        let mut reference = self.base_reference(tick, preview);
        let network = self.network(tick);
        self.fade();
        let feedback = self.feedback(tick, preview, measured);
        // The slew may need longer than the fade: off is when nothing is left.
        let left = self.correction.iter().any(|correction| *correction != 0.0);
        if left || self.network_weight > 0.0 || self.feedback_weight > 0.0 {
            self.apply(&mut reference, &network, &feedback);
        } else {
            // Not even an addition of zero: the baseline's bits.
            self.correction = [0.0; MAX_OUTPUTS];
            self.settle(&[0.0; MAX_AXES]);
        }
        if self.feedback_weight == 0.0 {
            self.axes.iter_mut().for_each(AxisState::release);
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
        let approach = |weight: f32, on: bool| clamp(if on { weight + step } else { weight - step }, 0.0, 1.0);
        // The network lane has a value from its first sub-rate tick on: a fade that began before would end in a step.
        let network = self.lanes.network && self.ramp.current() && self.model.network().is_some();
        self.network_weight = approach(self.network_weight, network);
        self.feedback_weight = approach(self.feedback_weight, self.lanes.feedback && self.model.lane().is_some());
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
        }
        self.measured.push(measured.map(finite_or_zero));
    }

    /// Share of the fast clamps that the feedback lane may use at this tick, at which its axes have these errors.
    fn authority<const N: usize>(&mut self, tick: i32, preview: &Preview<D, N>, errors: &[[f32; MAX_ERRORS]; MAX_AXES]) -> f32 {
        let Some(layout) = &self.model.card().lane else { return 1.0 };
        let authority = &layout.authority;
        let desired = authority.channels.iter().map(|&channel| preview.channel(tick, usize::from(channel)) / authority.scale);
        let strayed = errors.iter().map(|errors| errors[0] / authority.error_scale);
        let now = desired.chain(strayed).fold(0.0, |sum, value| sum + value * value);
        // Also what is no number counts as far astray; the bound lets the lane come back in seconds.
        let now = if now < VIGOUR_LIMIT { now } else { VIGOUR_LIMIT };
        let past = self.vigour * authority.decay;
        self.vigour = if now > past { now } else { past };
        1.0 / (1.0 + self.vigour * self.vigour)
    }

    /// The feedback lane's output on each of its axes.
    fn feedback<const N: usize>(&mut self, tick: i32, preview: &Preview<D, N>, measured: &[f32; M]) -> [f32; MAX_AXES] {
        let mut outputs = [0.0; MAX_AXES];
        let Some(lane) = self.model.lane() else { return outputs };
        let timing = &self.model.card().timing;
        let dt = 1.0 / timing.reference_rate_hz;
        let whole = timing.measurement_delay_ticks as i32;
        let share = timing.measurement_delay_ticks - whole as f32;
        let engaged = self.lanes.feedback && self.feedback_weight > 0.0;
        let mut errors = [[0.0; MAX_ERRORS]; MAX_AXES];
        for (axis, errors) in lane.axes().iter().zip(&mut errors) {
            for (error, &(measured_channel, desired_channel)) in errors.iter_mut().zip(&axis.layout().errors) {
                let channel = usize::from(desired_channel);
                let newer = preview.channel(tick.wrapping_sub(whole), channel);
                let older = preview.channel(tick.wrapping_sub(whole + 1), channel);
                let then = newer + (older - newer) * share;
                *error = measured.get(usize::from(measured_channel)).copied().unwrap_or(then) - then;
            }
        }
        let authority = self.authority(tick, preview, &errors);
        for (((axis, state), errors), output) in lane.axes().iter().zip(&mut self.axes).zip(errors).zip(&mut outputs) {
            *output = state.step(lane, axis, errors, authority, dt, engaged);
        }
        outputs
    }

    /// Adds both lanes within limits and slew, and tells the feedback lane what was applied of it.
    fn apply(&mut self, reference: &mut [f32; R], network: &[f32; MAX_OUTPUTS], feedback: &[f32; MAX_AXES]) {
        let card = self.model.card();
        let mut wanted = network.map(|value| value * self.network_weight);
        let axes = card.lane.iter().flat_map(|lane| &lane.axes);
        for (axis, value) in axes.clone().zip(feedback) {
            if let Some(wanted) = wanted.get_mut(usize::from(axis.output)) {
                *wanted += value * self.feedback_weight * self.loop_gain;
            }
        }
        let mut excess = [0.0; MAX_OUTPUTS];
        let mut saturated = false;
        let places = self.correction.iter_mut().zip(&wanted).zip(&mut excess);
        for (output, ((correction, &wanted), excess)) in card.outputs.iter().zip(places) {
            let slewed = clamp(wanted, *correction - output.slew, *correction + output.slew);
            *correction = clamp(slewed, -output.limit, output.limit);
            *excess = *correction - wanted;
            saturated |= *excess != 0.0;
            if let Some(channel) = reference.get_mut(usize::from(output.channel)) {
                *channel += *correction;
            }
        }
        self.saturations = self.saturations.saturating_add(u32::from(saturated));
        let mut applied = [0.0; MAX_AXES];
        for ((axis, value), applied) in axes.zip(feedback).zip(&mut applied) {
            *applied = value * self.feedback_weight + excess.get(usize::from(axis.output)).copied().unwrap_or(0.0);
        }
        self.settle(&applied);
    }

    fn settle(&mut self, applied: &[f32; MAX_AXES]) {
        if let Some(lane) = self.model.lane() {
            for (state, &value) in self.axes.iter_mut().zip(applied).take(lane.axes().len()) {
                state.applied(lane, value);
            }
        }
    }
}
