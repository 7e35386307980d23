//! What the network lane can do inside of its training envelope, as proven when the file was made.
//!
//! *in* the bounds' section of the blob; *out* [`OutputBounds`] of each output; *never* numbers that contradict themselves, the
//! probes or the limits; *source* `model-export`, which computes them: see its `bounds`.
//!
//! The rule at load: bounds are finite, a low end is not above its high end, differences and slopes are not negative; a probe
//! inside of the envelope gives an output between low and high; and no output's whole range lies beyond its limit (0 switches an
//! output off): there the lane would be its own clamp and nothing else. A limit inside of the range is a decision, not an error:
//! [`OutputBounds::reach`] says so. Outside of the envelope only the limits hold.

use super::{Blob, Card, Floats, Refusal};
use crate::math::abs;

/// Numbers stored for each output.
const FIELDS: usize = 4;

/// Bounds of one output, for features within the envelope.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OutputBounds {
    /// Smallest correction that the network gives on any machine, in the output's unit.
    pub low: f32,
    /// Largest.
    pub high: f32,
    /// Largest difference from the float network that the file was made from, in the output's unit.
    pub difference: f32,
    /// Largest change of that float network's output for a change of 1 of every normalised input (one input scale each), in the
    /// output's unit: a Lipschitz constant for the maximum norm.
    pub lipschitz: f32,
}

/// How a correction within its bounds and its limit meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// No features within the envelope make the network reach the limit.
    Within,
    /// Some may.
    Partly,
    /// All do.
    Beyond,
}

impl OutputBounds {
    /// Numbers in the order in which they are stored.
    pub fn numbers(&self) -> [f32; FIELDS] {
        [self.low, self.high, self.difference, self.lipschitz]
    }

    /// Largest magnitude of the correction.
    pub fn magnitude(&self) -> f32 {
        let (low, high) = (abs(self.low), abs(self.high));
        if low > high { low } else { high }
    }

    /// Where a limit on the magnitude of the correction lies.
    pub fn reach(&self, limit: f32) -> Reach {
        if self.low > limit || self.high < -limit {
            Reach::Beyond
        } else if self.magnitude() > limit {
            Reach::Partly
        } else {
            Reach::Within
        }
    }
}

/// Bounds of every output; none of a model without a network.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bounds<'a>(Floats<'a>);

impl<'a> Bounds<'a> {
    /// Of no outputs.
    pub(crate) const EMPTY: Self = Self(Floats::EMPTY);

    /// Checks the bounds against themselves and the limits.
    pub(crate) fn new<const C: usize, const O: usize, const A: usize>(
        card: &Card<'a, C, O, A>,
        blob: &Blob<'a>,
    ) -> Result<Self, Refusal> {
        let count = if card.network.is_some() { card.outputs.len() } else { 0 };
        let bounds = Self(blob.floats(card.bounds, FIELDS * count, "output bounds")?);
        for (index, (bounds, output)) in bounds.iter().zip(&card.outputs).enumerate() {
            if bounds.low > bounds.high || bounds.difference < 0.0 || bounds.lipschitz < 0.0 {
                return Err(Refusal::Value { what: "output bounds" });
            }
            if output.limit > 0.0 && bounds.reach(output.limit) == Reach::Beyond {
                return Err(Refusal::Limit { output: index as u8 });
            }
        }
        Ok(bounds)
    }

    /// Of each output in turn.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = OutputBounds> + use<'a> {
        let numbers = self.0;
        (0..numbers.len() / FIELDS).map(move |output| {
            let number = |field: usize| numbers.get(FIELDS * output + field);
            OutputBounds { low: number(0), high: number(1), difference: number(2), lipschitz: number(3) }
        })
    }

    /// Refuses outputs that the bounds exclude for these features.
    pub(crate) fn check(&self, inputs: Floats<'a>, outputs: &[f32], envelope: &(Floats<'a>, Floats<'a>)) -> Result<(), Refusal> {
        let inside = |((low, high), input): ((f32, f32), f32)| (low..=high).contains(&input);
        if !envelope.0.iter().zip(envelope.1.iter()).zip(inputs.iter()).all(inside) {
            return Ok(());
        }
        let broken = self.iter().zip(outputs).position(|(bounds, output)| !(bounds.low..=bounds.high).contains(output));
        broken.map_or(Ok(()), |output| Err(Refusal::Bounds { output: output as u8 }))
    }
}
