//! What can be wrong with a trajectory's name or file.

use thiserror::Error;

/// Why a trajectory was refused: names the file, line and field, and says what is expected.
#[derive(Debug, Error)]
pub enum TrajectoryError {
    /// The file cannot be opened or read.
    #[error("{file}: cannot be read: {source}")]
    Unreadable {
        /// File as given.
        file: String,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// The text is not CSV in UTF-8.
    #[error("{file}, line {line}: not CSV in UTF-8: {problem}")]
    NotCsv {
        /// File as given.
        file: String,
        /// Line, from 1; 0 when unknown.
        line: u64,
        /// What the CSV reader says.
        problem: String,
    },
    /// The header row is of neither format.
    #[error("{file}, line 1: {problem}; expected the header `t,x,y,z[,yaw]` or `duration,x^0,…,x^7,y^0,…,z^0,…,yaw^0,…,yaw^7`")]
    Header {
        /// File as given.
        file: String,
        /// What is wrong with it.
        problem: String,
    },
    /// Too few rows of data.
    #[error("{file}: {found} rows of data, at least {needed} are needed")]
    TooFewRows {
        /// File as given.
        file: String,
        /// Rows found below the header.
        found: usize,
        /// Rows needed.
        needed: usize,
    },
    /// A row with missing or surplus columns.
    #[error("{file}, line {line}: {found} columns, the header has {expected}; {problem}")]
    Columns {
        /// File as given.
        file: String,
        /// Line, from 1.
        line: u64,
        /// Columns found.
        found: usize,
        /// Columns expected.
        expected: usize,
        /// The first column that is missing or surplus.
        problem: String,
    },
    /// A field that is not the number it should be.
    #[error("{file}, line {line}, field `{field}`: {problem}")]
    Field {
        /// File as given.
        file: String,
        /// Line, from 1.
        line: u64,
        /// Column's name in the header.
        field: String,
        /// What is wrong and what is expected.
        problem: String,
    },
    /// A segment that does not begin where the one before ends.
    #[error(
        "{file}, line {line}, field `{field}`: the segment begins {jump:.4} {unit} away from the end of the one before; at most \
         {tolerance} {unit} are allowed"
    )]
    Join {
        /// File as given.
        file: String,
        /// Line of the later segment, from 1.
        line: u64,
        /// Coefficient that decides the value at the segment's beginning.
        field: String,
        /// Size of the jump.
        jump: f64,
        /// Allowed size.
        tolerance: f64,
        /// Unit of both.
        unit: &'static str,
    },
    /// Longer than can be meant.
    #[error("{name}: lasts {seconds} s, at most 3600 s are flown; is the time in seconds?")]
    TooLong {
        /// File or catalogue name.
        name: String,
        /// Duration, s.
        seconds: f64,
    },
    /// A sampling rate that no position loop has.
    #[error("rate {rate_hz} Hz: expected 1 to 1000 Hz")]
    Rate {
        /// Rate asked for, Hz.
        rate_hz: f64,
    },
    /// A name that the catalogue does not know, or an argument that it cannot use.
    #[error("trajectory `{name}`: {problem}; known: {}", super::names::KNOWN_NAMES.join(", "))]
    Name {
        /// Name as given.
        name: String,
        /// What is wrong with it.
        problem: String,
    },
}
