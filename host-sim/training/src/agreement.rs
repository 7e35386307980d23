//! Whether logs are those of a simulated loop: what it makes of their references, beside what they measured.
//!
//! *in* flight logs of the baseline and a simulated loop; *out* an [`Agreement`]; *never* another loop's flights as a judge of
//! lanes; *source* steps of Gauss and Newton (Ljung, System Identification, 10.2): the loop flies the logged references as it
//! is, with more delay, and with more thrust, in still air; what the logs measured beyond the first flight is explained by the
//! differences of the others from it. What is left then is the loop's as far as the reference explains it on stretches of the
//! logs that nothing was fitted to; the rest is wind and noise.
//!
//! Wind, noise, a payload and a battery that is half empty are no other loop: a constant and some of the thrust are free. Noise
//! is flown all the same: motors that it drives to their bounds answer otherwise; what delay and thrust change is flown without.

use impromptu_diagnosis::prediction::root_mean_square;
use impromptu_sim::{
    condition::Condition,
    flight_log::{FlightLog, LogRow},
    flights::Loop,
    plant::Variation,
    rollout::{FlightPlan, RolloutError},
    sensors::SensorNoise,
    trajectory::{Sample, Trajectory},
    weather::WeatherSettings,
};
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};
use serde::Serialize;

/// What the delay and the thrust are changed by, s and a share.
const CHANGES: [f64; 2] = [0.008, 0.05];
/// Steps of Gauss and Newton.
const STEPS: usize = 3;
/// Logs that are flown again, and s of each.
const LOGS: usize = 12;
/// See [`LOGS`].
const SECONDS: f64 = 60.0;
/// What a log is not judged by, s: it may begin in motion.
const SETTLED_S: f64 = 3.0;
/// A stretch of a log, s.
const STRETCH_S: f64 = 5.0;
/// Ages of the reference, s, by which what is left is explained.
const AGES_S: [f64; 6] = [0.1, 0.2, 0.35, 0.5, 0.75, 1.0];
/// Standard errors from which on a figure is one.
const SURE: f64 = 2.0;
/// Noise of the flights is of this seed: any but that of the logs will do.
const SEED: u64 = 0x5eed_0f1d;

/// Further delay of the whole loop, s, and share of the thrust, at most.
const MOST: [f64; 2] = [0.01, 0.2];
/// Share of the error that may be another loop's.
const MOST_OF_ERROR: f64 = 0.1;
/// Simulated error in logged ones, at most: no wind makes a loop better.
const MOST_AS_SIMULATED: f64 = 1.5;

/// A figure with its standard error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Figure {
    /// Value.
    pub value: f64,
    /// Standard error.
    pub error: f64,
}

impl Figure {
    /// Its magnitude as a share of the most that is allowed, if that is a figure and no chance. A loop that falls with a little
    /// more delay or thrust, where the logs' did not, has no number.
    fn beyond(self, most: f64) -> f64 {
        if !self.value.is_finite() {
            return f64::INFINITY;
        }
        if self.value.abs() > SURE * self.error { self.value.abs() / most } else { 0.0 }
    }
}

/// Logs beside a simulated loop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Agreement {
    /// Of each axis the RMS of what was measured less the reference, as logged and as simulated, without its mean, m.
    pub errors: [[f64; 2]; 3],
    /// Of each axis the RMS of what the reference explains of the difference that no delay and no thrust does, m.
    pub differences: [f64; 3],
    /// The same as a share of the larger error; its square with the standard error of that.
    pub shares_squared: [Figure; 3],
    /// Further delay of the whole loop, s, with which the simulated one comes closest.
    pub delay_s: Figure,
    /// Share of the thrust, the same.
    pub thrust: Figure,
}

/// Why a simulated loop is not that of the logs.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Disagreement {
    /// Another error.
    #[error(
        "the simulated loop is not that of the logs: axis {axis} has an error of {logged_cm:.1} cm as logged and of \
         {simulated_cm:.1} cm as simulated along the same references ({different_cm:.1} cm are neither wind, noise, delay nor \
         thrust)"
    )]
    Error {
        /// Axis.
        axis: &'static str,
        /// As logged, cm.
        logged_cm: f64,
        /// As simulated, cm.
        simulated_cm: f64,
        /// What another loop explains, cm.
        different_cm: f64,
    },
    /// Another delay.
    #[error(
        "the simulated loop is not that of the logs: they show {logged_ms:.0} ms of delay in the whole loop, it has \
         {simulated_ms:.0} ms"
    )]
    Delay {
        /// As logged, ms.
        logged_ms: f64,
        /// As simulated, ms.
        simulated_ms: f64,
    },
    /// Another thrust.
    #[error(
        "the simulated loop is not that of the logs: they show {logged_percent:.0} % of the thrust that it has (100 %) for the \
         same command"
    )]
    Thrust {
        /// As logged, %.
        logged_percent: f64,
    },
}

