//! How the closed baseline loop answers a correction: what the firmware's guard judges the lanes by.
//!
//! in: an ARX model of one axis; out: the measured position after a box in the position or the velocity reference, in means over
//! monitor ticks; never: a response of the desired trajectory, which cancels from errors; source: superposition.
//!
//! The response to the velocity reference is that of the model too. The dither moves the position reference alone; what the logs
//! tell of the velocity reference comes from the trajectories, smooth as the corrections are.

use super::identification::{ArxModel, OutputEquation};

/// Mean of the measured position over each of `taps` monitor ticks of `divisor` reference ticks, from the one on in which the
/// reference is 1: of the position reference, and of the velocity reference.
pub fn box_responses(model: &ArxModel, divisor: usize, taps: usize) -> [Vec<f64>; 2] {
    let pulse = |tick: usize| f64::from(u8::from(tick < divisor));
    [simulate(model, &|tick| [pulse(tick), 0.0], divisor, taps), simulate(model, &|tick| [0.0, pulse(tick)], divisor, taps)]
}

/// The measured position at each tick from the one on in which the position reference is 1 for one tick.
pub fn impulse_response(model: &ArxModel, ticks: usize) -> Vec<f64> {
    simulate(model, &|tick| [f64::from(u8::from(tick == 0)), 0.0], 1, ticks)
}

/// The position to which a velocity reference of 1 leads in the end, s: what it weighs beside the position reference, so far
/// as the loop adds the two up before anything else.
pub fn velocity_weight(model: &ArxModel, ticks: usize) -> f64 {
    simulate(model, &|_| [0.0, 1.0], 1, ticks).last().copied().unwrap_or(0.0)
}

fn simulate(model: &ArxModel, reference: &dyn Fn(usize) -> [f64; 2], divisor: usize, taps: usize) -> Vec<f64> {
    let ticks = divisor * taps;
    let references: Vec<[f64; 2]> = (0..ticks).map(reference).collect();
    let mut measured = vec![[0.0; 2]];
    for tick in 0..ticks {
        let next = |equation: &OutputEquation| -> f64 {
            (0..model.lags().min(tick + 1))
                .map(|lag| {
                    let ([position, velocity], [position_reference, velocity_reference]) =
                        (measured[tick - lag], references[tick - lag]);
                    equation.position[lag] * position
                        + equation.velocity[lag] * velocity
                        + equation.reference_position[lag] * position_reference
                        + equation.reference_velocity[lag] * velocity_reference
                })
                .sum()
        };
        measured.push([next(&model.position), next(&model.velocity)]);
    }
    measured[..ticks]
        .chunks(divisor)
        .map(|chunk| chunk.iter().map(|[position, _]| position).sum::<f64>() / divisor as f64)
        .collect()
}
