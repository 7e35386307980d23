//! What a network lane can do inside of the box of its training: proven, not sampled.
//!
//! *in* the network of a model file as the firmware evaluates it, the float network it was made from, and the envelope (smallest and
//! largest value of each feature); *out* for each output, in its unit,
//!
//! - the range of what the firmware can give (back-substitution, `propagation.rs`),
//! - the largest difference between the firmware's output and [`FloatNetwork::evaluate`] (interval Jacobians, `difference.rs`),
//! - a Lipschitz constant of the float network: |Δ output| ≤ L · max |Δ input|, the inputs normalised, both points in the box
//!   (integer arithmetic moves in steps: add twice the largest difference);
//!
//! *never* a bound that a point of the box breaks, f32 rounding, codes, saturation and the tanh table included; *source* the named
//! files. Everything is computed in f64, whose own rounding is covered by 1e-12 of every sum of magnitudes, and rounded outward
//! to f32 in the end.

mod difference;
mod layered;
mod propagation;
mod relaxation;

use impromptu_firmware::model::OutputBounds;

use self::{difference::Pair, layered::Layered};
use crate::{float_network::FloatNetwork, stored_network::StoredNetwork};

/// Relative margin for the rounding of the computations here: n · 2⁻⁵³ for sums of up to 1,500 terms is 2e-13.
const MARGIN: f64 = 1e-12;

/// A closed range.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Interval {
    low: f64,
    high: f64,
}

impl Interval {
    fn magnitude(self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    fn middle(self) -> f64 {
        0.5 * (self.low + self.high)
    }

    /// Largest distance from the middle, however that was rounded.
    fn radius(self) -> f64 {
        (self.high - self.middle()).max(self.middle() - self.low)
    }

    fn widened(self, by: f64) -> Self {
        Self { low: self.low - by, high: self.high + by }
    }

    fn hull(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }
}

/// The next f32 that is not smaller.
fn upward(value: f64) -> f32 {
    let nearest = value as f32;
    if f64::from(nearest) < value { nearest.next_up() } else { nearest }
}

/// Bounds of each output of `stored`, which was made from `float`, over the box `envelope` (low and high of each feature).
pub fn bounds(stored: &StoredNetwork, float: &FloatNetwork, envelope: &[(f32, f32)]) -> Vec<OutputBounds> {
    let (first, second) = (Layered::of_network(float, envelope), Layered::of_model(stored, float, envelope));
    let (first_known, second_known) = (first.known(), second.known());
    // (x - mean) is rounded alike; the quotient by a scale and the product with its rounded reciprocal are three roundings apart.
    let rounding: Vec<f64> =
        first.inputs.iter().zip(&second.inputs).map(|(f, q)| 2.5e-7 * f.hull(*q).magnitude() + 1e-36).collect();
    let ranges = second.output_range(&second_known);
    let differences = Pair::new((&first, &first_known), (&second, &second_known), &rounding).outputs();
    let slopes = difference::slopes(&first, &first_known);
    ranges
        .into_iter()
        .zip(differences)
        .zip(slopes)
        .map(|((range, difference), lipschitz)| OutputBounds {
            low: -upward(-range.low),
            high: upward(range.high),
            difference: upward(difference),
            lipschitz: upward(lipschitz),
        })
        .collect()
}
