//! Whether columns of a log can be what they are taken for, before anything is made of them.
//!
//! *in* time, reference and measured value as a log has them; *out* the same in seconds, without repeated rows, wraps and single
//! wild samples, and what was done in words; *never* a guess where two readings are possible: that is refused with the option
//! that settles it; *source* ours: each rule stands for a kind of log that was once taken for another one.
//!
//! | found | done |
//! |---|---|
//! | rows that repeat the one before | left out |
//! | whole numbers as time, a unit or more apart | refused, unless the column is ULog's `timestamp` or the unit is stated |
//! | the measured value jumps by 360° or 2 pi within a row and hardly moves else | both columns unwrapped |
//! | up to three samples in a row, far out of what the rest spans | a line between their neighbours |
//! | at an end the reference rests, and the measured value rests elsewhere or leaps away | left out, as time on the ground |
//! | steps of time differ, or rows are lost | brought to one rate by straight lines |
//! | the measured value is the reference | refused |
//! | the measured value is 1000, 100, 57.3 times as large as the reference, or as small | refused, unless its unit is stated |
//! | the measured value goes against the reference | refused, unless it is stated to count the other way |

use std::f64::consts::TAU;

pub use crate::columns::Columns;
use crate::{
    columns::{mean, median},
    stretches::{airborne, evened},
};

/// Unit of a column of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeUnit {
    /// s.
    Seconds,
    /// ms.
    Milliseconds,
    /// µs.
    Microseconds,
    /// ns.
    Nanoseconds,
}

impl TimeUnit {
    /// Seconds of one.
    fn seconds(self) -> f64 {
        match self {
            Self::Seconds => 1.0,
            Self::Milliseconds => 1e-3,
            Self::Microseconds => 1e-6,
            Self::Nanoseconds => 1e-9,
        }
    }
}

/// What is stated about a log; where nothing is, the log has to tell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Unit of the time.
    pub time_unit: Option<TimeUnit>,
    /// The measured value counts against the reference.
    pub negated: bool,
    /// What the measured value is multiplied by to have the reference's unit.
    pub scale: Option<f64>,
}

/// Why columns cannot be what they are taken for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Implausible {
    /// Two rows at one time.
    #[error("line {line}: the same time as the row before, but other values; drop one of them")]
    Twice {
        /// Line, from 1.
        line: u64,
    },
    /// Time that may be in several units.
    #[error(
        "the time goes by whole numbers, {step} from row to row: is that s, ms, us or ns? Say it with --time-unit (or write \
         seconds with a decimal point)"
    )]
    TimeUnit {
        /// Usual step.
        step: f64,
    },
    /// One column twice.
    #[error("the measured value is the reference, row by row: name the column that was measured with --columns")]
    Same,
    /// A sign.
    #[error(
        "the measured value goes against the reference (correlation {correlation:.2}): a sign, or two frames (NED beside ENU)? \
         --negate-measured if the measured column counts the other way"
    )]
    Against {
        /// Largest correlation in magnitude over the lags that were tried.
        correlation: f64,
    },
    /// Another unit.
    #[error(
        "the measured value is {ratio:.4} times as large as the reference and goes with it: {units}? Say with --measured-scale \
         what makes it the reference's unit (1 if it is)"
    )]
    Unit {
        /// How many times.
        ratio: f64,
        /// What that could be.
        units: &'static str,
    },
    /// Too many wild samples.
    #[error("line {line} and {more} more: far out of what the rest spans; repair the log, or cut it there")]
    Wild {
        /// Line of the first, from 1.
        line: u64,
        /// Others.
        more: usize,
    },
}

impl Implausible {
    /// Whether an option settles it.
    pub fn leaves_open(&self) -> bool {
        matches!(self, Self::TimeUnit { .. } | Self::Same | Self::Against { .. } | Self::Unit { .. })
    }
}

/// Columns that can be what they are taken for, and what was done to them. `name` is that of the time's column.
///
/// # Errors
/// What they cannot be.
pub fn plausible(columns: Columns, name: &str, reading: &Reading) -> Result<(Columns, Vec<String>), Implausible> {
    let mut notes = Vec::new();
    let mut columns = without_repetitions(columns, &mut notes)?;
    in_seconds(&mut columns, name, reading.time_unit, &mut notes)?;
    if columns.reference == columns.measured && moves(&columns.measured) {
        return Err(Implausible::Same);
    }
    let scale = reading.scale.unwrap_or(1.0) * if reading.negated { -1.0 } else { 1.0 };
    if scale != 1.0 {
        columns.measured.iter_mut().chain(columns.rate.iter_mut().flatten()).for_each(|value| *value *= scale);
    }
    unwrap(&mut columns, &mut notes);
    tame(&mut columns, &mut notes)?;
    let columns = airborne(columns, &mut notes);
    let alike = alike(&columns);
    against(alike)?;
    if reading.scale.is_none() {
        unit(&columns, alike)?;
    }
    Ok((evened(columns, &mut notes), notes))
}

