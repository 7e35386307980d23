//! Flight logs: what a loop was asked, what it was told, what it did; one row for each reference tick.
//!
//! *in/out* CSV with a header; *never* a row with a number that is not finite, nor time that does not increase;
//! *source* Zhou 2017, Fig. 1: u (reference), y and x (measured) of the baseline are all that training needs.
//!
//! Columns, in SI units and the world frame ENU: `time_s`; `desired_{x,y,z}_m`, `desired_{vx,vy,vz}_m_s`,
//! `desired_{ax,ay,az}_m_s2` (optional), `desired_yaw_rad` (optional); `reference_{x,y,z}_m`, `reference_{vx,vy,vz}_m_s` (what
//! the loop received); `measured_{x,y,z}_m`, `measured_{vx,vy,vz}_m_s` (as the loop received it, so as late as that);
//! `measured_{roll,pitch,yaw}_rad`, `measured_{wx,wy,wz}_rad_s`, `measured_az_m_s2` (optional: attitude, body rates, vertical
//! acceleration, fresher than the position); `true_{x,y,z}_m` (optional, simulators only). Further columns are ignored.

use std::{io, ops::Range, path::Path};

use impromptu_flight::quadrotor::MEASURED;

use crate::{
    columns::{Table, TableError},
    trajectory::Sample,
};

/// Measured channels behind position and velocity.
pub const BODY: usize = MEASURED - 6;

/// Columns of these.
const BODY_COLUMNS: [&str; BODY] = [
    "measured_roll_rad",
    "measured_pitch_rad",
    "measured_yaw_rad",
    "measured_wx_rad_s",
    "measured_wy_rad_s",
    "measured_wz_rad_s",
    "measured_az_m_s2",
];

/// One reference tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LogRow {
    /// Time since the start, s.
    pub time: f64,
    /// Desired state.
    pub desired: Sample,
    /// Position reference that the loop received, m.
    pub reference_position: [f64; 3],
    /// Velocity reference that the loop received, m/s.
    pub reference_velocity: [f64; 3],
    /// Position as the loop was told, m.
    pub measured_position: [f64; 3],
    /// Velocity as the loop was told, m/s.
    pub measured_velocity: [f64; 3],
    /// Roll, pitch, yaw (rad), body rates (rad/s) and vertical acceleration (m/s²) as the add-on was told, where the log has
    /// them.
    pub measured_body: Option<[f64; BODY]>,
    /// True position, m, where somebody knows it.
    pub true_position: Option<[f64; 3]>,
}

/// A flight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FlightLog {
    /// Name of the trajectory or file.
    pub name: String,
    /// Rows a second, Hz.
    pub rate_hz: f64,
    /// Rows over which the error is measured.
    pub scored: Range<usize>,
    /// Rows.
    pub rows: Vec<LogRow>,
}

/// Why a log cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// It is no table of numbers with the columns of a log.
    #[error(transparent)]
    Table(#[from] TableError),
    /// Time stands still or runs backwards.
    #[error("{file}, line {line}: `time_s` does not increase; sort the rows and drop repeated ones")]
    Time {
        /// The file.
        file: String,
        /// The line, from 1.
        line: u64,
    },
    /// Time jumps.
    #[error("{file}, line {line}: {gap:.3} s without a row; cut the log there into two files")]
    Gap {
        /// The file.
        file: String,
        /// The line behind the gap, from 1.
        line: u64,
        /// Its length, s.
        gap: f64,
    },
    /// Too little to learn from.
    #[error("{file}: {rows} rows are too few; a log needs at least {needed}")]
    Short {
        /// The file.
        file: String,
        /// Rows found.
        rows: usize,
        /// Rows needed.
        needed: usize,
    },
}

/// Longest time without a row, s.
const LONGEST_GAP: f64 = 0.1;
/// Farthest position, m: a map's grid has coordinates of ten thousand kilometres.
const FARTHEST: f64 = 1e8;
/// Fastest and hardest that a vehicle moves or is asked to, m/s and m/s².
const FASTEST: f64 = 1e4;
/// Fewest rows of a log.
const FEWEST_ROWS: usize = 50;

