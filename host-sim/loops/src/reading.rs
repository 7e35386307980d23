//! Logs of a loop, by its description.
//!
//! *in* CSV files and a [`LoopDescription`]; *out* signals of each axis at the rate of the model; *never* a column guessed, nor a
//! sample of one axis beside another one's time: every axis is a log of its own; *source* Zhou 2017, Fig. 1.

use std::path::Path;

use impromptu_diagnosis::{
    plausibility::{Columns, Reading, plausible},
    prediction::root_mean_square,
};
use impromptu_sim::columns::{LARGEST, Table, TableError};
use impromptu_training::channel::ChannelError;

use crate::description::{AxisDescription, LoopDescription};

/// Signals of an axis in a log, one sample a tick, in the axis' unit and s.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AxisSignals {
    /// Desired position.
    pub desired: Vec<f64>,
    /// Desired velocity.
    pub desired_velocity: Vec<f64>,
    /// Position reference that the loop received.
    pub reference: Vec<f64>,
    /// What the reference would have been without a dither or a correction.
    pub base: Vec<f64>,
    /// Velocity reference that it received; zeros if it accepts none.
    pub reference_velocity: Vec<f64>,
    /// Measured position.
    pub measured: Vec<f64>,
    /// Measured velocity; zeros if there is none.
    pub velocity: Vec<f64>,
    /// What a velocity reference that was made part of the position reference weighs, s.
    pub ratio: f64,
    /// A fresher signal.
    pub fresh: Option<Vec<f64>>,
}

impl AxisSignals {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.measured.len()
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.measured.is_empty()
    }

    /// Every `divisor`-th sample, as an application takes them that runs the add-on at a divided rate.
    #[must_use]
    pub fn every(&self, divisor: usize) -> Self {
        self.each(|values| values.iter().step_by(divisor.max(1)).copied().collect())
    }

    /// The samples of a range.
    #[must_use]
    pub fn part(&self, range: std::ops::Range<usize>) -> Self {
        self.each(|values| values[range.clone()].to_vec())
    }

    fn each(&self, every: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        Self {
            desired: every(&self.desired),
            desired_velocity: every(&self.desired_velocity),
            reference: every(&self.reference),
            base: every(&self.base),
            reference_velocity: every(&self.reference_velocity),
            measured: every(&self.measured),
            velocity: every(&self.velocity),
            ratio: self.ratio,
            fresh: self.fresh.as_deref().map(&every),
        }
    }

    /// Makes one reference of position and velocity, of which the velocity weighs `ratio`, s.
    pub fn combine(&mut self, ratio: f64) {
        if self.reference_velocity.iter().all(|velocity| *velocity == 0.0) {
            return;
        }
        for (index, velocity) in self.reference_velocity.iter_mut().enumerate() {
            self.reference[index] += ratio * *velocity;
            self.base[index] += ratio * *velocity;
            *velocity = 0.0;
        }
        self.ratio = ratio;
    }

    /// RMS of what was measured less what was desired.
    pub fn error(&self) -> f64 {
        root_mean_square(self.measured.iter().zip(&self.desired).map(|(y, r)| y - r))
    }
}

/// A log of an axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AxisLog {
    /// Name of the file.
    pub file: String,
    /// Rows a second, Hz.
    pub rate_hz: f64,
    /// Signals.
    pub signals: AxisSignals,
    /// What was done to the columns before.
    pub notes: Vec<String>,
}

/// What to do where a column is missing.
const ADVICE: &str = "name the columns in the loop's description (`host-sim describe --log` drafts one)";

/// The header of a log.
///
/// # Errors
/// If it cannot be read.
pub fn header(path: &Path) -> Result<Vec<String>, TableError> {
    Ok(Table::open(path)?.header().map(str::to_owned).collect())
}

/// Places of an axis' columns in a table; those that there may be are in the order desired, velocity, reference velocity,
/// desired velocity, fresh.
struct Places {
    reference: usize,
    measured: usize,
    others: [Option<usize>; 5],
}