impl Agreement {
    /// What differs most beyond what is allowed, if anything does; the loop's delay is named beside the logs'.
    pub fn disagreement(&self, closed_loop: &Loop) -> Option<Disagreement> {
        let Self { errors, differences, shares_squared, delay_s, thrust } = self;
        let of_axis = |axis: usize| {
            let [logged_cm, simulated_cm] = errors[axis].map(|error| 1e2 * error);
            let share = shares_squared[axis].beyond(MOST_OF_ERROR * MOST_OF_ERROR).sqrt();
            // A loop that falls as simulated has no number.
            let fell =
                if simulated_cm.is_finite() { simulated_cm / logged_cm.max(1e-9) / MOST_AS_SIMULATED } else { f64::INFINITY };
            let beyond = share.max(fell);
            let axis_name = ["x", "y", "z"][axis];
            (beyond, Disagreement::Error { axis: axis_name, logged_cm, simulated_cm, different_cm: 1e2 * differences[axis] })
        };
        let simulated_ms = 1e3 * (closed_loop.condition.measurement_delay_s + closed_loop.condition.command_delay_s);
        let others = [
            (delay_s.beyond(MOST[0]), Disagreement::Delay { logged_ms: simulated_ms + 1e3 * delay_s.value, simulated_ms }),
            (thrust.beyond(MOST[1]), Disagreement::Thrust { logged_percent: 100.0 * (1.0 + thrust.value) }),
        ];
        // Delay and thrust mean something only where they explain the difference.
        let worst = |(a, _): &(f64, Disagreement), (b, _): &(f64, Disagreement)| a.total_cmp(b);
        let beyond = |(beyond, _): &(f64, Disagreement)| *beyond > 1.0;
        let error = (0..3).map(of_axis).filter(beyond).max_by(worst);
        error.or_else(|| others.into_iter().filter(beyond).max_by(worst)).map(|(_, found)| found)
    }
}

/// A stretch of an axis: what the logs measured beyond the flight without changes, what the changes do, and what the reference
/// was before, less what it is.
struct Stretch {
    difference: Vec<f64>,
    changes: [Vec<f64>; 2],
    past: Vec<[f64; AGES_S.len()]>,
}

/// Flies the references of the logs and compares what was measured, axis by axis.
///
/// # Errors
/// If the loop cannot fly them.
pub fn agreement(closed_loop: &Loop, logs: &[&FlightLog]) -> Result<Agreement, RolloutError> {
    let every = logs.len().div_ceil(LOGS).max(1);
    let logs: Vec<&FlightLog> = logs.iter().step_by(every).copied().collect();
    let told: Vec<Trajectory> = logs.iter().map(|log| told(log)).collect();
    let with = |noise: &SensorNoise| {
        let condition = Condition { noise: *noise, weather: WeatherSettings::default(), ..closed_loop.condition.clone() };
        Loop { condition, ..closed_loop.clone() }
    };
    let [noisy, calm] = [&closed_loop.condition.noise, &SensorNoise::default()].map(with);
    let fly = |flown: &Loop, delay_s: f64, thrust_factor: f64| -> Result<Vec<FlightLog>, RolloutError> {
        let variation = Variation { thrust_factor, ..Variation::default() };
        let plans: Vec<FlightPlan<'_>> = told
            .iter()
            .zip(SEED..)
            .map(|(trajectory, seed)| FlightPlan { variation, log: true, ..FlightPlan::new(trajectory, seed) })
            .collect();
        Ok(flown.delayed(delay_s).fly(&plans)?.into_iter().filter_map(|record| record.log).collect())
    };
    let usual = fly(&noisy, 0.0, 1.0)?;
    let errors = std::array::from_fn(|axis| [rms_error(&logs, axis), rms_error(&usual.iter().collect::<Vec<_>>(), axis)]);
    let mut at = [0.0, 0.0];
    let mut here = usual;
    let (mut stretches, mut found) = (Vec::new(), [Figure { value: 0.0, error: 0.0 }; 2]);
    for step in 0..STEPS {
        if step > 0 {
            // No command is known before it is given.
            let earliest = -closed_loop.condition.command_delay_s;
            at = [found[0].value.clamp(earliest, earliest.max(0.1)), found[1].value.clamp(-0.3, 0.3)];
            here = fly(&noisy, at[0], 1.0 + at[1])?;
        }
        let [usual, late, strong] = [[0.0; 2], [CHANGES[0], 0.0], [0.0, CHANGES[1]]]
            .map(|[delay_s, thrust]| fly(&calm, at[0] + delay_s, 1.0 + at[1] + thrust));
        let changes = [usual?, late?, strong?];
        stretches = (0..3).map(|axis| cut(&logs, &here, &changes, axis)).collect::<Vec<Vec<Stretch>>>();
        let shares = pooled(&stretches);
        let of = |index: usize| Figure {
            value: at[index] + CHANGES[index] * shares[index].value,
            error: CHANGES[index] * shares[index].error,
        };
        found = [of(0), of(1)];
    }
    let shares = [0, 1].map(|index| (found[index].value - at[index]) / CHANGES[index]);
    let powers: [Figure; 3] = std::array::from_fn(|axis| explained(&stretches[axis], shares));
    Ok(Agreement {
        errors,
        differences: powers.map(|power| power.value.max(0.0).sqrt()),
        shares_squared: std::array::from_fn(|axis| {
            let [logged, simulated] = errors[axis];
            let largest = logged.max(simulated).max(1e-9).powi(2);
            Figure { value: powers[axis].value / largest, error: powers[axis].error / largest }
        }),
        delay_s: found[0],
        thrust: found[1],
    })
}