/// Whether a column is not the same number throughout.
pub(crate) fn moves(values: &[f64]) -> bool {
    values.windows(2).any(|pair| pair[0] != pair[1])
}

/// Rows of the same time and values as the one before are the same row.
fn without_repetitions(columns: Columns, notes: &mut Vec<String>) -> Result<Columns, Implausible> {
    let Columns { lines, time, reference, measured, rate, .. } = &columns;
    let (mut kept, mut first) = (Vec::with_capacity(time.len()), None);
    for row in 0..time.len() {
        match row.checked_sub(1) {
            Some(before) if time[row] == time[before] => {
                let same = |values: &[f64]| values[row] == values[before];
                if !(same(reference) && same(measured) && rate.as_deref().is_none_or(same)) {
                    return Err(Implausible::Twice { line: lines[row] });
                }
                first = first.or(Some(lines[row]));
            }
            _ => kept.push(row),
        }
    }
    let Some(line) = first else { return Ok(columns) };
    notes.push(format!("{} row(s) that repeat the one before were left out, the first in line {line}", time.len() - kept.len()));
    let picked = kept.iter().map(|row| lines[*row]).collect();
    Ok(columns.each(picked, |values| kept.iter().map(|row| values[*row]).collect()))
}

/// Times in seconds. Loggers write whole numbers of milli-, micro- or nanoseconds; a loop of a row a second and slower is rare,
/// and its log looks the same.
fn in_seconds(columns: &mut Columns, name: &str, stated: Option<TimeUnit>, notes: &mut Vec<String>) -> Result<(), Implausible> {
    let Columns { time, decimal, .. } = columns;
    let decimal = *decimal;
    let step = median(time.windows(2).map(|pair| pair[1] - pair[0]).collect());
    let whole = step >= 1.0 && !decimal && time.iter().all(|time| time.fract() == 0.0);
    let unit = match stated {
        Some(unit) => unit,
        // PX4's logs have this column in this unit.
        None if whole && name == "timestamp" => {
            notes.push("`timestamp` in whole numbers was read as microseconds (--time-unit says otherwise)".into());
            TimeUnit::Microseconds
        }
        None if whole => return Err(Implausible::TimeUnit { step }),
        None => TimeUnit::Seconds,
    };
    let first = if unit == TimeUnit::Seconds { 0.0 } else { time.first().copied().unwrap_or(0.0) };
    time.iter_mut().for_each(|time| *time = (*time - first) * unit.seconds());
    Ok(())
}

/// A wrap is within this share of a whole turn, and nothing else moves by more than the other share of one.
const WRAP: f64 = 0.06;
const STILL: f64 = 0.2;
/// A wrapped angle is within its turn but for rounding, as a share of the turn.
const ROUNDED: f64 = 2e-3;

/// Unwraps an angle: a measured one that jumps by a turn and hardly moves else is one, and so is its reference.
fn unwrap(columns: &mut Columns, notes: &mut Vec<String>) {
    let near = |step: f64, turn: f64| (step.abs() / turn - 1.0).abs() <= WRAP;
    let is_angle = |turn: f64| {
        let (mut jumps, mut others) = (0, false);
        for pair in columns.measured.windows(2) {
            let step = pair[1] - pair[0];
            if near(step, turn) { jumps += 1 } else { others |= step.abs() > STILL * turn }
        }
        // It was wrapped when it was logged, so that its range is exact.
        let within = [-0.5, 0.0].into_iter().any(|low| {
            let range = (low - ROUNDED) * turn..=(low + 1.0 + ROUNDED) * turn;
            columns.measured.iter().all(|value| range.contains(value))
        });
        (jumps > 0 && !others && within).then_some(turn)
    };
    let Some(turn) = [360.0, TAU].into_iter().find_map(is_angle) else { return };
    let wraps = follow(&mut columns.measured, turn);
    follow(&mut columns.reference, turn);
    // Both began within one turn, perhaps not the same one.
    let between: Vec<f64> = columns.reference.iter().zip(&columns.measured).map(|(r, y)| r - y).collect();
    let turns = (median(between) / turn).round() * turn;
    columns.reference.iter_mut().for_each(|value| *value -= turns);
    if let Some(desired) = &mut columns.desired {
        follow(desired, turn);
        let turns = (median(desired.iter().zip(&columns.reference).map(|(d, r)| d - r).collect()) / turn).round() * turn;
        desired.iter_mut().for_each(|value| *value -= turns);
    }
    notes.push(format!("an angle that wraps ({wraps} times) was unwrapped"));
}

/// Adds whole turns so that no step is longer than half of one; how often one was.
fn follow(values: &mut [f64], turn: f64) -> usize {
    let (mut wraps, mut turns) = (0, 0.0);
    let mut before = values.first().copied().unwrap_or(0.0);
    for value in values {
        let step = *value - before;
        before = *value;
        if step.abs() > 0.5 * turn {
            turns -= (step / turn).round() * turn;
            wraps += 1;
        }
        *value += turns;
    }
    wraps
}

