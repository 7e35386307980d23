//! Both lanes added, within the model's limits and slew.
//!
//! *in* what each lane wants and how far it is faded in; *out* the correction, and what each lane has of it; *never* more than an
//! output's limit, nor more than its slew from one tick to the next.

use crate::{
    format::{Card, MAX_AXES, MAX_OUTPUTS},
    guard::{Outcome, Shares},
    math::clamp,
};

/// What the lanes want of a reference tick.
pub(super) struct Wanted {
    /// Of each output.
    pub(super) network: [f32; MAX_OUTPUTS],
    /// Of each axis of the feedback lane.
    pub(super) feedback: [f32; MAX_AXES],
    /// How far the lanes are faded in, 0..=1.
    pub(super) network_weight: f32,
    pub(super) feedback_weight: f32,
}

/// The correction of the last tick.
#[derive(Debug)]
pub(super) struct Correction {
    pub(super) values: [f32; MAX_OUTPUTS],
    pub(super) saturations: u32,
}

impl Correction {
    /// None.
    pub(super) const NONE: Self = Self { values: [0.0; MAX_OUTPUTS], saturations: 0 };

    /// Whether a correction is left. The slew may need longer than the fade.
    pub(super) fn left(&self) -> bool {
        self.values.iter().any(|value| *value != 0.0)
    }

    /// Adds the lanes to `reference`, within limits and slew; the feedback lane's part by way of `path`. Returns what each axis
    /// of the feedback lane has got, in the outputs' units.
    pub(super) fn apply(
        &mut self,
        card: &Card<'_>,
        wanted: &Wanted,
        path: impl FnOnce(&mut [f32; MAX_AXES]),
        reference: &mut [f32],
        outcome: &mut Outcome,
    ) -> [f32; MAX_AXES] {
        let mut asked = wanted.feedback.map(|value| value * wanted.feedback_weight);
        path(&mut asked);
        let mut feedback = [None; MAX_OUTPUTS];
        let axes = card.feedback.iter().flat_map(|lane| &lane.axes);
        for (axis, value) in axes.clone().zip(asked) {
            if let Some(place) = feedback.get_mut(usize::from(axis.output)) {
                *place = Some(value);
            }
        }
        shadow(card, &wanted.network, outcome);
        let Outcome { shares, excess, .. } = outcome;
        let mut lost = [0.0; MAX_OUTPUTS];
        let parts = shares.network.iter_mut().zip(&mut shares.feedback).zip(&mut lost);
        let lanes = wanted.network.iter().zip(&feedback);
        let mut saturated = false;
        for (((output, value), ((network_part, feedback_part), lost)), (network, feedback)) in
            card.outputs.iter().zip(&mut self.values).zip(parts).zip(lanes)
        {
            let network = network * wanted.network_weight;
            let sum = network + feedback.unwrap_or(0.0);
            let slewed = clamp(sum, *value - output.slew, *value + output.slew);
            *value = clamp(slewed, -output.limit, output.limit);
            *lost = *value - sum;
            if let Some(channel) = reference.get_mut(usize::from(output.channel)) {
                *channel += *value;
            }
            // What the bounds take is the feedback lane's loss, which knows what to do about it.
            let shared = feedback.is_some() && wanted.feedback_weight > 0.0;
            *network_part = if shared { clamp(network, -output.limit, output.limit) } else { *value };
            *feedback_part = *value - *network_part;
            if *lost != 0.0 {
                saturated = true;
                // A limit of zero switches the output off.
                let asks = |part: f32| output.limit > 0.0 && part * *lost < 0.0;
                *excess = [excess[0] | asks(network), excess[1] | asks(feedback.unwrap_or(0.0))];
            }
        }
        self.saturations = self.saturations.saturating_add(u32::from(saturated));
        let mut applied = [0.0; MAX_AXES];
        for ((axis, value), got) in axes.zip(wanted.feedback).zip(&mut applied) {
            *got = value * wanted.feedback_weight + lost.get(usize::from(axis.output)).copied().unwrap_or(0.0);
        }
        applied
    }

    /// No correction; not even an addition of zero: the baseline's bits.
    pub(super) fn clear(&mut self, card: &Card<'_>, wanted: &Wanted, outcome: &mut Outcome) -> [f32; MAX_AXES] {
        self.values = [0.0; MAX_OUTPUTS];
        shadow(card, &wanted.network, outcome);
        [0.0; MAX_AXES]
    }
}

/// An outcome in which nothing was applied, with what the network lane would do without the other.
fn shadow(card: &Card<'_>, network: &[f32; MAX_OUTPUTS], outcome: &mut Outcome) {
    (outcome.shares, outcome.excess) = (Shares::NONE, [false; 2]);
    for ((only, network), output) in outcome.shares.network_only.iter_mut().zip(network).zip(&card.outputs) {
        *only = clamp(*network, -output.limit, output.limit);
    }
}