/// What the loop of a log was told, as a trajectory.
fn told(log: &FlightLog) -> Trajectory {
    let count = log.rows.len().min((SECONDS * log.rate_hz) as usize);
    let rows = &log.rows[..count];
    let without = rows.iter().all(|row| row.desired.acceleration == [0.0; 3]);
    let sample = |(tick, row): (usize, &LogRow)| {
        let (before, after) = (tick.saturating_sub(1), (tick + 1).min(count - 1));
        let slope = |axis: usize| {
            let velocity = |tick: usize| rows[tick].desired.velocity[axis];
            (velocity(after) - velocity(before)) * log.rate_hz / (after - before).max(1) as f64
        };
        Sample {
            position: row.reference_position,
            velocity: row.reference_velocity,
            acceleration: if without { std::array::from_fn(slope) } else { row.desired.acceleration },
            yaw: row.desired.yaw,
        }
    };
    let samples = rows.iter().enumerate().map(sample).collect();
    Trajectory { name: log.name.clone(), rate_hz: log.rate_hz, samples, scored: 0..count }
}

/// First row of a log that is judged, and the one behind the last.
fn judged(log: &FlightLog) -> std::ops::Range<usize> {
    let rows = log.rows.len().min((SECONDS * log.rate_hz) as usize);
    ((SETTLED_S * log.rate_hz) as usize).min(rows / 4)..rows
}

fn centred(values: impl Iterator<Item = f64> + Clone) -> Vec<f64> {
    let (count, sum) = values.clone().fold((0usize, 0.0), |(count, sum), value| (count + 1, sum + value));
    let mean = sum / count.max(1) as f64;
    values.map(|value| value - mean).collect()
}

fn rms_error(logs: &[&FlightLog], axis: usize) -> f64 {
    root_mean_square(logs.iter().flat_map(|log| {
        centred(log.rows[judged(log)].iter().map(|row| row.measured_position[axis] - row.reference_position[axis]))
    }))
}

/// Stretches of an axis of logs beside a flight of each, and three without noise: as it is, with more delay, with more thrust.
fn cut(logs: &[&FlightLog], flights: &[FlightLog], changes: &[Vec<FlightLog>; 3], axis: usize) -> Vec<Stretch> {
    let mut stretches = Vec::new();
    for (index, log) in logs.iter().enumerate() {
        let range = judged(log);
        let here = &flights[index].rows;
        let [usual, late, strong] = changes.each_ref().map(|flights| &flights[index].rows);
        let less = |a: &[LogRow], b: &[LogRow]| {
            centred(
                a[range.clone()]
                    .iter()
                    .zip(&b[range.clone()])
                    .map(|(a, b)| a.measured_position[axis] - b.measured_position[axis]),
            )
        };
        let (difference, changes) = (less(&log.rows, here), [less(late, usual), less(strong, usual)]);
        let reference = |row: usize| log.rows[row].reference_position[axis];
        let past: Vec<[f64; AGES_S.len()]> = range
            .clone()
            .map(|row| AGES_S.map(|age| reference(row.saturating_sub((age * log.rate_hz) as usize)) - reference(row)))
            .collect();
        let length = ((STRETCH_S * log.rate_hz) as usize).max(10);
        for from in (0..difference.len()).step_by(length) {
            let to = (from + length).min(difference.len());
            stretches.push(Stretch {
                difference: difference[from..to].to_vec(),
                changes: [0, 1].map(|change| changes[change][from..to].to_vec()),
                past: past[from..to].to_vec(),
            });
        }
    }
    stretches
}

