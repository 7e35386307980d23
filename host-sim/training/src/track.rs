//! Tracks of logs: what an axis was asked, what was measured, and how fast that changed where the log has it.
//!
//! *in* CSV files of any loop; *out* [`Track`]s at a uniform rate, in the units of the log; *never* a choice between two columns
//! that could both be meant, nor a value that the learner's 32 bits would round to more than a hundredth; *source* Zhou 2017,
//! Fig. 1: u and y of the baseline.
//!
//! Names that are known without being told, `a` being x, y or z:
//!
//! | log | time, s | reference, m | measured, m | rate, m/s |
//! |---|---|---|---|---|
//! | `collect`, `train` | `time_s` | `desired_a_m` | `measured_a_m` | `measured_va_m_s` |
//! | motion capture beside a Crazyflie | `t` | `sp_ctrltarget_a` | `pa`, `est_stateEstimate_a` | `va`, `est_stateEstimate_va` |
//! | a Crazyflie's own | `time` | `ctrltarget.a` | `stateEstimate.a` | `stateEstimate.va` |
//! | any loop, its own units | each of these | `reference`, `desired` | `measured` | `rate` |

use std::path::Path;

use impromptu_diagnosis::{Record, RecordError, plausibility::Reading};
use impromptu_sim::columns::{Table, TableError};

use crate::{
    channel::{AXES, ChannelError},
    gathered::{Places, gathered},
};

/// An axis of a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// Name: an axis, or the column that was measured.
    pub name: String,
    /// Unit of its values.
    pub unit: &'static str,
    /// Time between samples, s.
    pub period_s: f64,
    /// Reference that the loop received, which was the desired trajectory.
    pub reference: Vec<f64>,
    /// Measured value when the reference was handed over.
    pub measured: Vec<f64>,
    /// Its rate of change a second, if the log has it.
    pub rate: Option<Vec<f64>>,
    /// What was done to the columns of the log before.
    pub notes: Vec<String>,
}

/// Columns of a track.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Columns {
    /// Time, s.
    pub time: String,
    /// Reference.
    pub reference: String,
    /// Measured value.
    pub measured: String,
    /// Its rate of change, if there is one.
    pub rate: Option<String>,
}

/// Why a file holds no track.
#[derive(Debug, thiserror::Error)]
pub enum TrackError {
    /// It is no table of numbers with the columns wanted, or the columns are no record.
    #[error(transparent)]
    Channel(#[from] ChannelError),
    /// Several columns could be meant.
    #[error("{file}: {found} could each be the {what}; say which with {option}")]
    Ambiguous {
        /// The file.
        file: String,
        /// The columns.
        found: String,
        /// What they could be.
        what: String,
        /// The option that settles it.
        option: String,
    },
}

impl From<TableError> for TrackError {
    fn from(error: TableError) -> Self {
        Self::Channel(error.into())
    }
}

/// Largest magnitude of a value: beyond it 32 bits round to more than a hundredth.
const FARTHEST: f64 = 1e5;
/// What to do where a column is missing.
const ADVICE: &str = "name the columns with --columns TIME,REFERENCE,MEASURED[,RATE], or see `host-sim learn --help`";

const TIMES: [&str; 3] = ["time_s", "t", "time"];

/// Names of the reference of an axis.
fn references(axis: &str) -> [String; 3] {
    [format!("desired_{axis}_m"), format!("sp_ctrltarget_{axis}"), format!("ctrltarget.{axis}")]
}

/// Names of the measured position of an axis, each with that of its rate.
fn positions(axis: &str) -> [[String; 2]; 4] {
    [
        [format!("measured_{axis}_m"), format!("measured_v{axis}_m_s")],
        [format!("p{axis}"), format!("v{axis}")],
        [format!("est_stateEstimate_{axis}"), format!("est_stateEstimate_v{axis}")],
        [format!("stateEstimate.{axis}"), format!("stateEstimate.v{axis}")],
    ]
}

/// What a table's header offers.
struct Header<'a> {
    file: &'a str,
    has: &'a dyn Fn(&str) -> bool,
}

impl Header<'_> {
    /// The one of these names that there is.
    fn one(&self, names: Vec<String>, what: &str, option: &str) -> Result<Option<String>, TrackError> {
        let mut found: Vec<String> = names.into_iter().filter(|name| (self.has)(name)).collect();
        if found.len() > 1 {
            let found = found.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(" and ");
            return Err(TrackError::Ambiguous { file: self.file.into(), found, what: what.into(), option: option.into() });
        }
        Ok(found.pop())
    }

    /// The columns of every track that is known by its names, as axis, unit and columns.
    fn known(&self, axes: &[String]) -> Result<Vec<(String, &'static str, Columns)>, TrackError> {
        let option = "--columns TIME,REFERENCE,MEASURED[,RATE], once for each axis";
        let time = self.one(TIMES.map(str::to_owned).into(), "time", option)?.unwrap_or_else(|| TIMES[0].into());
        let mut known = Vec::new();
        for axis in AXES.iter().filter(|axis| axes.is_empty() || axes.iter().any(|wanted| wanted == *axis)) {
            let positions = positions(axis);
            let reference = self.one(references(axis).into(), &format!("reference of {axis}"), option)?;
            let example = reference.as_ref().map_or_else(
                || option.to_owned(),
                |reference| format!("{option}, as --columns {time},{reference},{}", self.first(&positions)),
            );
            let names = positions.iter().map(|[position, _]| position.clone()).collect();
            let measured = self.one(names, &format!("measured position of {axis}"), &example)?;
            let (Some(reference), Some(measured)) = (reference, measured) else { continue };
            let rate = positions.iter().find(|[position, _]| *position == measured).map(|[_, rate]| rate.clone());
            let rate = rate.filter(|rate| (self.has)(rate));
            known.push(((*axis).to_owned(), "m", Columns { time: time.clone(), reference, measured, rate }));
        }
        if known.is_empty() {
            let names = vec!["reference".to_owned(), "desired".to_owned()];
            let reference = self.one(names, "reference", option)?.unwrap_or_else(|| "reference".into());
            let rate = Some("rate".to_owned()).filter(|rate| (self.has)(rate));
            known.push(("measured".into(), "units", Columns { time, reference, measured: "measured".into(), rate }));
        }
        Ok(known)
    }

    fn first(&self, positions: &[[String; 2]]) -> String {
        positions.iter().map(|[position, _]| position).find(|name| (self.has)(name)).cloned().unwrap_or_default()
    }
}