/// The logs of every axis of a file.
///
/// # Errors
/// Names the file, the line and the column of what is wrong, and what to do.
pub fn read(path: &Path, described: &LoopDescription, reading: &Reading) -> Result<Vec<AxisLog>, ChannelError> {
    let mut table = Table::open(path)?.forgiving();
    let file = table.file().to_owned();
    let time = table.require(&described.time, ADVICE)?;
    let places = |axis: &AxisDescription| -> Result<Places, TableError> {
        let optional = [
            axis.desired.as_ref(),
            axis.velocity.as_ref(),
            axis.reference_velocity.as_ref(),
            axis.desired_velocity.as_ref(),
            axis.fresh.as_ref().map(|fresh| &fresh.column),
        ];
        let mut others = [None; 5];
        for (place, column) in others.iter_mut().zip(optional) {
            *place = column.map(|column| table.require(column, ADVICE)).transpose()?;
        }
        let find = |column: &String| table.require(column, ADVICE);
        Ok(Places { reference: find(&axis.reference)?, measured: find(&axis.measured)?, others })
    };
    let places = described.axes.iter().map(places).collect::<Result<Vec<_>, _>>()?;
    let mut all: Vec<Columns> = places
        .iter()
        .map(|places| {
            let [desired, velocity, others @ ..] = places.others;
            Columns {
                rate: velocity.map(|_| Vec::new()),
                desired: desired.map(|_| Vec::new()),
                others: vec![Vec::new(); others.iter().flatten().count()],
                ..Columns::default()
            }
        })
        .collect();
    for row in table.rows() {
        let row = row?;
        let at = row.number(time)?;
        for (places, columns) in places.iter().zip(&mut all) {
            let number = |place: usize| row.within(place, LARGEST);
            columns.decimal |= row.text(time).contains(['.', 'e', 'E']);
            columns.lines.push(row.line());
            columns.time.push(at);
            columns.reference.push(number(places.reference)?);
            columns.measured.push(number(places.measured)?);
            let [desired, velocity, others @ ..] = places.others;
            for (column, place) in [(&mut columns.desired, desired), (&mut columns.rate, velocity)] {
                if let (Some(column), Some(place)) = (column, place) {
                    column.push(number(place)?);
                }
            }
            for (column, place) in columns.others.iter_mut().zip(others.into_iter().flatten()) {
                column.push(number(place)?);
            }
        }
    }
    let cut = table.cut().map(|line| format!("line {line}, the last one, is cut short: left out"));
    all.into_iter()
        .zip(&described.axes)
        .map(|(columns, axis)| {
            let columns = unwrapped(columns, axis.wrap);
            let (columns, mut notes) = plausible(columns, &described.time, reading)
                .map_err(|source| ChannelError::Implausible { file: format!("{file}, axis {}", axis.name), source })?;
            notes.splice(0..0, cut.clone());
            let record = impromptu_diagnosis::Record::new(&columns.time, &columns.reference, &columns.measured)
                .map_err(|source| ChannelError::Record { file: file.clone(), source })?;
            let rate_hz = 1.0 / record.period_s;
            Ok(AxisLog { file: file.clone(), rate_hz, signals: signals(columns, axis, rate_hz), notes })
        })
        .collect()
}

/// Columns of an angle without its wraps; reference and desired position follow what was measured.
fn unwrapped(mut columns: Columns, wrap: Option<f64>) -> Columns {
    let Some(turn) = wrap else { return columns };
    let follow = |values: &mut [f64], begin: f64| {
        let mut before = begin;
        for value in values {
            *value -= ((*value - before) / turn).round() * turn;
            before = *value;
        }
    };
    let begin = columns.measured.first().copied().unwrap_or(0.0);
    follow(&mut columns.measured, begin);
    follow(&mut columns.reference, begin);
    if let Some(desired) = &mut columns.desired {
        follow(desired, begin);
    }
    columns
}

fn signals(columns: Columns, axis: &AxisDescription, rate_hz: f64) -> AxisSignals {
    let Columns { reference, measured, rate, desired, others, .. } = columns;
    let mut others = others.into_iter();
    let mut next = |there: bool| if there { others.next() } else { None };
    let reference_velocity = next(axis.reference_velocity.is_some());
    let desired_velocity = next(axis.desired_velocity.is_some());
    let fresh = next(axis.fresh.is_some());
    let zeros = || vec![0.0; measured.len()];
    let desired = desired.unwrap_or_else(|| reference.clone());
    let desired_velocity = desired_velocity.unwrap_or_else(|| slope(&desired, rate_hz));
    let reference_velocity = match reference_velocity {
        Some(velocity) => velocity,
        None if axis.accepts.velocity() => desired_velocity.clone(),
        None => zeros(),
    };
    let velocity = rate.unwrap_or_else(zeros);
    let base = desired.clone();
    AxisSignals { desired, base, desired_velocity, reference, reference_velocity, velocity, ratio: 0.0, fresh, measured }
}

/// Rate of change by central differences.
pub fn slope(values: &[f64], rate_hz: f64) -> Vec<f64> {
    let last = values.len().saturating_sub(1);
    (0..values.len())
        .map(|index| {
            let (before, after) = (index.saturating_sub(1), (index + 1).min(last));
            (values[after] - values[before]) * rate_hz / (after - before).max(1) as f64
        })
        .collect()
}

/// A value between samples; the first and the last are held.
pub fn at(values: &[f64], place: f64) -> f64 {
    let last = values.len().saturating_sub(1);
    let place = place.clamp(0.0, last as f64);
    let (before, share) = (place as usize, place.fract());
    values[before] + share * (values[(before + 1).min(last)] - values[before])
}
