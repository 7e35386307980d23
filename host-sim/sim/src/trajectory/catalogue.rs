//! Trajectories by name and by file, for the command line.

use super::pen::Pace;
use super::rows::Rows;
use super::{Motion, MultisineSettings, SplineSettings, Trajectory, TrajectoryError};
use super::{circle, figure_eight, growing_tones, helix, letters, lissajous, multisine, random_spline};
use super::{segments, single_tone, star, stroke, table, trefoil};
use impromptu_files::reading;
use std::io::{BufReader, Read};
use std::path::Path;
use std::str::FromStr;

/// The motion of that name, in its standard size and speed; see [`KNOWN_NAMES`](super::KNOWN_NAMES).
///
/// # Errors
/// An unknown name (all known ones are listed), a missing, surplus or impossible argument.
pub fn by_name(name: &str) -> Result<Motion, TrajectoryError> {
    let mut words = Words::new(name);
    let motion = match words.kind {
        "strokes" => stroke(words.number("SEED")?, words.number("INDEX")?),
        "circle" => circle(1.0, 6.0, 2.0),
        "figure8" => figure_eight(3.0, 1.5, 8.0, 2.0),
        "lissajous" => lissajous([3.0, 2.0, 0.8], [3, 2, 1], 16.0, 1.0),
        "helix" => helix(0.8, 0.4, 5.0, 3.0),
        "trefoil" => trefoil(3.0, 14.0, 1.0),
        "star" => star(5, 1.5, 0.5, Pace::default()),
        "letters" => letters(words.text("TEXT")?, 1.5, Pace::default())?,
        "multisine" => {
            multisine(words.number("SEED")?, words.within("SECONDS", 180.0, 6.0, 3600.0)?, &MultisineSettings::default())
        }
        "spline" => {
            random_spline(words.number("SEED")?, words.within("SECONDS", 180.0, 6.0, 3590.0)?, &SplineSettings::default())
        }
        "tones" => growing_tones([6.0, 7.5, 9.0], words.within("SECONDS", 400.0, 6.0, 3600.0)?),
        "tone" => {
            let axis = match words.text("AXIS")? {
                "x" => 0,
                "y" => 1,
                "z" => 2,
                other => {
                    return Err(words.refused(format!("AXIS is `{other}`, expected x, y or z")));
                }
            };
            let amplitude = words.within("AMPLITUDE", 0.5, 0.0, 10.0)?;
            let period = words.within("PERIOD", 4.0, 0.1, 60.0)?;
            single_tone(axis, amplitude, period, 6.0 * period)
        }
        other => return Err(words.refused(format!("`{other}` is not a known name"))),
    };
    if let Some(surplus) = words.rest.next() {
        return Err(words.refused(format!("argument `{surplus}` is surplus")));
    }
    Ok(motion.named(name))
}

/// A name's words, split at colons.
struct Words<'a> {
    name: &'a str,
    kind: &'a str,
    rest: std::str::Split<'a, char>,
}

impl<'a> Words<'a> {
    fn new(name: &'a str) -> Self {
        let mut rest = name.split(':');
        let kind = rest.next().unwrap_or_default();
        Self { name, kind, rest }
    }

    fn refused(&self, problem: String) -> TrajectoryError {
        TrajectoryError::Name { name: self.name.into(), problem }
    }

    fn text(&mut self, argument: &str) -> Result<&'a str, TrajectoryError> {
        match self.rest.next() {
            Some(word) => Ok(word),
            None => Err(self.refused(format!("{argument} is missing"))),
        }
    }

    fn number<T: FromStr>(&mut self, argument: &str) -> Result<T, TrajectoryError> {
        let word = self.text(argument)?;
        word.parse().map_err(|_| self.refused(format!("{argument} is `{word}`, expected a number")))
    }

    fn within(&mut self, argument: &str, default: f64, low: f64, high: f64) -> Result<f64, TrajectoryError> {
        let Some(word) = self.rest.next() else {
            return Ok(default);
        };
        match word.parse::<f64>() {
            Ok(value) if (low..=high).contains(&value) => Ok(value),
            _ => Err(self.refused(format!("{argument} is `{word}`, expected a number from {low} to {high}"))),
        }
    }
}

/// The motion of a CSV file in either format, recognised by its header: polynomial segments
/// ([`super::read_segments`]) or a table of points ([`super::read_table`]).
///
/// # Errors
/// An unreadable or malformed file; the message names line and field.
pub fn load(path: &Path) -> Result<Motion, TrajectoryError> {
    let file = path.display().to_string();
    match reading::open(path, reading::TABLE) {
        Ok(source) => read(BufReader::new(source), &file),
        Err(source) => Err(TrajectoryError::Unreadable { file, source }),
    }
}

/// As [`load`], from any source of bytes; `file` is the name for messages and for the motion.
///
/// # Errors
/// As [`load`].
pub fn read(source: impl Read, file: &str) -> Result<Motion, TrajectoryError> {
    let rows = Rows::read(source, file)?;
    match rows.header.first().map(String::as_str) {
        Some("duration") => segments::from_rows(&rows),
        Some("t") => table::from_rows(&rows),
        first => Err(TrajectoryError::Header {
            file: file.into(),
            problem: format!("the first column is `{}`", first.unwrap_or_default()),
        }),
    }
}

impl Trajectory {
    /// The catalogue's trajectory of that name at normal speed; see [`by_name`].
    ///
    /// # Errors
    /// An unknown name, a malformed argument or a rate outside 1 to 1000 Hz.
    pub fn by_name(name: &str, rate_hz: f64) -> Result<Self, TrajectoryError> {
        by_name(name)?.sampled(rate_hz)
    }

    /// The trajectory of a CSV file at normal speed; see [`load`].
    ///
    /// # Errors
    /// An unreadable or malformed file (the error names line and field) or a rate outside 1 to 1000 Hz.
    pub fn load(path: &Path, rate_hz: f64) -> Result<Self, TrajectoryError> {
        load(path)?.sampled(rate_hz)
    }
}
