//! Both lanes added, within the application's bounds and the model's limits and slew.
//!
//! *in* what each lane wants and how far it is faded in; *out* the correction, and what each lane has of it; *never* more than an
//! output's limit, nor more than its slew from one tick to the next, also where models change: what one left goes by its slew.

use crate::{
    caps::Bounds,
    format::Card,
    guard::{Outcome, Shares},
    math::clamp,
};

/// What the lanes want of a reference tick.
pub(super) struct Wanted<const O: usize, const A: usize> {
    /// Of each output.
    pub(super) network: [f32; O],
    /// Of each axis of the feedback lane.
    pub(super) feedback: [f32; A],
    /// How far the lanes are faded in, 0..=1.
    pub(super) network_weight: f32,
    pub(super) feedback_weight: f32,
}

/// The correction of the last tick.
#[derive(Debug)]
pub(super) struct Correction<const R: usize> {
    /// Of each reference channel, in its unit.
    values: [f32; R],
    /// Largest change of each in a tick, as it was when the channel was last corrected.
    slews: [f32; R],
    pub(super) saturations: u32,
}

impl<const R: usize> Correction<R> {
    /// None.
    pub(super) const NONE: Self = Self { values: [0.0; R], slews: [0.0; R], saturations: 0 };

    /// Whether a correction is left. The slew may need longer than the fade.
    pub(super) fn left(&self) -> bool {
        self.values.iter().any(|value| *value != 0.0)
    }

    /// The correction of each output of a model, in its channel's unit.
    pub(super) fn of_outputs<const C: usize, const O: usize, const A: usize>(&self, card: &Card<'_, C, O, A>) -> [f32; O] {
        let mut values = [0.0; O];
        for (value, output) in values.iter_mut().zip(&card.outputs) {
            *value = self.values.get(usize::from(output.channel)).copied().unwrap_or(0.0);
        }
        values
    }

    /// The correction of each reference channel, and its largest change in a tick.
    pub(super) fn of_channels(&self) -> (&[f32; R], &[f32; R]) {
        (&self.values, &self.slews)
    }

    /// None at once: for a loop at rest.
    pub(super) fn reset(&mut self) {
        self.values = [0.0; R];
    }

    /// Adds the lanes to `reference`, within limits and slew; the feedback lane's part by way of `path`. Returns what each axis
    /// of the feedback lane has got, in the outputs' units.
    pub(super) fn apply<const C: usize, const O: usize, const A: usize>(
        &mut self,
        card: &Card<'_, C, O, A>,
        bounds: &Bounds<R, A>,
        wanted: &Wanted<O, A>,
        path: impl FnOnce(&mut [f32; A]),
        reference: &mut [f32; R],
        outcome: &mut Outcome<O, A>,
    ) -> [f32; A] {
        let mut asked = wanted.feedback.map(|value| value * wanted.feedback_weight);
        path(&mut asked);
        let mut feedback = [None; O];
        let axes = card.feedback.iter().flat_map(|lane| &lane.axes);
        for (axis, value) in axes.clone().zip(asked) {
            if let Some(place) = feedback.get_mut(usize::from(axis.output)) {
                *place = Some(value);
            }
        }
        shadow(card, &wanted.network, outcome);
        let lanes = wanted.network.iter().zip(&feedback);
        // What is no output of this model was one of another: it goes.
        let mut targets = [0.0; R];
        for (output, (network, feedback)) in card.outputs.iter().zip(lanes.clone()) {
            let channel = usize::from(output.channel);
            let (limit, most) = bounds.channel(channel);
            let limit = least(output.limit, limit);
            if let (Some(target), Some(slew)) = (targets.get_mut(channel), self.slews.get_mut(channel)) {
                *slew = least(output.slew, most);
                *target = clamp(network * wanted.network_weight + feedback.unwrap_or(0.0), -limit, limit);
            }
        }
        self.approach(&targets, bounds);
        for (channel, value) in reference.iter_mut().zip(&self.values) {
            // Not even an addition of zero: the baseline's bits.
            if *value != 0.0 {
                *channel += *value;
            }
        }
        let Outcome { shares, excess, .. } = outcome;
        let mut lost = [0.0; O];
        let parts = shares.network.iter_mut().zip(&mut shares.feedback).zip(&mut lost);
        let mut saturated = false;
        for ((output, ((network_part, feedback_part), lost)), (network, feedback)) in card.outputs.iter().zip(parts).zip(lanes) {
            let value = self.values.get(usize::from(output.channel)).copied().unwrap_or(0.0);
            let network = network * wanted.network_weight;
            *lost = value - (network + feedback.unwrap_or(0.0));
            // What the bounds take is the feedback lane's loss, which knows what to do about it.
            let shared = feedback.is_some() && wanted.feedback_weight > 0.0;
            *network_part = if shared { clamp(network, -output.limit, output.limit) } else { value };
            *feedback_part = value - *network_part;
            if *lost != 0.0 {
                saturated = true;
                // A limit of zero switches the output off.
                let asks = |part: f32| output.limit > 0.0 && part * *lost < 0.0;
                *excess = [excess[0] | asks(network), excess[1] | asks(feedback.unwrap_or(0.0))];
            }
        }
        self.saturations = self.saturations.saturating_add(u32::from(saturated));
        let mut applied = [0.0; A];
        for ((axis, value), got) in axes.zip(wanted.feedback).zip(&mut applied) {
            *got = value * wanted.feedback_weight + lost.get(usize::from(axis.output)).copied().unwrap_or(0.0);
        }
        applied
    }

    /// Goes towards targets that are within the channels' limits, by their slew, and within what is bounded together.
    fn approach<const A: usize>(&mut self, targets: &[f32; R], bounds: &Bounds<R, A>) {
        let last = self.values;
        for ((value, target), slew) in self.values.iter_mut().zip(targets).zip(&self.slews) {
            *value = clamp(*target, *value - slew, *value + slew);
        }
        bounds.bound_sums(&last, &mut self.values, &self.slews);
    }

    /// Adds what is left of a correction that no model asks for any more; by its slew it goes.
    pub(super) fn fade<const A: usize>(&mut self, bounds: &Bounds<R, A>, reference: &mut [f32; R]) {
        self.approach(&[0.0; R], bounds);
        for (channel, value) in reference.iter_mut().zip(&self.values) {
            if *value != 0.0 {
                *channel += *value;
            }
        }
    }

    /// No correction; not even an addition of zero: the baseline's bits.
    pub(super) fn clear<const C: usize, const O: usize, const A: usize>(
        &mut self,
        card: &Card<'_, C, O, A>,
        wanted: &Wanted<O, A>,
        outcome: &mut Outcome<O, A>,
    ) -> [f32; A] {
        self.values = [0.0; R];
        shadow(card, &wanted.network, outcome);
        [0.0; A]
    }
}

fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// An outcome in which nothing was applied, with what the network lane would do without the other.
fn shadow<const C: usize, const O: usize, const A: usize>(
    card: &Card<'_, C, O, A>,
    network: &[f32; O],
    outcome: &mut Outcome<O, A>,
) {
    (outcome.shares, outcome.excess) = (Shares::NONE, [false; 2]);
    for ((only, network), output) in outcome.shares.network_only.iter_mut().zip(network).zip(&card.outputs) {
        *only = clamp(*network, -output.limit, output.limit);
    }
}
