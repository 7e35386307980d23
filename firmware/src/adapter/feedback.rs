//! The feedback lane's state, and the loop's errors.
//!
//! *in* measured channels, desired ones at the time of the measurement; *out* errors, and what the lane wants on each of its
//! axes; *never* more than its clamps, which [`crate::feedback`] keeps.

use super::signals::{matched_desired, matched_error};
use crate::{
    feedback::AxisState,
    format::{MAX_ERRORS, MAX_INPUTS},
    model::Model,
    preview::Preview,
};

/// Bound of the activity, which lowers the feedback lane's authority: a millionth of it is left.
const ACTIVITY_LIMIT: f32 = 1e6;

/// Errors of each axis of the feedback lane.
pub(super) type Errors<const A: usize> = [[f32; MAX_ERRORS]; A];

/// The feedback lane's state.
#[derive(Debug)]
pub(super) struct Feedback<const A: usize> {
    axes: [AxisState; A],
    /// Activity, the variable of the gain-scheduled saturation: recent peak of what is desired of the loop and of its errors
    /// ([`crate::format::Authority`]).
    activity: f32,
}

impl<const A: usize> Feedback<A> {
    /// Nothing seen yet: all zeros.
    pub(super) const EMPTY: Self = Self { axes: [AxisState::EMPTY; A], activity: 0.0 };

    /// As [`Feedback::EMPTY`], in place.
    pub(super) fn reset(&mut self) {
        for axis in &mut self.axes {
            *axis = AxisState::EMPTY;
        }
        self.activity = 0.0;
    }

    /// Share of the fast clamps that the feedback lane may use at this tick, at which its axes have these errors.
    fn authority<const C: usize, const O: usize, const D: usize, const N: usize>(
        &mut self,
        model: &Model<'_, C, O, A>,
        tick: i32,
        preview: &Preview<D, N>,
        errors: &Errors<A>,
    ) -> f32 {
        let Some(layout) = &model.card().feedback else { return 1.0 };
        let authority = &layout.authority;
        let desired = authority.channels.iter().map(|&channel| preview.channel(tick, usize::from(channel)) / authority.scale);
        let strayed = errors.iter().map(|errors| errors[0] / authority.error_scale);
        let now = desired.chain(strayed).fold(0.0, |sum, value| sum + value * value);
        // NaN too counts as far astray; the bound lets the lane come back in seconds.
        let now = if now < ACTIVITY_LIMIT { now } else { ACTIVITY_LIMIT };
        let past = self.activity * authority.decay;
        self.activity = if now > past { now } else { past };
        1.0 / (1.0 + self.activity * self.activity)
    }

    /// The feedback lane's output on each of its axes.
    pub(super) fn step<const C: usize, const O: usize, const D: usize, const N: usize>(
        &mut self,
        model: &Model<'_, C, O, A>,
        tick: i32,
        preview: &Preview<D, N>,
        errors: &Errors<A>,
        active: bool,
    ) -> [f32; A] {
        let mut outputs = [0.0; A];
        let Some(lane) = model.feedback() else { return outputs };
        let dt = 1.0 / model.card().timing.reference_rate_hz;
        let authority = self.authority(model, tick, preview, errors);
        for (((axis, state), errors), output) in lane.axes().iter().zip(&mut self.axes).zip(errors).zip(&mut outputs) {
            *output = state.step(lane, axis, *errors, authority, dt, active);
        }
        outputs
    }

    /// Tells the lane what was applied of it.
    pub(super) fn applied<const C: usize, const O: usize>(&mut self, model: &Model<'_, C, O, A>, applied: &[f32; A]) {
        if let Some(lane) = model.feedback() {
            for (state, &value) in self.axes.iter_mut().zip(applied).take(lane.axes().len()) {
                state.applied(lane, value);
            }
        }
    }

    /// What was applied last on each axis.
    pub(super) fn last(&self) -> [f32; A] {
        self.axes.each_ref().map(AxisState::last)
    }

    /// The lane is faded out.
    pub(super) fn clear_integrals(&mut self) {
        self.axes.iter_mut().for_each(AxisState::clear_integral);
    }
}

/// Errors of each axis of the feedback lane.
pub(super) fn errors<const C: usize, const O: usize, const A: usize, const D: usize, const N: usize>(
    model: &Model<'_, C, O, A>,
    tick: i32,
    preview: &Preview<D, N>,
    measured: &[f32],
) -> Errors<A> {
    let mut errors = [[0.0; MAX_ERRORS]; A];
    let Some(lane) = model.feedback() else { return errors };
    let delay = model.card().timing.measurement_delay_ticks;
    for (axis, errors) in lane.axes().iter().zip(&mut errors) {
        for (error, channels) in errors.iter_mut().zip(&axis.layout().errors) {
            *error = matched_error(tick, delay, preview, measured, *channels);
        }
    }
    errors
}

/// What is desired of each axis of the monitor: at the time of the measurement, and now, of each reference channel that moves it;
/// `base` names the desired channel from which a reference channel starts.
pub(super) fn desired<const C: usize, const O: usize, const A: usize, const D: usize, const N: usize>(
    model: &Model<'_, C, O, A>,
    tick: i32,
    preview: &Preview<D, N>,
    base: impl Fn(usize) -> usize,
) -> ([f32; A], [[f32; MAX_INPUTS]; A]) {
    let (mut desired, mut references) = ([0.0; A], [[0.0; MAX_INPUTS]; A]);
    let Some(monitor) = model.monitor() else { return (desired, references) };
    let card = model.card();
    for (((axis, _), desired), references) in monitor.axes().iter().zip(&mut desired).zip(&mut references) {
        *desired = matched_desired(tick, card.timing.measurement_delay_ticks, preview, axis.error.1);
        for (output, reference) in axis.inputs.iter().zip(references) {
            let channel = card.outputs.get(usize::from(*output)).map_or(0, |output| usize::from(output.channel));
            *reference = preview.channel(tick, base(channel));
        }
    }
    (desired, references)
}

/// Errors of each axis of the monitor, most of which the feedback lane has already.
pub(super) fn monitored<const C: usize, const O: usize, const A: usize, const D: usize, const N: usize>(
    model: &Model<'_, C, O, A>,
    tick: i32,
    preview: &Preview<D, N>,
    measured: &[f32],
    known: &Errors<A>,
) -> [f32; A] {
    let mut errors = [0.0; A];
    let Some(monitor) = model.monitor() else { return errors };
    let delay = model.card().timing.measurement_delay_ticks;
    let lane = model.feedback().map_or(&[][..], |lane| lane.axes());
    for (index, ((axis, _), error)) in monitor.axes().iter().zip(&mut errors).enumerate() {
        let same = lane.get(index).is_some_and(|lane| lane.layout().errors.first() == Some(&axis.error));
        *error = match known.get(index) {
            Some([first, ..]) if same => *first,
            _ => matched_error(tick, delay, preview, measured, axis.error),
        };
    }
    errors
}
