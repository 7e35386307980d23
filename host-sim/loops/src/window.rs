//! The network lane of an axis: a window over the desired position, fitted to the errors that the loop itself left.
//!
//! *in* logs of an axis and a model of it; *out* weights of the window; *never* a correction learned from noise in its own
//! inputs: these are the desired trajectory, which has none; *source* Zhou 2017, Insight 3 (difference learning): features
//! relative to now. What differs: the paper learns the inverse with the measured output in the place of the desired one; here
//! the error that was logged is regressed on what the window would have done to it through the identified loop (filtered-x,
//! Widrow and Walach 1996), which needs no stable inverse and is not biased by measurement noise.

use impromptu_diagnosis::{least_squares::Regression, record::decimated};

use crate::{
    reading::{AxisSignals, at},
    response::Answer,
};

/// Offsets of the window of a loop with a time constant of 70 ticks, and that time constant.
const OFFSETS: [i32; 16] = [-44, -32, -22, -14, -8, -4, 4, 8, 14, 20, 27, 35, 44, 54, 66, 80];
/// See [`OFFSETS`].
const TIME_CONSTANT: f64 = 70.0;

/// Offsets, ticks, of a loop with a time constant of so many ticks: whole multiples of `unit`, none of them the present, within
/// the ticks of the past and the future that the application keeps.
pub fn offsets(time_constant: f64, unit: i32, [past, future]: [i32; 2]) -> Vec<i32> {
    let scaled = |offset: &i32| {
        let ticks = f64::from(*offset) * time_constant / TIME_CONSTANT / f64::from(unit);
        (unit * (ticks.abs().ceil() as i32) * offset.signum()).clamp(-past / unit * unit, future / unit * unit)
    };
    let mut offsets: Vec<i32> = OFFSETS.iter().map(scaled).collect();
    offsets.dedup();
    offsets
}

/// Weights of a window.
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// Offset, ticks, and weight of each desired position relative to now.
    pub weights: Vec<(i32, f64)>,
    /// Correction that is always there.
    pub constant: f64,
    /// Least and greatest value of each relative position in the logs.
    pub envelope: Vec<(f64, f64)>,
    /// Largest correction over the logs.
    pub largest: f64,
}

/// Rows of relative desired positions at a tick; the trajectory rests beyond its ends.
pub fn relative(desired: &[f64], offsets: &[i32], tick: usize) -> Vec<f64> {
    let last = desired.len() as i32 - 1;
    offsets.iter().map(|offset| desired[(tick as i32 + offset).clamp(0, last) as usize] - desired[tick]).collect()
}

/// Sums of a log: columns are the window's and the constant's.
fn sums(signals: &AxisSignals, offsets: &[i32], answer: &Answer, age_ticks: f64, skipped: usize) -> Regression {
    let (ticks, divisor) = (signals.len(), answer.divisor);
    // The desired position through the loop once, as far as the window looks beyond the ends, where it rests.
    let ends = [offsets.iter().copied().min().unwrap_or(0).min(0), offsets.iter().copied().max().unwrap_or(0).max(0)];
    let held = (ends[0]..ticks as i32 + ends[1]).map(|tick| signals.desired[tick.clamp(0, ticks as i32 - 1) as usize]);
    let answered = answer.model.simulate(&decimated(&held.collect::<Vec<_>>(), divisor));
    let slower = |of: &dyn Fn(usize) -> f64| decimated(&(0..ticks).map(of).collect::<Vec<_>>(), divisor);
    let of_dither = answer.model.simulate(&slower(&|tick| signals.reference[tick] - signals.base[tick]));
    let errors = slower(&|tick| signals.measured[tick] - at(&signals.desired, tick as f64 - age_ticks));
    let mut regression = Regression::new(offsets.len() + 1, 1);
    let mut row = vec![answer.model.gain(); offsets.len() + 1];
    let begin = (-ends[0]) as usize / divisor;
    for (tick, (error, of_dither)) in errors.iter().zip(&of_dither).enumerate().skip(skipped / divisor) {
        let now = begin + tick;
        for (value, offset) in row.iter_mut().zip(offsets) {
            let there = now as i32 + offset / divisor as i32;
            *value = answered[(there.max(0) as usize).min(answered.len() - 1)] - answered[now];
        }
        regression.push(&row, &[of_dither - error]);
    }
    regression
}

/// Penalties tried, relative to each column's mean square.
const PENALTIES: [f64; 7] = [1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1];

/// The window that would have left least of the logged errors; which penalty, logs decide that were not fitted.
pub fn fit(logs: &[&AxisSignals], answer: &Answer, offsets: &[i32], age_ticks: f64, skipped: usize) -> Option<Window> {
    let long = logs.iter().filter(|signals| signals.len() > 2 * skipped);
    let all: Vec<Regression> = long.map(|log| sums(log, offsets, answer, age_ticks, skipped)).collect();
    let columns = offsets.len() + 1;
    let joined = |left_out: Option<usize>| {
        let mut joined = Regression::new(columns, 1);
        for (_, sums) in all.iter().enumerate().filter(|(index, _)| Some(*index) != left_out) {
            joined.gram += &sums.gram;
            joined.cross += &sums.cross;
            joined.squares += &sums.squares;
            joined.rows += sums.rows;
        }
        joined
    };
    let folds: Vec<Regression> =
        if all.len() > 1 { (0..all.len()).map(|index| joined(Some(index))).collect() } else { Vec::new() };
    let missed = |penalty: f64| {
        let errors = folds.iter().zip(&all).map(|(fold, left_out)| {
            fold.solve(penalty).map_or(f64::INFINITY, |solution| left_out.residual(0, &solution.coefficients))
        });
        errors.sum::<f64>()
    };
    let tried = PENALTIES.map(|penalty| (penalty, missed(penalty)));
    let (penalty, _) = tried.into_iter().min_by(|(_, a), (_, b)| a.total_cmp(b))?;
    let solution = joined(None).solve(penalty)?;
    let (constant, weights) = solution.coefficients.as_slice().split_last()?;
    let mut window = Window {
        weights: offsets.iter().copied().zip(weights.iter().copied()).collect(),
        constant: *constant,
        envelope: vec![(0.0, 0.0); offsets.len()],
        largest: 0.0,
    };
    for signals in logs {
        for tick in 0..signals.len() {
            let row = relative(&signals.desired, offsets, tick);
            let correction = |weights: &[f64]| row.iter().zip(weights).map(|(value, weight)| value * weight).sum::<f64>();
            window.largest = window.largest.max((correction(weights) + constant).abs());
            for ((low, high), value) in window.envelope.iter_mut().zip(&row) {
                (*low, *high) = (low.min(*value), high.max(*value));
            }
        }
    }
    Some(window)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_are_whole_sub_rate_ticks_and_never_the_present() {
        for (time_constant, unit) in [(70.0, 2), (7.0, 1), (1.0, 1), (70.0, 5)] {
            let found = offsets(time_constant, unit, [400, 600]);
            assert!(found.iter().all(|offset| *offset != 0 && offset % unit == 0), "{found:?}");
            assert!(found.windows(2).all(|pair| pair[0] < pair[1]), "{found:?}");
        }
        assert_eq!(offsets(70.0, 2, [400, 600]).len(), 16);
        let near = offsets(70.0, 2, [20, 50]);
        assert_eq!((near[0], *near.last().unwrap()), (-20, 50));
    }
}
