//! Channels of logs: one reference, one measured value, for the diagnosis.
//!
//! *in* flight logs, or CSV files of any loop; *out* records; *never* a measured value that is older than stated; *source* Zhou
//! 2017, Fig. 1: u and y of the baseline. Of a flight log the desired position is u: without an add-on it is the reference but
//! for a dither, which the velocity reference does not share and which here counts as noise.

use std::path::Path;

use impromptu_diagnosis::{
    Record, RecordError,
    plausibility::{Columns, Implausible, Reading},
};
use impromptu_sim::{
    columns::{LARGEST, Table, TableError},
    flight_log::FlightLog,
};

use crate::gathered::{Places, gathered};

/// A channel by name.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Name: an axis, or the column that was measured.
    pub name: String,
    /// Unit of its values.
    pub unit: &'static str,
    /// Record.
    pub record: Record,
    /// What was done to the columns of the log before.
    pub notes: Vec<String>,
}

/// Why a file holds no channel.
#[derive(Debug, thiserror::Error)]
pub enum ChannelError {
    /// It is no table of numbers with the columns wanted.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The columns cannot be what they are taken for.
    #[error("{file}: {source}")]
    Implausible {
        /// The file.
        file: String,
        /// Why.
        source: Implausible,
    },
    /// The columns are no record.
    #[error("{file}: {source}")]
    Record {
        /// The file.
        file: String,
        /// Why.
        source: RecordError,
    },
}

/// What to do where a column is missing.
const ADVICE: &str = "name the columns with --columns TIME,REFERENCE,MEASURED, or see `host-sim diagnose --help`";

/// Axes of a flight log.
pub const AXES: [&str; 3] = ["x", "y", "z"];

/// An axis of flight logs as a record; `age_s` is the age of what was measured.
///
/// # Errors
/// If a log is too short, or their rates differ.
pub fn of_logs<'a>(logs: impl IntoIterator<Item = &'a FlightLog>, axis: usize, age_s: f64) -> Result<Record, RecordError> {
    let records = logs.into_iter().map(|log| {
        let desired: Vec<f64> = log.rows.iter().map(|row| row.desired.position[axis]).collect();
        let measured: Vec<f64> = log.rows.iter().map(|row| row.measured_position[axis]).collect();
        let time: Vec<f64> = (0..log.rows.len()).map(|row| row as f64 / log.rate_hz).collect();
        fresh(&time, &desired, &measured, age_s)
    });
    Record::joined(records.collect::<Result<Vec<_>, _>>()?)
}

/// A record whose measured values are as old as stated, brought to the time at which they were true.
fn fresh(time: &[f64], reference: &[f64], measured: &[f64], age_s: f64) -> Result<Record, RecordError> {
    let record = Record::new(time, reference, measured)?;
    if age_s <= 0.0 {
        return Ok(record);
    }
    let ticks = age_s / record.period_s;
    let (whole, share) = (ticks as usize, ticks.fract());
    let later: Vec<f64> = measured.windows(2).skip(whole).map(|pair| pair[0] + share * (pair[1] - pair[0])).collect();
    Record::new(&time[..later.len()], &reference[..later.len()], &later)
}

/// Largest distance between two paths; each pair is an axis of them.
pub fn largest_distance<'a>(axes: impl Iterator<Item = (&'a [f64], &'a [f64])>) -> f64 {
    let mut squares: Vec<f64> = Vec::new();
    for (path, other) in axes {
        squares.resize(squares.len().max(path.len()), 0.0);
        let errors = path.iter().zip(other).map(|(value, other)| value - other);
        squares.iter_mut().zip(errors).for_each(|(square, error)| *square += error * error);
    }
    squares.into_iter().fold(0.0, f64::max).sqrt()
}

/// Channels of a CSV file: those of the columns asked for (time, reference, measured); or every axis of a flight log, of which
/// the diagnosis needs `time_s`, `desired_{x,y,z}_m` and `measured_{x,y,z}_m`; or `time_s`, `reference` (or `desired`) and
/// `measured`.
///
/// # Errors
/// Names the file, the line and the column of what is wrong.
pub fn read(path: &Path, columns: Option<&[String; 3]>, age_s: f64, reading: &Reading) -> Result<Vec<Channel>, ChannelError> {
    let table = Table::open(path)?.forgiving();
    let file = table.file().to_owned();
    let has = |column: &str| table.find(column).is_some();
    let names = |time: &str, reference: &str, measured: &str| [time, reference, measured].map(str::to_owned);
    let wanted: Vec<(String, &'static str, [String; 3])> = match columns {
        Some(columns) => vec![(columns[2].clone(), "units", columns.clone())],
        None => {
            let axes =
                AXES.iter().map(|axis| (axis, names("time_s", &format!("desired_{axis}_m"), &format!("measured_{axis}_m"))));
            let flight: Vec<_> = axes
                .filter(|(_, columns)| has(&columns[1]) && has(&columns[2]))
                .map(|(axis, columns)| ((*axis).to_owned(), "m", columns))
                .collect();
            if flight.is_empty() {
                let reference = if !has("reference") && has("desired") { "desired" } else { "reference" };
                vec![("measured".to_owned(), "units", names("time_s", reference, "measured"))]
            } else {
                flight
            }
        }
    };
    let find = |column: &String| table.require(column, ADVICE);
    let places = wanted
        .iter()
        .map(|(_, _, [time, reference, measured])| {
            Ok(Places { time: find(time)?, reference: find(reference)?, measured: find(measured)?, rate: None })
        })
        .collect::<Result<Vec<Places>, TableError>>()?;
    wanted
        .into_iter()
        .zip(gathered(table, &places, LARGEST)?)
        .map(|((name, unit, columns), gathered)| {
            let (Columns { time, reference, measured, .. }, notes) = gathered
                .plausible(&columns[0], reading)
                .map_err(|source| ChannelError::Implausible { file: file.clone(), source })?;
            let in_file = |source| ChannelError::Record { file: file.clone(), source };
            Ok(Channel { name, unit, record: fresh(&time, &reference, &measured, age_s).map_err(in_file)?, notes })
        })
        .collect()
}