/// Tracks of a CSV file: those of the columns asked for, or of every axis that is known by its names, or of these `axes` alone.
///
/// # Errors
/// Names the file, the line or row and the column of what is wrong, and what to do.
pub fn tracks(path: &Path, columns: &[Columns], axes: &[String], reading: &Reading) -> Result<Vec<Track>, TrackError> {
    let table = Table::open(path)?.forgiving();
    let file = table.file().to_owned();
    let wanted = if columns.is_empty() {
        let has = |column: &str| table.find(column).is_some();
        Header { file: &file, has: &has }.known(axes)?
    } else {
        let metres = |column: &str| AXES.iter().any(|axis| positions(axis).iter().any(|[position, _]| position == column));
        let unit = |column: &str| if metres(column) { "m" } else { "units" };
        columns.iter().map(|columns| (columns.measured.clone(), unit(&columns.measured), columns.clone())).collect()
    };
    let find = |column: &String| table.require(column, ADVICE);
    let places = wanted
        .iter()
        .map(|(_, _, columns)| {
            let rate = columns.rate.as_ref().map(find).transpose()?;
            Ok(Places {
                time: find(&columns.time)?,
                reference: find(&columns.reference)?,
                measured: find(&columns.measured)?,
                rate,
            })
        })
        .collect::<Result<Vec<Places>, TableError>>()?;
    let in_file = |source| ChannelError::Record { file: file.clone(), source };
    let mut tracks = Vec::with_capacity(wanted.len());
    for ((name, unit, columns), gathered) in wanted.into_iter().zip(gathered(table, &places, FARTHEST)?) {
        let (found, notes) = gathered
            .plausible(&columns.time, reading)
            .map_err(|source| ChannelError::Implausible { file: file.clone(), source })?;
        let (period_s, reference, measured) = uniform(&found.time, &found.reference, &found.measured).map_err(in_file)?;
        // The same rows are filled again: the times are the same.
        let rate = found.rate.map(|rates| uniform(&found.time, &rates, &rates).map_err(in_file)).transpose()?;
        tracks.push(Track { name, unit, period_s, reference, measured, rate: rate.map(|(_, _, rate)| rate), notes });
    }
    Ok(tracks)
}

/// Period and both columns at a uniform rate.
fn uniform(time: &[f64], reference: &[f64], measured: &[f64]) -> Result<(f64, Vec<f64>, Vec<f64>), RecordError> {
    let Record { period_s, segments } = Record::new(time, reference, measured)?;
    let segment = segments.into_iter().next().unwrap_or_default();
    Ok((period_s, segment.reference, segment.measured))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(columns: &str, axes: &[&str]) -> Result<Vec<(String, &'static str, Columns)>, TrackError> {
        let has = |column: &str| columns.split(',').any(|name| name == column);
        let axes: Vec<String> = axes.iter().map(|axis| (*axis).to_owned()).collect();
        Header { file: "a.csv", has: &has }.known(&axes)
    }

    #[test]
    fn columns_are_known_by_their_names() {
        let found = known("t,px,py,pz,vx,sp_ctrltarget_x,sp_ctrltarget_y", &[]).unwrap();
        let columns = |time: &str, reference: &str, measured: &str, rate: Option<&str>| Columns {
            time: time.into(),
            reference: reference.into(),
            measured: measured.into(),
            rate: rate.map(str::to_owned),
        };
        assert_eq!(found[0], ("x".into(), "m", columns("t", "sp_ctrltarget_x", "px", Some("vx"))));
        assert_eq!(found[1..], [("y".into(), "m", columns("t", "sp_ctrltarget_y", "py", None))]);
        let found = known("time_s,desired_x_m,measured_x_m,reference_x_m,desired_z_m,measured_z_m", &["z"]).unwrap();
        assert_eq!(found, [("z".into(), "m", columns("time_s", "desired_z_m", "measured_z_m", None))]);
        let found = known("time_s,desired,measured,rate", &[]).unwrap();
        assert_eq!(found, [("measured".into(), "units", columns("time_s", "desired", "measured", Some("rate")))]);
    }

    #[test]
    fn two_columns_that_could_be_meant_are_refused_with_the_option_that_settles_it() {
        for (columns, named) in [
            ("t,time_s,px,sp_ctrltarget_x", "`time_s` and `t` could each be the time"),
            ("t,px,est_stateEstimate_x,sp_ctrltarget_x", "as --columns t,sp_ctrltarget_x,px"),
            ("t,px,ctrltarget.x,sp_ctrltarget_x", "could each be the reference of x"),
            ("t,reference,desired,measured", "could each be the reference;"),
        ] {
            let refusal = known(columns, &[]).expect_err(columns).to_string();
            assert!(refusal.starts_with("a.csv: ") && refusal.contains(named) && refusal.contains("--columns"), "{refusal}");
        }
    }
}
