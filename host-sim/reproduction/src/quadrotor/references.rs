//! Methods that need no model file: shifted references and iterative learning. The baseline flies references that differ from what is desired.
//!
//! *in* trajectories; *out* RMS errors; *never* the true state for learning: trials learn from what was measured; *source* Bristow, Tharayil and Alleyne,
//! "A survey of iterative learning control" (2006): u_{k+1}(t) = Q(u_k(t) + gain e_k(t + delay)), Q a zero-phase filter.

use impromptu_sim::{
    flight_log::FlightLog,
    flights::Loop,
    rollout::FlightPlan,
    trajectory::{Sample, Trajectory},
};

use super::addon::Course;

/// Longest shift, s: so long every flight hovers longer than its trajectory says.
const LONGEST_S: f64 = 2.0;

/// Flies the baseline over `references`; errors are taken against `desired`, sample by sample.
fn fly(closed_loop: &Loop, references: &[Trajectory], seed: u64) -> anyhow::Result<Vec<FlightLog>> {
    let plan = |(trajectory, seed)| FlightPlan { log: true, guard: closed_loop.guard, ..FlightPlan::new(trajectory, seed) };
    let plans: Vec<FlightPlan<'_>> = references.iter().zip(seed..).map(plan).collect();
    Ok(closed_loop.fly(&plans)?.into_iter().filter_map(|record| record.log).collect())
}

/// sqrt(mean |p_d - p|²) over the drawn part, m, with the true position.
fn error(desired: &Trajectory, log: &FlightLog) -> f64 {
    let squares = desired.scored.clone().filter_map(|tick| {
        let flown = log.rows.get(tick)?.true_position?;
        Some((0..3).map(|axis| (desired.samples[tick].position[axis] - flown[axis]).powi(2)).sum::<f64>())
    });
    (squares.sum::<f64>() / desired.scored.len().max(1) as f64).sqrt()
}

/// The trajectory after a longer hover.
fn padded(trajectory: &Trajectory, ticks: i64) -> Trajectory {
    let samples = (-ticks..trajectory.samples.len() as i64).map(|tick| trajectory.sample_at(tick)).collect();
    let scored = trajectory.scored.start + ticks as usize..trajectory.scored.end + ticks as usize;
    Trajectory { samples, scored, ..trajectory.clone() }
}

/// Errors of the baseline whose references come `shift_s` early.
///
/// # Errors
/// If it cannot be flown.
pub fn shifted(closed_loop: &Loop, course: &Course, shift_s: f64) -> anyhow::Result<Vec<f64>> {
    let pad = (LONGEST_S * closed_loop.rate_hz()) as i64;
    let shift = (shift_s * closed_loop.rate_hz()).round() as i64;
    let desired: Vec<Trajectory> = course.trajectories.iter().map(|trajectory| padded(trajectory, pad)).collect();
    let early = |trajectory: &Trajectory| {
        let samples = (0..trajectory.samples.len() as i64).map(|tick| trajectory.sample_at(tick + shift)).collect();
        Trajectory { samples, ..trajectory.clone() }
    };
    let references: Vec<Trajectory> = desired.iter().map(early).collect();
    let logs = fly(closed_loop, &references, course.seed)?;
    Ok(desired.iter().zip(&logs).map(|(desired, log)| error(desired, log)).collect())
}

/// The shift with the least mean error over a course, s: first in steps of 0.1 s, then of 0.02 s around the best.
///
/// # Errors
/// If it cannot be flown.
pub fn best_shift(closed_loop: &Loop, course: &Course) -> anyhow::Result<f64> {
    let best = |candidates: Vec<f64>| -> anyhow::Result<f64> {
        let mut least = (f64::INFINITY, 0.0);
        for shift in candidates {
            let sum: f64 = shifted(closed_loop, course, shift)?.iter().sum();
            least = if sum < least.0 { (sum, shift) } else { least };
        }
        Ok(least.1)
    };
    let coarse = best((0..=17).map(|step| 0.1 * f64::from(step)).collect())?;
    best((-4..=4).map(|step| (coarse + 0.02 * f64::from(step)).max(0.0)).collect())
}

/// Iterative learning on the position reference; the velocity reference is its derivative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IterativeLearning {
    /// Share of the error that a trial corrects.
    pub gain: f64,
    /// Standard deviation of the zero-phase filter, s.
    pub smoothing_s: f64,
    /// How much later than the reference the error is looked up, s.
    pub delay_s: f64,
}

impl IterativeLearning {
    /// Gains and filters that are tried on validation strokes.
    pub fn candidates(delay_s: f64) -> Vec<Self> {
        let gains = [0.5, 1.0].into_iter();
        gains.flat_map(|gain| [0.05, 0.1, 0.2].map(|smoothing_s| Self { gain, smoothing_s, delay_s })).collect()
    }

