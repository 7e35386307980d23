//! How far the add-on's loop is from instability.
//!
//! in: a model of the closed baseline loop with a longer memory than the one designed on, and a lane; out: gain, phase, delay and
//! modulus margins at the add-on's output; never: a margin of a loop that is not stable to begin with; source: Nyquist's
//! criterion on the loop opened at the position reference (Åström and Murray, Feedback Systems, chapter 10).

use std::f64::consts::PI;

use nalgebra::Complex;
use serde::{Deserialize, Serialize};

use super::error_model::{ErrorModel, reference_response};
use super::identification::ArxModel;
use super::lane::LaneGain;
use super::riccati::spectral_radius;

/// Margins of a stable loop; nothing stands for "unlimited".
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoopMargins {
    /// Smallest factor above 1 on the loop's gain which makes it unstable.
    pub gain_up: Option<f64>,
    /// Largest factor below 1 on the loop's gain which makes it unstable (conditionally stable loops).
    pub gain_down: Option<f64>,
    /// Smallest rotation, in either direction, which makes the loop unstable, degrees.
    pub phase_degrees: Option<f64>,
    /// Smallest additional delay between the add-on's output and its measurement which makes the loop unstable, ms.
    pub delay_milliseconds: Option<f64>,
    /// Smallest distance of the loop's transfer function from -1.
    pub modulus: f64,
    /// Frequencies where the loop's gain passes 1, rad/s, ascending.
    pub crossovers: Vec<f64>,
}

/// Nominal stability, and margins if there is any to lose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoopAssessment {
    /// Largest absolute eigenvalue of model and lane together; below 1 means stable.
    pub spectral_radius: f64,
    /// Nothing when the loop is unstable.
    pub margins: Option<LoopMargins>,
}

/// Assesses `lane` on `model`, at a tick in s.
pub fn assess(model: &ArxModel, lane: &LaneGain, tick: f64) -> LoopAssessment {
    let lags = model.lags().max(lane.lags());
    let errors = ErrorModel::new(model, lags, tick);
    let feedback = lane.state_feedback(lags);
    let mut closed = &errors.dynamics - &errors.input * &feedback;
    if lane.integral_coefficient == 0.0 {
        // Nothing reads the integral: its eigenvalue of 1 is not part of the loop.
        let last = closed.nrows() - 1;
        closed = closed.remove_row(last).remove_column(last);
    }
    let spectral_radius = spectral_radius(&closed);
    let transfer = |z| loop_transfer(model, lane, z, tick);
    LoopAssessment { spectral_radius, margins: (spectral_radius < 1.0).then(|| margins_of(transfer, tick)) }
}

/// Transfer function of the loop opened at the add-on's output, in the sign convention of a characteristic
/// equation `1 + L = 0`.
pub fn loop_transfer(model: &ArxModel, lane: &LaneGain, z: Complex<f64>, tick: f64) -> Complex<f64> {
    let [position, velocity] = reference_response(model, z);
    let [from_position, from_velocity] = lane.response(z, tick);
    -(from_position * position + from_velocity * velocity)
}

/// Points of the logarithmic frequency grid; near the highest frequency they are a thousandth of it apart.
const GRID_POINTS: usize = 6000;
/// The lowest frequency is this many times below the highest: 0.0025 Hz at 100 Hz, far below the integral's action.
const GRID_SPAN: f64 = 2e4;

/// Margins of a stable loop with transfer function `transfer` at `z` = exp(j w tick).
pub fn margins_of(transfer: impl Fn(Complex<f64>) -> Complex<f64>, tick: f64) -> LoopMargins {
    let at = |frequency: f64| transfer(Complex::from_polar(1.0, frequency * tick));
    let highest = PI / tick;
    let grid: Vec<(f64, Complex<f64>)> = (0..=GRID_POINTS)
        .map(|index| highest * GRID_SPAN.powf(index as f64 / GRID_POINTS as f64 - 1.0))
        .map(|frequency| (frequency, at(frequency)))
        .collect();

    let mut crossovers = Vec::new();
    let mut real_crossings = Vec::new();
    let mut modulus = f64::INFINITY;
    for (index, pair) in grid.windows(2).enumerate() {
        let [(low, before), (high, after)] = [pair[0], pair[1]];
        if (before.norm() - 1.0) * (after.norm() - 1.0) < 0.0 {
            crossovers.push(root(|frequency| at(frequency).norm() - 1.0, low, high));
        }
        if before.im * after.im < 0.0 && (before.re < 0.0 || after.re < 0.0) {
            let value = at(root(|frequency| at(frequency).im, low, high));
            // The imaginary part also changes its sign through infinity, at a pole: that is no crossing.
            if value.im.abs() < 1e-3 * value.norm() {
                real_crossings.push(value.re);
            }
        }
        let distance = (1.0 + after).norm();
        let next = grid.get(index + 2).map_or(f64::INFINITY, |point| (1.0 + point.1).norm());
        if distance <= (1.0 + before).norm() && distance <= next {
            let end = grid.get(index + 2).map_or(highest, |point| point.0);
            modulus = modulus.min(smallest(|frequency| (1.0 + at(frequency)).norm(), low, end));
        }
    }
    modulus = modulus.min((1.0 + grid[0].1).norm());
    // The transfer function is real at both ends of the axis (infinite at the lower one with an integral).
    let lower_end = transfer(Complex::new(1.0, 0.0)).re;
    real_crossings.extend([lower_end, grid[GRID_POINTS].1.re]);

    let factors = real_crossings.into_iter().filter(|real| *real < 0.0 && real.is_finite()).map(|real| -1.0 / real);
    let mut phase: Option<f64> = None;
    let mut delay: Option<f64> = None;
    for &frequency in &crossovers {
        // Rotation, clockwise, from the loop's value to -1: within (0, 2 pi).
        let clockwise = (at(frequency).arg() + PI).rem_euclid(2.0 * PI);
        let either = clockwise.min(2.0 * PI - clockwise).to_degrees();
        phase = Some(phase.map_or(either, |least| least.min(either)));
        let time = 1e3 * clockwise / frequency;
        delay = Some(delay.map_or(time, |least| least.min(time)));
    }
    LoopMargins {
        gain_up: factors.clone().filter(|factor| *factor > 1.0).min_by(f64::total_cmp),
        gain_down: factors.filter(|factor| *factor < 1.0).max_by(f64::total_cmp),
        phase_degrees: phase,
        delay_milliseconds: delay,
        modulus,
        crossovers,
    }
}