/// Shares of the changes that explain most of the differences of all axes, each weighted by what it leaves.
fn pooled(axes: &[Vec<Stretch>]) -> [Figure; 2] {
    let solved = |gram: &Matrix2<f64>, cross: &Vector2<f64>| gram.lu().solve(cross).unwrap_or_default();
    let normal = |stretch: &Stretch| {
        let (mut gram, mut cross) = (Matrix2::zeros(), Vector2::zeros());
        for (tick, difference) in stretch.difference.iter().enumerate() {
            let row = Vector2::new(stretch.changes[0][tick], stretch.changes[1][tick]);
            gram += row * row.transpose();
            cross += row * *difference;
        }
        (gram, cross)
    };
    let mut all: Vec<(Matrix2<f64>, Vector2<f64>)> = Vec::new();
    for stretches in axes {
        let normals: Vec<_> = stretches.iter().map(normal).collect();
        let (gram, cross) = normals.iter().fold((Matrix2::zeros(), Vector2::zeros()), |(a, b), (c, d)| (a + c, b + d));
        let shares = solved(&gram, &cross);
        let left = root_mean_square(stretches.iter().flat_map(|stretch| stretch.without([shares[0], shares[1]])));
        let weight = left.max(1e-5).powi(-2);
        all.extend(normals.into_iter().map(|(gram, cross)| (gram * weight, cross * weight)));
    }
    let (gram, cross) = all.iter().fold((Matrix2::zeros(), Vector2::zeros()), |(a, b), (c, d)| (a + c, b + d));
    let shares = solved(&gram, &cross);
    // What is left differs from stretch to stretch, and is one thing within one.
    let spread = all.iter().fold(Matrix2::zeros(), |sum, (gram, cross)| {
        let score = cross - gram * shares;
        sum + score * score.transpose()
    });
    let inverse = gram.try_inverse().unwrap_or_default();
    let variance = inverse * spread * inverse;
    [0, 1].map(|index| Figure { value: shares[index], error: variance[(index, index)].max(0.0).sqrt() })
}

impl Stretch {
    /// The difference without these shares of the changes.
    fn without(&self, shares: [f64; 2]) -> Vec<f64> {
        let [late, strong] = &self.changes;
        let ticks = self.difference.iter().zip(late).zip(strong);
        ticks.map(|((difference, late), strong)| difference - shares[0] * late - shares[1] * strong).collect()
    }
}

/// Mean square of what the reference explains of what is left of an axis: fitted to every second stretch, and compared with what
/// is left of the others, so that wind and noise, which have nothing to do with the reference, count for nothing on average.
fn explained(stretches: &[Stretch], shares: [f64; 2]) -> Figure {
    let left: Vec<Vec<f64>> = stretches.iter().map(|stretch| stretch.without(shares)).collect();
    let fit = |odd: usize| {
        let (mut gram, mut cross) = (DMatrix::zeros(AGES_S.len(), AGES_S.len()), DVector::zeros(AGES_S.len()));
        for (stretch, left) in stretches.iter().zip(&left).skip(odd).step_by(2) {
            for (past, left) in stretch.past.iter().zip(left) {
                let row = DVector::from_row_slice(past);
                gram.ger(1.0, &row, &row, 1.0);
                cross.axpy(*left, &row, 1.0);
            }
        }
        let ridge = 1e-6 * gram.diagonal().max().max(1e-12);
        for index in 0..AGES_S.len() {
            gram[(index, index)] += ridge;
        }
        gram.lu().solve(&cross).unwrap_or_else(|| DVector::zeros(AGES_S.len()))
    };
    let weights = [fit(1), fit(0)];
    let products: Vec<(f64, f64)> = stretches
        .iter()
        .zip(&left)
        .enumerate()
        .map(|(index, (stretch, left))| {
            let weights = &weights[index % 2];
            let products = stretch
                .past
                .iter()
                .zip(left)
                .map(|(past, left)| past.iter().zip(weights.iter()).map(|(past, weight)| past * weight).sum::<f64>() * left);
            (products.sum::<f64>(), left.len() as f64)
        })
        .collect();
    let ticks: f64 = products.iter().map(|(_, ticks)| ticks).sum::<f64>().max(1.0);
    let value = products.iter().map(|(product, _)| product).sum::<f64>() / ticks;
    let spread: f64 = products.iter().map(|(product, count)| (product - value * count).powi(2)).sum();
    Figure { value, error: spread.sqrt() / ticks }
}

#[cfg(test)]
mod tests;
