//! What becomes of inferences between sub-rate ticks: held or ramped, and what happens when one is late.
//!
//! *in* when a job was released, and its inference when it comes; *out* the network lane's correction at every reference tick;
//! *never* a step when an inference is late: the correction stays where it is; *source* the sub-rate of Zhou 2017.

use super::Inference;
use crate::{format::Interpolation, math::clamp};

/// Bound of the outputs that are believed: differences of such numbers are numbers.
const LARGEST: f32 = 1e9;

/// The correction between two sub-rate ticks.
#[derive(Clone, Debug)]
pub(super) struct Ramp<const O: usize> {
    start: [f32; O],
    end: [f32; O],
    primed: bool,
    /// Reference tick whose inference is awaited, and the newest that came.
    awaited: Option<i32>,
    /// Share of its outputs that may act,
    share: f32,
    delivered: Option<Inference<O>>,
    /// Inferences in a row that did not come in time.
    missing: u16,
    late: u32,
}

impl<const O: usize> Ramp<O> {
    /// Nothing has been evaluated yet.
    pub(super) const EMPTY: Self =
        Self { start: [0.0; O], end: [0.0; O], primed: false, awaited: None, share: 0.0, delivered: None, missing: 0, late: 0 };

    /// A job was released at this reference tick, of whose outputs this share may act, 0..=1.
    pub(super) fn release(&mut self, tick: i32, share: f32) {
        (self.awaited, self.share) = (Some(tick), share);
    }

    /// Takes the result of the last job; one that is not awaited any more, or not a number in each output, is dropped.
    pub(super) fn deliver(&mut self, inference: Inference<O>) {
        if self.awaited == Some(inference.tick) && inference.outputs.iter().all(|output| output.is_finite()) {
            self.delivered = Some(inference);
        }
    }

    /// Makes the inference that was released at another tick than this one the new end, if it came.
    pub(super) fn settle(&mut self, tick: i32) {
        if self.awaited.is_some_and(|released| released != tick) {
            self.publish();
        }
    }

    /// A sub-rate tick was missed, and nothing was released at it: the correction stays.
    pub(super) fn hold(&mut self) {
        self.start = self.end;
    }

    /// Makes the awaited inference, if there is one, the new end at once.
    pub(super) fn publish(&mut self) {
        let Some(awaited) = self.awaited.take() else { return };
        let inference = self.delivered.take().filter(|inference| inference.tick == awaited);
        self.missing = if inference.is_none() { self.missing.saturating_add(1) } else { 0 };
        self.start = self.end;
        match inference {
            Some(Inference { outputs, .. }) => {
                let outputs = outputs.map(|output| clamp(output, -LARGEST, LARGEST) * self.share);
                if !self.primed {
                    self.start = outputs;
                }
                self.end = outputs;
                self.primed = true;
            }
            None => self.late = self.late.saturating_add(1),
        }
    }

    /// Forgets everything but the count of late inferences.
    pub(super) fn clear(&mut self) {
        *self = Self { late: self.late, ..Self::EMPTY };
    }

    /// Share of the newest inference that may act.
    pub(super) fn share(&self) -> f32 {
        self.share
    }

    /// Whether there is a correction, and the newest inference was in time.
    pub(super) fn current(&self) -> bool {
        self.primed && self.missing == 0
    }

    /// Those up to now, since the last one in time.
    pub(super) fn late_in_a_row(&self) -> u16 {
        self.missing
    }

    /// Inferences that did not come in time.
    pub(super) fn late(&self) -> u32 {
        self.late
    }

    /// The correction `phase` reference ticks after the last of the sub-rate ticks, which are `divisor` apart.
    pub(super) fn value(&self, interpolation: Interpolation, phase: i32, divisor: i32) -> [f32; O] {
        match interpolation {
            _ if !self.primed => [0.0; O],
            Interpolation::Linear if phase != 0 => {
                let share = phase as f32 / divisor as f32;
                let mut between = self.start;
                for (value, end) in between.iter_mut().zip(&self.end) {
                    *value += (end - *value) * share;
                }
                between
            }
            // At a sub-rate tick the ramp of the last one has ended.
            _ => self.end,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn inference(tick: i32, value: f32) -> Inference {
        Inference { tick, outputs: [value; _] }
    }

    #[test]
    fn a_late_inference_is_counted_and_the_correction_stays_until_one_is_in_time() {
        let mut ramp = Ramp::EMPTY;
        let value = |ramp: &Ramp<8>, phase| ramp.value(Interpolation::Linear, phase, 4)[0];
        ramp.release(0, 1.0);
        assert_eq!(value(&ramp, 0), 0.0);
        ramp.deliver(inference(0, 2.0));
        ramp.settle(1);
        assert_eq!([1, 2, 3].map(|phase| value(&ramp, phase)), [2.0; 3]);
        ramp.release(4, 1.0);
        // The result of another tick is not the awaited one.
        ramp.deliver(inference(0, 9.0));
        ramp.settle(5);
        assert!(!ramp.current() && ramp.late() == 1);
        assert_eq!([1, 3].map(|phase| value(&ramp, phase)), [2.0; 2]);
        // It comes when nobody waits for it any more.
        ramp.deliver(inference(4, 9.0));
        ramp.release(8, 1.0);
        ramp.deliver(inference(8, 6.0));
        ramp.settle(9);
        assert!(ramp.current() && ramp.late() == 1);
        assert_eq!([1, 2, 0].map(|phase| value(&ramp, phase)), [3.0, 4.0, 6.0]);
    }
}
