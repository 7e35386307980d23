//! The age of what is measured, from a signal that is fresher.
//!
//! *in* logs of an axis with a column that the position follows from: its velocity or its acceleration, but for a factor and a
//! constant; *out* an age with its standard error, or that none can be told; *never* an age from reference and position alone: a
//! loop that is later and one that is told later look the same; *source* ours: both signals go through the same band-pass, one of
//! them integrated on the way, and are laid over each other at the shift that leaves least, beside the position's own integral:
//! drag or friction, which else would look like a shift.
//!
//! The band lies where the loop's own motions are: the constant, and what drifts in an integral, is below it; noise above.

use impromptu_diagnosis::prediction::root_mean_square;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use crate::{
    description::FreshKind,
    reading::{AxisSignals, at},
};

/// An age.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Age {
    /// s.
    pub seconds: f64,
    /// Standard error, s, from stretches of the logs.
    pub error_s: f64,
}

/// Why the age of what is measured must be told.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the age of what is measured cannot be told from reference and position alone ({why}): say it with --delay-ms or age_ms in \
     the description, or log a fresher signal (`fresh`: attitude, acceleration, motor current). {cost}"
)]
pub struct UnknownAge {
    /// Why no fresher signal told it.
    pub why: String,
    /// What a wrong value costs.
    pub cost: String,
}

/// Oldest measurement that is looked for, and steps in which, s.
const OLDEST_S: f64 = 0.15;
/// Ticks by which a fresher signal may come later than the position.
const BEFORE: f64 = 4.0;
/// A stretch of a log, s, times the loop's time constant, that gives an estimate of its own.
const STRETCH: f64 = 20.0;
/// Largest standard error with which an age is told, s.
const SURE_S: f64 = 0.005;
/// Share of the position's band-passed variance that the fresher signal has to explain.
const LEAST_EXPLAINED: f64 = 0.3;

/// One pass of first order, forwards: low below `hz`.
fn low(values: &[f64], hz: f64, rate_hz: f64) -> Vec<f64> {
    let share = 1.0 - (-std::f64::consts::TAU * hz / rate_hz).exp();
    let mut state = values.first().copied().unwrap_or(0.0);
    values
        .iter()
        .map(|value| {
            state += share * (value - state);
            state
        })
        .collect()
}

fn high(values: &[f64], hz: f64, rate_hz: f64) -> Vec<f64> {
    low(values, hz, rate_hz).iter().zip(values).map(|(low, value)| value - low).collect()
}

/// Trapezoids.
fn integral(values: &[f64], rate_hz: f64) -> Vec<f64> {
    let mut sum = 0.0;
    let mut before = values.first().copied().unwrap_or(0.0);
    values
        .iter()
        .map(|value| {
            sum += 0.5 * (value + before) / rate_hz;
            before = *value;
            sum
        })
        .collect()
}

/// The band: three high passes, so that two integrals of a constant go, and two low ones.
fn band(mut values: Vec<f64>, integrals: usize, [low_hz, high_hz]: [f64; 2], rate_hz: f64) -> Vec<f64> {
    for pass in 0..3 {
        values = high(&values, low_hz, rate_hz);
        if pass < integrals {
            values = integral(&values, rate_hz);
        }
    }
    low(&low(&values, high_hz, rate_hz), high_hz, rate_hz)
}

/// A stretch of both signals, and of the position's own integral.
struct Stretch<'a> {
    position: &'a [f64],
    follows: &'a [f64],
    drag: &'a [f64],
    range: std::ops::Range<usize>,
}

impl Stretch<'_> {
    /// What a shift, ticks, leaves of the position, with what drag or friction takes from it.
    fn left(&self, shift: f64) -> f64 {
        let (mut gram, mut cross, mut power) = (Matrix2::zeros(), Vector2::zeros(), 0.0);
        for tick in self.range.clone() {
            let row = Vector2::new(at(self.follows, tick as f64 - shift), self.drag[tick]);
            gram += row * row.transpose();
            cross += row * self.position[tick];
            power += self.position[tick] * self.position[tick];
        }
        match gram.lu().solve(&cross) {
            Some(weights) => power - weights.dot(&cross),
            None => power,
        }
    }

    /// The shift, ticks, at which the fresher signal explains most of the position, if it explains enough; `most` is the largest.
    fn shift(&self, most: f64) -> Option<f64> {
        let steps = (4.0 * most).ceil() as usize;
        let of = |step: usize| {
            let shift = (step as f64 / steps as f64) * (most + BEFORE) - BEFORE;
            (shift, self.left(shift))
        };
        let all: Vec<(f64, f64)> = (0..=steps).map(of).collect();
        let best = (0..all.len()).min_by(|a, b| all[*a].1.total_cmp(&all[*b].1))?;
        let without = self.range.clone().map(|tick| self.position[tick] * self.position[tick]).sum::<f64>();
        if best == 0 || best + 1 == all.len() || all[best].1 > (1.0 - LEAST_EXPLAINED) * without {
            return None;
        }
        // A parabola through the least and its neighbours.
        let points = [all[best - 1], all[best], all[best + 1]];
        let matrix = Matrix3::from_fn(|row, column| (points[row].0 - points[1].0).powi(column as i32));
        let [_, slope, curve]: [f64; 3] = matrix.lu().solve(&Vector3::from_fn(|row, _| points[row].1))?.into();
        Some(points[1].0 - 0.5 * slope / curve)
    }
}