    /// Errors of `trials` flights of each trajectory after the first, m: `errors[trial][flight]`; every trial meets other noise.
    ///
    /// # Errors
    /// If they cannot be flown.
    pub fn fly(&self, closed_loop: &Loop, course: &Course, trials: usize) -> anyhow::Result<Vec<Vec<f64>>> {
        let pad = (LONGEST_S * closed_loop.rate_hz()) as i64;
        let desired: Vec<Trajectory> = course.trajectories.iter().map(|trajectory| padded(trajectory, pad)).collect();
        let mut references = desired.clone();
        let mut errors = Vec::new();
        for trial in 0..=trials {
            let seed = course.seed.wrapping_add(1_000 * trial as u64);
            let logs = fly(closed_loop, &references, seed)?;
            errors.push(desired.iter().zip(&logs).map(|(desired, log)| error(desired, log)).collect());
            if trial < trials {
                references = desired
                    .iter()
                    .zip(&references)
                    .zip(&logs)
                    .map(|((desired, used), log)| self.next(closed_loop, desired, used, log))
                    .collect();
            }
        }
        Ok(errors)
    }

    fn next(&self, closed_loop: &Loop, desired: &Trajectory, used: &Trajectory, log: &FlightLog) -> Trajectory {
        let rate = closed_loop.rate_hz();
        let last = used.samples.len() as i64 - 1;
        // What is measured is late; the error looked up is that of the time of the measurement.
        let late = (closed_loop.condition.measurement_delay_s * rate).round() as i64;
        let ahead = (self.delay_s * rate).round() as i64;
        let mut axes: [Vec<f64>; 3] = std::array::from_fn(|_| Vec::with_capacity(used.samples.len()));
        for tick in 0..=last {
            let at = (tick + ahead).min(last - late);
            let row = &log.rows[(at + late) as usize];
            for (axis, values) in axes.iter_mut().enumerate() {
                let error = desired.samples[at as usize].position[axis] - row.measured_position[axis];
                let correction = used.samples[tick as usize].position[axis] - desired.samples[tick as usize].position[axis];
                values.push(correction + self.gain * error);
            }
        }
        let axes = axes.map(|values| smoothed(&values, self.smoothing_s * rate));
        let samples = (0..used.samples.len())
            .map(|tick| {
                let (before, after) = (tick.saturating_sub(1), (tick + 1).min(last as usize));
                let mut sample: Sample = desired.samples[tick];
                for (axis, values) in axes.iter().enumerate() {
                    sample.position[axis] += values[tick];
                    sample.velocity[axis] += (values[after] - values[before]) * rate / (after - before).max(1) as f64;
                }
                sample
            })
            .collect();
        Trajectory { samples, ..used.clone() }
    }
}

/// Gaussian of zero phase; the ends repeat.
fn smoothed(values: &[f64], sigma: f64) -> Vec<f64> {
    let reach = (3.0 * sigma).ceil() as i64;
    let weights: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (k as f64 / sigma.max(1e-9)).powi(2)).exp()).collect();
    let total: f64 = weights.iter().sum();
    let last = values.len() as i64 - 1;
    (0..=last)
        .map(|tick| {
            (-reach..=reach).zip(&weights).map(|(k, weight)| weight * values[(tick + k).clamp(0, last) as usize]).sum::<f64>()
                / total
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{super::predecessor::*, *};
    use impromptu_sim::trajectory::{STROKE_SPEED, stroke};

    #[test]
    fn an_early_reference_beats_the_baseline_and_trials_beat_both() {
        let closed_loop = predecessor().unwrap();
        let strokes =
            (0..3).map(|index| stroke(77, index).scaled(SPEED / STROKE_SPEED).sampled(closed_loop.rate_hz()).unwrap()).collect();
        let course = Course::new(&closed_loop, strokes, 5).unwrap();
        let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
        let none = shifted(&closed_loop, &course, 0.0).unwrap();
        // The longer hover before the drawn part changes next to nothing.
        assert!((mean(&none) / mean(&course.baseline) - 1.0).abs() < 0.05);
        let early = shifted(&closed_loop, &course, 1.0).unwrap();
        let learning = IterativeLearning { gain: 0.5, smoothing_s: 0.1, delay_s: 1.0 };
        let trials = learning.fly(&closed_loop, &course, 6).unwrap();
        assert!(mean(&early) < 0.6 * mean(&none), "{early:?} {none:?}");
        assert!(mean(&trials[6]) < mean(&early) && mean(&trials[6]) < mean(&trials[1]), "{trials:?}");
    }
}