/// Root of `function`, which has different signs at `low` and `high`, by bisection.
fn root(function: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let negative_at_low = function(low) < 0.0;
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if (function(middle) < 0.0) == negative_at_low {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Smallest value of `function`, which has one minimum between `low` and `high`, by thirds.
fn smallest(function: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..40 {
        let third = (high - low) / 3.0;
        if function(low + third) < function(high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    function(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::feedback_design::identification::OutputEquation;

    const TICK: f64 = 0.01;

    /// p(k+1) = p(k) + slope r(k - delay): an integrator with a delay, which feedback on the position has to stabilise.
    fn delayed_integrator(slope: f64, delay: usize) -> ArxModel {
        let lags = delay + 1;
        let mut position = OutputEquation {
            position: vec![0.0; lags],
            velocity: vec![0.0; lags],
            reference_position: vec![0.0; lags],
            reference_velocity: vec![0.0; lags],
        };
        let velocity = position.clone();
        position.position[0] = 1.0;
        position.reference_position[delay] = slope;
        ArxModel { position, velocity, residual: [0.0; 2] }
    }

    fn close(value: Option<f64>, expected: f64) -> bool {
        value.is_some_and(|value| (value - expected).abs() < 0.01 * expected)
    }

    #[test]
    fn integrator_with_delay_has_its_textbook_margins() {
        // In continuous time: gain margin pi/(2 k T), crossover k, phase margin pi/2 - k T, delay margin pi/(2k) - T, with
        // T the delay and half a tick of hold on top of the tick that the model itself has.
        let (slope, delay) = (0.02, 29);
        let (rate, lag) = (slope / TICK, (delay as f64 + 0.5) * TICK);
        let assessment = assess(&delayed_integrator(slope, delay), &LaneGain::pd(1.0, 0.0), TICK);
        let margins = assessment.margins.unwrap();
        assert!(close(margins.gain_up, PI / (2.0 * rate * lag)), "{margins:?}");
        assert_eq!(margins.gain_down, None);
        assert!(close(margins.phase_degrees, (PI / 2.0 - rate * lag).to_degrees()), "{margins:?}");
        assert!(close(margins.delay_milliseconds, 1e3 * (PI / (2.0 * rate) - lag)), "{margins:?}");
        assert!(margins.crossovers.len() == 1 && close(Some(margins.crossovers[0]), rate));
        assert!(margins.modulus > 0.3 && margins.modulus < 1.0);
    }

    #[test]
    fn stability_ends_where_the_margins_say() {
        let (slope, delay) = (0.02, 29);
        let radius =
            |gain: f64, delay: usize| assess(&delayed_integrator(slope, delay), &LaneGain::pd(gain, 0.0), TICK).spectral_radius;
        let margins = assess(&delayed_integrator(slope, delay), &LaneGain::pd(1.0, 0.0), TICK).margins.unwrap();
        let gain = margins.gain_up.unwrap();
        assert!(radius(gain * 0.995, delay) < 1.0 && radius(gain * 1.005, delay) > 1.0);
        let ticks = (margins.delay_milliseconds.unwrap() / 10.0).floor() as usize;
        assert!(radius(1.0, delay + ticks) < 1.0 && radius(1.0, delay + ticks + 1) > 1.0);
    }

    #[test]
    fn conditionally_stable_loop_has_a_lower_gain_margin() {
        // L = (z - 0.5) / ((z - 1.2)(z - 0.3)), unstable when opened: from L(1) = -1/0.28 to L(-1) = -1.5/2.86.
        let transfer = |z: Complex<f64>| (z - 0.5) / ((z - 1.2) * (z - 0.3));
        let margins = margins_of(transfer, TICK);
        assert!(close(margins.gain_down, 0.28), "{margins:?}");
        assert!(close(margins.gain_up, 2.86 / 1.5), "{margins:?}");
    }

    #[test]
    fn an_unstable_loop_has_no_margins() {
        let assessment = assess(&delayed_integrator(0.02, 29), &LaneGain::pd(4.0, 0.0), TICK);
        assert!(assessment.spectral_radius > 1.0);
        assert_eq!(assessment.margins, None);
    }
}