/// Wild samples that follow each other, and share of all rows, at most.
const RUN: usize = 3;
const MOST: f64 = 0.01;
/// How many times the span of the rest a wild one is away from its middle.
const AWAY: f64 = 5.0;

/// Replaces single samples that no machine can have reached and left within a few rows.
fn tame(columns: &mut Columns, notes: &mut Vec<String>) -> Result<(), Implausible> {
    let rows = columns.measured.len();
    let mut sorted = columns.measured.clone();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| sorted.get(((rows as f64 - 1.0) * share) as usize).copied().unwrap_or(0.0);
    let (low, middle, high) = (at(0.02), at(0.5), at(0.98));
    let bound = AWAY * (high - low);
    let wild: Vec<usize> = (0..rows).filter(|&row| (columns.measured[row] - middle).abs() > bound).collect();
    let Some(&first) = wild.first().filter(|_| bound > 0.0) else { return Ok(()) };
    let runs = wild.chunk_by(|a, b| b - a == 1);
    if wild.len() as f64 > MOST * rows as f64 || runs.clone().any(|run| run.len() > RUN) {
        return Err(Implausible::Wild { line: columns.lines[first], more: wild.len() - 1 });
    }
    for run in runs {
        let (before, after) = (run[0].checked_sub(1), run[run.len() - 1] + 1);
        for values in [Some(&mut columns.measured), columns.rate.as_mut()].into_iter().flatten() {
            let ends = [before.map(|row| values[row]), values.get(after).copied()];
            let [from, to] = [ends[0].or(ends[1]), ends[1].or(ends[0])].map(Option::unwrap_or_default);
            for (place, row) in run.iter().enumerate() {
                values[*row] = from + (to - from) * (place + 1) as f64 / (run.len() + 1) as f64;
            }
        }
    }
    let named: Vec<String> = wild.iter().take(5).map(|row| columns.lines[*row].to_string()).collect();
    let more = if wild.len() > 5 { ", …" } else { "" };
    let lines = named.join(", ") + more;
    notes
        .push(format!("{} sample(s) far out of what the rest spans were replaced by their neighbours: line {lines}", wild.len()));
    Ok(())
}

/// From this correlation on, negative, and without half as much of a positive one.
const AGAINST: f64 = -0.7;
/// Lags that are tried, and rows that are looked at, at most.
const LAGS: usize = 40;
const LOOKED_AT: usize = 4000;

/// Least and largest correlation of the measured value with the reference before it, over the lags that are tried.
fn alike(columns: &Columns) -> [f64; 2] {
    let rows = columns.measured.len();
    let step = (rows / LOOKED_AT).max(1);
    let (of_reference, of_measured) = (mean(&columns.reference), mean(&columns.measured));
    let correlation = |lag: usize| {
        let pairs = columns.reference.iter().zip(columns.measured.get(lag..).unwrap_or_default()).step_by(step);
        let (mut both, mut squares) = (0.0, [0.0; 2]);
        for (reference, measured) in pairs {
            let (reference, measured) = (reference - of_reference, measured - of_measured);
            both += reference * measured;
            squares[0] += reference * reference;
            squares[1] += measured * measured;
        }
        if squares[0] * squares[1] > 0.0 { both / (squares[0] * squares[1]).sqrt() } else { 0.0 }
    };
    // As far as a twentieth of the log.
    let found = (0..LAGS).map(|lag| correlation(lag * rows / (20 * LAGS)));
    found.fold([0.0, 0.0], |[least, most], value| [value.min(least), value.max(most)])
}

/// A loop that follows its reference, however late, is not for long on its other side.
fn against([least, most]: [f64; 2]) -> Result<(), Implausible> {
    if least < AGAINST && most < -0.5 * least { Err(Implausible::Against { correlation: least }) } else { Ok(()) }
}

/// Ratios of units that are taken for each other, and within which share a ratio is one of them.
const UNITS: [(f64, &str); 3] =
    [(1000.0, "millimetres beside metres"), (100.0, "centimetres beside metres"), (360.0 / TAU, "degrees beside radians")];
const NEAR: f64 = 0.25;
/// Columns go together from this correlation on.
const TOGETHER: f64 = 0.7;

/// A loop whose gain is that of a unit has two of them.
fn unit(columns: &Columns, [_, most]: [f64; 2]) -> Result<(), Implausible> {
    let spread = |values: &[f64]| {
        let mean = mean(values);
        values.iter().map(|value| (value - mean).powi(2)).sum::<f64>().sqrt()
    };
    let ratio = spread(&columns.measured) / spread(&columns.reference);
    let near = |wanted: f64| (ratio / wanted - 1.0).abs() < NEAR;
    let found = UNITS.iter().find(|(factor, _)| near(*factor) || near(1.0 / factor));
    match found {
        Some((_, units)) if most > TOGETHER => Err(Implausible::Unit { ratio, units }),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests;