fn names(signal: &str, derivative: &str, unit: &str) -> [String; 3] {
    ["x", "y", "z"].map(|axis| format!("{signal}_{derivative}{axis}_{unit}"))
}

impl FlightLog {
    /// The log as CSV; `file` is the name in messages.
    ///
    /// # Errors
    /// When the `csv` crate fails, which no log makes it do.
    pub fn to_csv(&self, file: &str) -> Result<Vec<u8>, LogError> {
        let in_file = |source| TableError::File { file: file.into(), source };
        let in_csv = |source| TableError::Csv { file: file.into(), source };
        let mut writer = csv::Writer::from_writer(Vec::new());
        let mut header = vec!["time_s".to_owned()];
        for (signal, derivative, unit) in [
            ("desired", "", "m"),
            ("desired", "v", "m_s"),
            ("desired", "a", "m_s2"),
            ("reference", "", "m"),
            ("reference", "v", "m_s"),
            ("measured", "", "m"),
            ("measured", "v", "m_s"),
        ] {
            header.extend(names(signal, derivative, unit));
        }
        header.push("desired_yaw_rad".into());
        let with_body = self.rows.iter().all(|row| row.measured_body.is_some());
        if with_body {
            header.extend(BODY_COLUMNS.map(str::to_owned));
        }
        let with_truth = self.rows.iter().all(|row| row.true_position.is_some());
        if with_truth {
            header.extend(names("true", "", "m"));
        }
        writer.write_record(&header).map_err(in_csv)?;
        for row in &self.rows {
            let desired = row.desired;
            let vectors = [
                desired.position,
                desired.velocity,
                desired.acceleration,
                row.reference_position,
                row.reference_velocity,
                row.measured_position,
                row.measured_velocity,
            ];
            let body = row.measured_body.filter(|_| with_body);
            let truth = row.true_position.filter(|_| with_truth);
            let cells = std::iter::once(row.time)
                .chain(vectors.into_iter().flatten())
                .chain([desired.yaw])
                .chain(body.into_iter().flatten())
                .chain(truth.into_iter().flatten());
            writer.write_record(cells.map(|value| value.to_string())).map_err(in_csv)?;
        }
        Ok(writer.into_inner().map_err(|error| in_file(error.into_error()))?)
    }

    /// Reads a log and brings it to `rate_hz` rows a second by linear interpolation between its rows.
    ///
    /// # Errors
    /// Names the file, the line and the column of what is wrong.
    pub fn read(path: &Path, rate_hz: f64) -> Result<Self, LogError> {
        Self::of_table(Table::open(path)?, rate_hz)
    }

    /// [`FlightLog::read`] from any source; `file` is the name in messages.
    ///
    /// # Errors
    /// As [`FlightLog::read`].
    pub fn parse(reader: impl io::Read, file: &str, rate_hz: f64) -> Result<Self, LogError> {
        Self::of_table(Table::new(reader, file)?, rate_hz)
    }

