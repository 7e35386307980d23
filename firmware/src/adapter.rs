//! The add-on: corrects the references of any stable loop.
//!
//! *in* desired channels (pushed ahead of time) and measured channels, at every reference tick; *out* the reference channels;
//! *never* a correction beyond the model's limits and slew, never any change of the desired reference when both lanes are off;
//! *source* Zhou 2017, Fig. 1. What differs: the correction is ramped between sub-rate ticks, and a feedback lane adds to it.

mod signals;

use serde::{Deserialize, Serialize};

use crate::{
    features,
    feedback::AxisState,
    math::{clamp, finite_or_zero},
    model::{Interpolation, MAX_AXES, MAX_ERRORS, MAX_FEATURES, MAX_OUTPUTS, Model, Refusal, SignalTable},
    network::{MAX_SCRATCH, Network, Scratch},
    preview::{EndRule, Preview},
};

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

/// Adapter for a loop with `D` desired, `M` measured and `R` reference channels, and a scratch of `S` words for the network (without a
/// number: enough for any network).
#[derive(Debug)]
pub struct Adapter<'m, const D: usize, const M: usize, const R: usize, const S: usize = MAX_SCRATCH> {
    model: &'m Model<'m>,
    /// Desired channel from which each reference channel starts.
    base: [usize; R],
    measured: History<M>,
    references: History<R>,
    /// Network correction at the last and at the next sub-rate tick.
    ramp: [[f32; MAX_OUTPUTS]; 2],
    primed: bool,
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
    scratch: Scratch<S>,
}

impl<'m, const D: usize, const M: usize, const R: usize, const S: usize> Adapter<'m, D, M, R, S> {
    /// Ties a model to an application whose signals are `table`, whose references run at `rate_hz` and whose preview keeps
    /// `capacity` samples. Both lanes are off.
    ///
    /// # Errors
    /// If signals, rate, preview length or scratch do not fit.
    pub fn new(model: &'m Model<'m>, table: &SignalTable<'_>, rate_hz: f32, capacity: usize) -> Result<Self, Refusal> {
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
        let words = model.network().map_or(0, Network::scratch_words);
        if words > S {
            return Err(Refusal::Shape { what: "words of the network's scratch", found: words as u32, limit: S as u32 });
        }
        Ok(Self {
            model,
            base: base_channels(table),
            measured: History::new([EndRule::Hold; M], 0),
            // No sub-rate tick is that low: the first one that is seen starts the histories.
            references: History::new([EndRule::Hold; R], i32::MIN),
            ramp: [[0.0; MAX_OUTPUTS]; 2],
            primed: false,
            axes: [AxisState::REST; MAX_AXES],
            lanes: Lanes::NONE,
            network_weight: 0.0,
            feedback_weight: 0.0,
            correction: [0.0; MAX_OUTPUTS],
            saturations: 0,
            loop_gain: 1.0,
            vigour: 0.0,
            scratch: Scratch::sized(),
        })
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

    /// Ticks in which a limit or the slew bounded the correction.
    pub fn saturations(&self) -> u32 {
        self.saturations
    }

    /// One reference tick: the reference that the loop shall track. `preview` should reach [`crate::model::Card::preview_span`]'s future ahead;
    /// what is missing is taken as the trajectory's end.
    pub fn step<const N: usize>(&mut self, tick: i32, preview: &Preview<D, N>, measured: &[f32; M]) -> [f32; R] {
        let desired = preview.sample(tick);
        let mut reference = self.base.map(|channel| desired.get(channel).copied().unwrap_or(0.0));
        let network = self.network(tick, preview, measured, &reference);
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
        let network = self.lanes.network && self.primed && self.model.network().is_some();
        self.network_weight = approach(self.network_weight, network);
        self.feedback_weight = approach(self.feedback_weight, self.lanes.feedback && self.model.lane().is_some());
    }

    /// The network lane's correction at this tick; `base` is the reference without any.
    fn network<const N: usize>(
        &mut self,
        tick: i32,
        preview: &Preview<D, N>,
        measured: &[f32; M],
        base: &[f32; R],
    ) -> [f32; MAX_OUTPUTS] {
        let timing = self.model.card().timing;
        let divisor = self.divisor();
        let phase = tick.rem_euclid(divisor);
        if phase == 0 {
            self.align(tick.div_euclid(divisor), measured, base);
            if self.lanes.network || self.network_weight > 0.0 {
                let [start, end] = &mut self.ramp;
                *start = *end;
                match timing.interpolation {
                    Interpolation::Hold => self.ramp[0] = self.infer(tick, preview),
                    Interpolation::Linear => {
                        if !self.primed {
                            self.ramp[0] = self.infer(tick, preview);
                        }
                        self.ramp[1] = self.infer(tick.wrapping_add(divisor), preview);
                    }
                }
                self.primed = true;
            } else {
                self.primed = false;
            }
        }
        if !self.primed {
            return [0.0; MAX_OUTPUTS];
        }
        let [start, end] = &self.ramp;
        match timing.interpolation {
            Interpolation::Hold => *start,
            Interpolation::Linear => {
                let share = phase as f32 / divisor as f32;
                core::array::from_fn(|i| start[i] + (end[i] - start[i]) * share)
            }
        }
    }

    /// Stores the measured channels of sub-rate tick `sub_tick`. Histories start anew with the first tick that is seen and after a gap;
    /// the past reference is then the one that the loop would have got without corrections.
    fn align(&mut self, sub_tick: i32, measured: &[f32; M], base: &[f32; R]) {
        if self.references.next_tick() != sub_tick {
            self.measured = History::new([EndRule::Hold; M], sub_tick);
            self.references = History::new([EndRule::Hold; R], sub_tick.wrapping_sub(1));
            self.references.push(*base);
            self.primed = false;
        }
        self.measured.push(measured.map(finite_or_zero));
    }

    /// Evaluates the network for the sub-rate tick that falls on reference tick `target`.
    fn infer<const N: usize>(&mut self, target: i32, preview: &Preview<D, N>) -> [f32; MAX_OUTPUTS] {
        let mut outputs = [0.0; MAX_OUTPUTS];
        let Some(network) = self.model.network() else { return outputs };
        let card = self.model.card();
        let divisor = self.divisor();
        let view = View { desired: preview, measured: &self.measured, references: &self.references, divisor };
        let mut inputs = [0.0; MAX_FEATURES];
        features::evaluate(&card.features, &view, target, divisor, &mut inputs);
        network.evaluate(&inputs, &mut outputs, &mut self.scratch);
        outputs.map(finite_or_zero)
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
