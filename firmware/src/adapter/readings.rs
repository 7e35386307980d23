//! What an adapter did in the last tick, and how often.
//!
//! *in* an adapter; *out* corrections, weights and counts; *never* a change of it; *source* what reports and other parts of an
//! application ask for.

use super::{Adapter, tick};
use crate::model::Model;

impl<const D: usize, const M: usize, const R: usize, const C: usize, const O: usize, const A: usize>
    Adapter<'_, D, M, R, C, O, A>
{
    /// Correction of each output of the model in the last tick.
    pub fn correction(&self) -> [f32; O] {
        self.model.map_or([0.0; O], |model| self.correction.of_outputs(model.card()))
    }

    /// Correction of each reference channel in the last tick, and its largest change in one, in the channel's unit.
    pub fn corrections(&self) -> (&[f32; R], &[f32; R]) {
        self.correction.of_channels()
    }

    /// The reference without any correction, of these desired channels.
    pub fn uncorrected(&self, desired: &[f32; D]) -> [f32; R] {
        tick::base(&self.base, desired)
    }

    /// What the feedback lane corrected of each reference channel in the last tick, in the channel's unit.
    pub fn fed_back(&self) -> [f32; R] {
        let (mut channels, card) = ([0.0; R], self.model.map(Model::card));
        let Some((card, layout)) = card.and_then(|card| Some((card, card.feedback.as_ref()?))) else { return channels };
        for (axis, applied) in layout.axes.iter().zip(self.feedback.last()) {
            let channel = card.outputs.get(usize::from(axis.output)).map(|output| usize::from(output.channel));
            if let Some(place) = channel.and_then(|channel| channels.get_mut(channel)) {
                *place += applied;
            }
        }
        channels
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

    /// Inferences that did not come in time. The correction then stays as it is and fades out until one does.
    pub fn late(&self) -> u32 {
        self.ramp.late()
    }
}