    fn of_table<R: io::Read>(mut table: Table<R>, rate_hz: f64) -> Result<Self, LogError> {
        let file = table.file().to_owned();
        let require = |column: &str| table.require(column, "`host-sim train --help` lists the columns");
        let vector = |signal: &str, derivative: &str, unit: &str| -> Result<[usize; 3], TableError> {
            let [x, y, z] = names(signal, derivative, unit);
            Ok([require(&x)?, require(&y)?, require(&z)?])
        };
        let optional = |signal: &str, derivative: &str, unit: &str| {
            let [x, y, z] = names(signal, derivative, unit).map(|name| table.find(&name));
            Some([x?, y?, z?])
        };
        let time = require("time_s")?;
        let required = [
            vector("desired", "", "m")?,
            vector("desired", "v", "m_s")?,
            vector("reference", "", "m")?,
            vector("reference", "v", "m_s")?,
            vector("measured", "", "m")?,
            vector("measured", "v", "m_s")?,
        ];
        let (acceleration, yaw, truth) =
            (optional("desired", "a", "m_s2"), table.find("desired_yaw_rad"), optional("true", "", "m"));
        let body = BODY_COLUMNS.map(|column| table.find(column));
        let body = body.iter().all(Option::is_some).then(|| body.map(Option::unwrap_or_default));
        let mut rows: Vec<LogRow> = Vec::new();
        for row in table.rows() {
            let cells = row?;
            let line = cells.line();
            let [position, velocity, reference_position, reference_velocity, measured_position, measured_velocity] = required;
            let row = LogRow {
                time: cells.number(time)?,
                desired: Sample {
                    position: cells.numbers_within(position, FARTHEST)?,
                    velocity: cells.numbers_within(velocity, FASTEST)?,
                    acceleration: acceleration.map_or(Ok([0.0; 3]), |places| cells.numbers_within(places, FASTEST))?,
                    yaw: yaw.map_or(Ok(0.0), |place| cells.within(place, FASTEST))?,
                },
                reference_position: cells.numbers_within(reference_position, FARTHEST)?,
                reference_velocity: cells.numbers_within(reference_velocity, FASTEST)?,
                measured_position: cells.numbers_within(measured_position, FARTHEST)?,
                measured_velocity: cells.numbers_within(measured_velocity, FASTEST)?,
                measured_body: body.map(|places| cells.numbers_within(places, FASTEST)).transpose()?,
                true_position: truth.map(|places| cells.numbers_within(places, FARTHEST)).transpose()?,
            };
            if let Some(previous) = rows.last() {
                let gap = row.time - previous.time;
                if gap <= 0.0 {
                    return Err(LogError::Time { file, line });
                }
                if gap > LONGEST_GAP {
                    return Err(LogError::Gap { file, line, gap });
                }
            }
            rows.push(row);
        }
        if rows.len() < FEWEST_ROWS {
            return Err(LogError::Short { file, rows: rows.len(), needed: FEWEST_ROWS });
        }
        let rows = resampled(&rows, rate_hz);
        Ok(Self { name: file, rate_hz, scored: 0..rows.len(), rows })
    }
}

/// Rows at a uniform rate, by linear interpolation; a log that already has that rate keeps its bits.
fn resampled(rows: &[LogRow], rate_hz: f64) -> Vec<LogRow> {
    let uniform = rows.windows(2).all(|pair| ((pair[1].time - pair[0].time) * rate_hz - 1.0).abs() < 1e-6);
    if uniform {
        return rows.to_vec();
    }
    let (start, end) = (rows[0].time, rows[rows.len() - 1].time);
    let count = ((end - start) * rate_hz).floor() as usize + 1;
    let mut behind = 0;
    (0..count)
        .map(|tick| {
            let time = start + tick as f64 / rate_hz;
            while behind + 2 < rows.len() && rows[behind + 1].time <= time {
                behind += 1;
            }
            between(&rows[behind], &rows[behind + 1], time)
        })
        .collect()
}

fn between(a: &LogRow, b: &LogRow, time: f64) -> LogRow {
    let share = ((time - a.time) / (b.time - a.time)).clamp(0.0, 1.0);
    let scalar = |a: f64, b: f64| a + (b - a) * share;
    let vector = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|i| scalar(a[i], b[i]));
    LogRow {
        time,
        desired: Sample {
            position: vector(a.desired.position, b.desired.position),
            velocity: vector(a.desired.velocity, b.desired.velocity),
            acceleration: vector(a.desired.acceleration, b.desired.acceleration),
            yaw: scalar(a.desired.yaw, b.desired.yaw),
        },
        reference_position: vector(a.reference_position, b.reference_position),
        reference_velocity: vector(a.reference_velocity, b.reference_velocity),
        measured_position: vector(a.measured_position, b.measured_position),
        measured_velocity: vector(a.measured_velocity, b.measured_velocity),
        measured_body: a.measured_body.zip(b.measured_body).map(|(a, b)| std::array::from_fn(|i| scalar(a[i], b[i]))),
        true_position: a.true_position.zip(b.true_position).map(|(a, b)| vector(a, b)),
    }
}