/// The age from logs of an axis at this rate, of a loop with this time constant. `None` if the fresher signal does not tell.
pub fn estimated(logs: &[(&AxisSignals, FreshKind)], rate_hz: f64, time_constant_s: f64) -> Option<Age> {
    let band_hz = [0.3 / time_constant_s, (3.0 / time_constant_s).min(0.2 * rate_hz)];
    let mut shifts = Vec::new();
    for (signals, kind) in logs {
        let Some(fresh) = &signals.fresh else { continue };
        let integrals = match kind {
            FreshKind::Velocity => 1,
            FreshKind::Acceleration => 2,
        };
        let position = band(signals.measured.clone(), 0, band_hz, rate_hz);
        let follows = band(fresh.clone(), integrals, band_hz, rate_hz);
        let drag = match kind {
            FreshKind::Velocity => vec![0.0; position.len()],
            FreshKind::Acceleration => band(signals.measured.clone(), 1, band_hz, rate_hz),
        };
        let settled = (1.5 * rate_hz / band_hz[0] / std::f64::consts::TAU * 2.0) as usize;
        let length = ((STRETCH * time_constant_s * rate_hz) as usize).max(200);
        let mut from = settled;
        while from + length / 2 < signals.len() {
            let to = (from + length).min(signals.len());
            let stretch = Stretch { position: &position, follows: &follows, drag: &drag, range: from..to };
            shifts.extend(stretch.shift(OLDEST_S * rate_hz));
            from = to;
        }
    }
    if shifts.len() < 3 {
        return None;
    }
    shifts.sort_by(f64::total_cmp);
    let middle = shifts[shifts.len() / 2];
    let mut deviations: Vec<f64> = shifts.iter().map(|shift| (shift - middle).abs()).collect();
    deviations.sort_by(f64::total_cmp);
    // Of the median, from the median deviation: 1.25 x 1.48 standard deviations.
    let error = 1.85 * deviations[deviations.len() / 2] / (shifts.len() as f64).sqrt();
    let age = Age { seconds: (middle / rate_hz).max(0.0), error_s: error / rate_hz };
    (age.error_s <= SURE_S).then_some(age)
}

/// Ages that several axes tell, as one: each counts by how sure it is.
pub fn pooled(ages: &[Age]) -> Option<Age> {
    // None is surer than a twentieth of the least that is believed.
    let weight = |age: &Age| 1.0 / age.error_s.max(SURE_S / 20.0).powi(2);
    let sum: f64 = ages.iter().map(weight).sum();
    let seconds = ages.iter().map(|age| weight(age) * age.seconds).sum::<f64>() / sum;
    (!ages.is_empty()).then_some(Age { seconds, error_s: sum.sqrt().recip() })
}

/// What a wrong age costs, in words: what moves is as far off as it goes in that time.
pub fn cost(logs: &[&AxisSignals], unit: &str, axis: &str) -> String {
    let speed = root_mean_square(logs.iter().flat_map(|signals| signals.desired_velocity.iter().copied()));
    let error = root_mean_square(logs.iter().map(|signals| signals.error()));
    let share = 100.0 * 0.01 * speed / error.max(1e-12);
    format!("Axis {axis}: 10 ms wrong leave {:.2e} {unit} more, {share:.0} % of the error in the logs", 0.01 * speed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A position that follows from an acceleration with a factor and a constant, seen `age` ticks late, with noise.
    fn flight(age: f64, noise: f64, seed: u64) -> AxisSignals {
        let at_time = |t: f64| 0.5 * (1.9 * t).sin() + 0.3 * (3.7 * t + 1.0).sin() + 0.2 * (0.7 * t).cos();
        let curve =
            |t: f64| -0.5 * 1.9 * 1.9 * (1.9 * t).sin() - 0.3 * 3.7 * 3.7 * (3.7 * t + 1.0).sin() - 0.2 * 0.49 * (0.7 * t).cos();
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        let mut random = move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        let ticks = 9_000;
        AxisSignals {
            measured: (0..ticks).map(|tick| at_time((f64::from(tick) - age) / 100.0) + noise * random()).collect(),
            fresh: Some((0..ticks).map(|tick| -0.1 * curve(f64::from(tick) / 100.0) + 0.05 + 0.02 * random()).collect()),
            ..AxisSignals::default()
        }
    }

    proptest! {
        #[test]
        fn an_age_is_found_within_a_few_milliseconds(age_ms in 0.0f64..60.0, noise in 0.0f64..0.003, seed in any::<u64>()) {
            let signals = flight(age_ms / 10.0, noise, seed);
            let found = estimated(&[(&signals, FreshKind::Acceleration)], 100.0, 0.7).unwrap();
            prop_assert!((1e3 * found.seconds - age_ms).abs() < 3.0, "{age_ms} {found:?}");
        }
    }

    #[test]
    fn what_does_not_go_with_the_position_tells_nothing() {
        let mut signals = flight(2.4, 0.001, 3);
        signals.fresh = flight(0.0, 1.0, 8).fresh.map(|fresh| fresh.iter().rev().map(|value| value * value).collect());
        assert_eq!(estimated(&[(&signals, FreshKind::Acceleration)], 100.0, 0.7), None);
        signals.fresh = None;
        assert_eq!(estimated(&[(&signals, FreshKind::Acceleration)], 100.0, 0.7), None);
    }
}
