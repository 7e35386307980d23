//! Stretches that are not the loop's, and rows that do not come evenly.
//!
//! *in* columns; *out* the same without time on the ground, at one rate, and what was done in words; *never* a stretch cut that a
//! loop at rest may have made; *source* ours.

use crate::{
    columns::{Columns, median},
    record::{JITTER, LONGEST_GAP, MOST_UNEVEN, between, places},
};

/// Fewest rows of a stretch at an end of a log, and its least share of the log.
const FEWEST: usize = 20;
const SHORTEST: f64 = 0.02;
/// The measured value rests if it moves by less than this share of what it moves in the whole log.
const STILL: f64 = 0.02;
/// It rests elsewhere if the error is so many times what it is in the rest of the log.
const ELSEWHERE: f64 = 2.0;
/// It leaps if it moves by this share of what it moves in the whole log while the reference moves once.
const LEAP: f64 = 0.3;

/// Cuts the time on the ground off: at an end of the log the reference rests, the measured value as well, and either they have
/// nothing to do with each other, or the log then goes on from elsewhere.
pub(crate) fn airborne(columns: Columns, notes: &mut Vec<String>) -> Columns {
    let Columns { lines, reference, measured, .. } = &columns;
    let rows = measured.len();
    let fewest = FEWEST.max((SHORTEST * rows as f64) as usize);
    let changes = |row: &usize| reference[*row] != reference[*row - 1];
    let (Some(first), Some(last)) = ((1..rows).find(changes), (1..rows).rev().find(changes)) else { return columns };
    let span = extent(measured);
    let error = |row: usize| measured[row] - reference[row];
    let usual = (first..last).map(|row| error(row).powi(2)).sum::<f64>() / (last - first).max(1) as f64;
    // What it does before it has come to rest is the loop's.
    let settled = last + (rows - last) / 5;
    let away = |from: usize, to: usize| {
        let mean = (from..to).map(error).sum::<f64>() / (to - from).max(1) as f64;
        mean * mean > ELSEWHERE * ELSEWHERE * usual
    };
    let still = |from: usize, to: usize| extent(&measured[from..to]) <= STILL * span;
    let leaps = (measured[(first + 2).min(rows - 1)] - measured[first - 1]).abs() > LEAP * span;
    let from = if first >= fewest && still(0, first) && (away(0, first) || leaps) { first } else { 0 };
    let to = if rows - last >= fewest && still(settled, rows) && away(settled, rows) { last } else { rows };
    if to - from < rows / 4 || (from, to) == (0, rows) {
        return columns;
    }
    if from > 0 {
        notes.push(format!(
            "{from} rows up to line {}, in which neither column moves, were left out: on the ground?",
            lines[from - 1]
        ));
    }
    if to < rows {
        notes.push(format!(
            "{} rows from line {} on, in which the measured value rests far from the reference, were left out: on the ground?",
            rows - to,
            lines[to]
        ));
    }
    columns.each(lines[from..to].to_vec(), |values| values[from..to].to_vec())
}

fn extent(values: &[f64]) -> f64 {
    let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)));
    (high - low).max(0.0)
}

/// Brings rows that come unevenly, or of which many are lost, to one rate by straight lines between them.
pub(crate) fn evened(mut columns: Columns, notes: &mut Vec<String>) -> Columns {
    let steps: Vec<f64> = columns.time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let usual = median(steps.clone());
    let uneven = steps.iter().filter(|step| (**step - usual).abs() > JITTER * usual).count();
    let bad = usual <= 0.0 || steps.iter().any(|step| *step <= 0.0 || *step > LONGEST_GAP * usual);
    if bad || uneven as f64 <= MOST_UNEVEN * steps.len() as f64 {
        return columns;
    }
    let (first, last) = (columns.time[0], columns.time[columns.time.len() - 1]);
    let ticks: f64 = steps.iter().map(|step| (step / usual).round()).sum();
    let period = (last - first) / ticks.max(1.0);
    let places = places(&columns.time, period, ticks as usize + 1);
    let between = |values: &[f64]| between(values, &places);
    let percent = 100.0 * uneven as f64 / steps.len() as f64;
    notes.push(format!(
        "{percent:.0} % of the rows come early, late or not at all: brought to {:.4} Hz by straight lines between them",
        1.0 / period
    ));
    let lines = places.iter().map(|(row, _)| columns.lines[*row]).collect();
    columns = columns.each(lines, between);
    columns.time = (0..places.len()).map(|tick| first + tick as f64 * period).collect();
    columns
}
