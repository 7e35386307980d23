//! What a network lane can do inside of the box of its training: proven, not sampled.
//!
//! *in* the network of a model file as the firmware evaluates it, the float network it was made from, and the envelope (smallest
//! and largest value of each feature); *out* for each output, in its unit,
//!
//! - the range of what the firmware can give (back-substitution, `propagation.rs`),
//! - the largest difference between the firmware's output and [`FloatNetwork::evaluate`] (interval Jacobians, `difference.rs`),
//! - a Lipschitz constant of the float network: |Δ output| ≤ L · max |Δ input|, the inputs normalised, both points in the box
//!   (integer arithmetic moves in steps: add twice the largest difference);
//!
//! *never* a bound that a point of the box breaks, f32 rounding, codes, saturation and the tanh table included; *source* the
//! named files. Everything is computed in f64, whose own rounding is covered by 1e-12 of every sum of magnitudes, and rounded
//! outward to f32 in the end.

mod difference;
mod interval;
mod layered;
mod propagation;
mod relaxation;

use impromptu_firmware::model::OutputBounds;

use self::{difference::Pair, interval::upward, layered::Layered};
use crate::{float_network::FloatNetwork, stored_network::StoredNetwork};

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
