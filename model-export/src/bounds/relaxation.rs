//! Straight lines below and above an activation function over an interval.

use super::interval::{Interval, MARGIN};
use crate::float_network::Activation;

/// slope × z + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Line {
    pub(super) slope: f64,
    pub(super) offset: f64,
}

/// An activation with its saturation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Function {
    pub(super) activation: Activation,
    pub(super) clip: f64,
}

impl Function {
    pub(super) fn value(self, z: f64) -> f64 {
        match self.activation {
            Activation::Linear => z.clamp(-self.clip, self.clip),
            Activation::Relu => z.clamp(0.0, self.clip),
            Activation::Tanh => z.tanh(),
        }
    }

    /// The function is monotonic.
    pub(super) fn range(self, z: Interval) -> Interval {
        Interval { low: self.value(z.low) - MARGIN, high: self.value(z.high) + MARGIN }
    }

    /// All values of the derivative of the function without its saturation.
    pub(super) fn derivative(self, z: Interval) -> Interval {
        let (low, high) = match self.activation {
            Activation::Linear => (1.0, 1.0),
            Activation::Relu => (f64::from(u8::from(z.low > 0.0)), f64::from(u8::from(z.high > 0.0))),
            Activation::Tanh => {
                let slope = |z: f64| 1.0 - z.tanh() * z.tanh();
                let ends = [slope(z.low), slope(z.high)];
                let top = if z.low <= 0.0 && z.high >= 0.0 { 1.0 } else { ends[0].max(ends[1]) };
                ((ends[0].min(ends[1]) - MARGIN).max(0.0), (top + MARGIN).min(1.0))
            }
        };
        Interval { low, high }
    }

    /// Smallest and largest value of function(z) - slope · z: at the ends, the corners, or where the derivative is the slope.
    fn offsets(self, slope: f64, z: Interval) -> Interval {
        let turns = match self.activation {
            Activation::Linear => [-self.clip, self.clip],
            Activation::Relu => [0.0, self.clip],
            Activation::Tanh if slope > 0.0 && slope < 1.0 => {
                let turn = (1.0 - slope).sqrt().atanh();
                [-turn, turn]
            }
            Activation::Tanh => [z.low, z.high],
        };
        let inside = turns.into_iter().filter(|turn| *turn > z.low && *turn < z.high);
        let mut range = Interval { low: f64::INFINITY, high: f64::NEG_INFINITY };
        for place in inside.chain([z.low, z.high]) {
            let offset = self.value(place) - slope * place;
            let margin = MARGIN * (1.0 + (slope * place).abs());
            range = Interval { low: range.low.min(offset - margin), high: range.high.max(offset + margin) };
        }
        range
    }

    /// The lines below and above that are nearest to the function at the middle of the interval, among a few.
    pub(super) fn lines(self, z: Interval) -> [Line; 2] {
        let middle = z.middle();
        let width = z.high - z.low;
        let chord = if width > 0.0 { (self.value(z.high) - self.value(z.low)) / width } else { 0.0 };
        let tangent = |z: f64| if self.activation == Activation::Tanh { 1.0 - z.tanh() * z.tanh() } else { 1.0 };
        let slopes = [chord, 0.0, tangent(middle), tangent(z.low), tangent(z.high)];
        let candidates = slopes.map(|slope| (slope, self.offsets(slope, z)));
        let best = |offset: &dyn Fn(Interval) -> f64, sign: f64| {
            let lines = candidates.iter().map(|(slope, offsets)| Line { slope: *slope, offset: offset(*offsets) });
            let height = |line: &Line| sign * (line.slope * middle + line.offset);
            lines.fold(None, |best: Option<Line>, line| Some(best.filter(|best| height(best) >= height(&line)).unwrap_or(line)))
        };
        let nothing = Line { slope: 0.0, offset: 0.0 };
        [best(&|offsets| offsets.low, 1.0).unwrap_or(nothing), best(&|offsets| offsets.high, -1.0).unwrap_or(nothing)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn function_and_derivative_stay_between_their_bounds(
            kind in 0..3usize,
            clip in prop_oneof![Just(f64::INFINITY), 0.1..4.0],
            low in -12.0..8.0f64,
            width in 0.0..12.0f64,
            share in 0.0..=1.0f64,
        ) {
            let activation = [Activation::Linear, Activation::Relu, Activation::Tanh][kind];
            let clip = if activation == Activation::Tanh { f64::INFINITY } else { clip };
            let function = Function { activation, clip };
            let range = Interval { low, high: low + width };
            let z = low + width * share;
            let [below, above] = function.lines(range);
            let value = function.value(z);
            prop_assert!(below.slope * z + below.offset <= value && value <= above.slope * z + above.offset);
            let unclipped = Function { activation, clip: f64::INFINITY };
            let slope = (unclipped.value(low + width) - unclipped.value(z)) / (low + width - z).max(1e-3);
            let derivative = unclipped.derivative(range);
            let at_the_end = share > 0.99 || low + width - z < 1e-3;
            prop_assert!(slope <= derivative.high + 1e-9 && (at_the_end || slope >= derivative.low - 1e-9));
        }
    }
}
