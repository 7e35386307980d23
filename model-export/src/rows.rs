//! Rows of features in CSV: what int8 is calibrated on and what float and quantised are compared over.
//!
//! *in* a header, then a column for each feature in the description's order and units; *out* rows of finite f32; *never* a row
//! left out in silence: what is wrong is refused with its line and column.

use std::{
    io,
    path::{Path, PathBuf},
};

use impromptu_files::reading;

use csv::{ReaderBuilder, StringRecord, Trim};

/// Why rows were refused.
#[derive(Debug, thiserror::Error)]
#[error("{path}{place}: {reason}")]
pub struct RowsError {
    path: PathBuf,
    place: Place,
    reason: Reason,
}

#[derive(Debug)]
enum Place {
    File,
    Line(u64),
    Column(u64, usize),
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(line) => write!(f, ", line {line}"),
            Self::Column(line, column) => write!(f, ", line {line}, column {column}"),
        }
    }
}

#[derive(Debug, thiserror::Error)]
enum Reason {
    #[error(transparent)]
    Io(#[from] io::Error),
    #[error("{0}")]
    Csv(csv::Error),
    #[error("{found} columns where the model has {expected} features: give a column for each, in the description's order")]
    Columns { found: usize, expected: usize },
    #[error("a number where the header should name the columns: put a line with names first")]
    NoHeader,
    #[error("`{text}` ({name}) is not a finite number")]
    Number { text: String, name: String },
    #[error("no rows below the header")]
    Empty,
}

/// Reads rows of `features` columns.
///
/// # Errors
/// With file, line and column of what is wrong.
pub fn read(path: &Path, features: usize) -> Result<Vec<Vec<f32>>, RowsError> {
    let fail = |place, reason| RowsError { path: path.to_owned(), place, reason };
    let bytes = reading::read(path, reading::TABLE).map_err(|error| fail(Place::File, error.into()))?;
    parse(&bytes, features).map_err(|(place, reason)| fail(place, reason))
}

fn parse(bytes: &[u8], features: usize) -> Result<Vec<Vec<f32>>, (Place, Reason)> {
    let mut reader = ReaderBuilder::new().trim(Trim::All).flexible(true).from_reader(bytes);
    let from_csv = |error: csv::Error| {
        let place = error.position().map_or(Place::File, |position| Place::Line(line_of(bytes, position)));
        (place, Reason::Csv(error))
    };
    let header = reader.headers().map_err(from_csv)?.clone();
    if header.iter().next().is_some_and(|name| name.parse::<f32>().is_ok()) {
        return Err((Place::Line(1), Reason::NoHeader));
    }
    let counted = |record: &StringRecord, line: &dyn Fn() -> u64| {
        let found = record.len();
        if found == features { Ok(()) } else { Err((Place::Line(line()), Reason::Columns { found, expected: features })) }
    };
    counted(&header, &|| 1)?;
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(from_csv)?;
        let line = || record.position().map_or(0, |position| line_of(bytes, position));
        counted(&record, &line)?;
        let mut row = Vec::with_capacity(features);
        for (column, (text, name)) in record.iter().zip(&header).enumerate() {
            let value = text.parse::<f32>().ok().filter(|value| value.is_finite());
            row.push(value.ok_or_else(|| {
                (Place::Column(line(), column + 1), Reason::Number { text: text.to_owned(), name: name.to_owned() })
            })?);
        }
        rows.push(row);
    }
    if rows.is_empty() { Err((Place::File, Reason::Empty)) } else { Ok(rows) }
}

/// Line on which a record starts; the reader counts the empty lines before a record to the record.
fn line_of(bytes: &[u8], position: &csv::Position) -> u64 {
    let (before, after) = bytes.split_at(bytes.len().min(position.byte() as usize));
    let empty = after.iter().take_while(|byte| matches!(byte, b'\n' | b'\r'));
    1 + before.iter().chain(empty).filter(|byte| **byte == b'\n').count() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(text: &str) -> String {
        let (place, reason) = parse(text.as_bytes(), 2).unwrap_err();
        RowsError { path: "rows.csv".into(), place, reason }.to_string()
    }

    #[test]
    fn reads_rows_below_any_header() {
        assert_eq!(parse("a, b\n1, 2\n-3e-1,4\n".as_bytes(), 2).unwrap(), [[1.0, 2.0], [-0.3, 4.0]]);
    }

    #[test]
    fn names_line_and_column() {
        assert_eq!(refusal("a,b\n1,2\n3,x\n"), "rows.csv, line 3, column 2: `x` (b) is not a finite number");
        for text in ["NaN", "inf", "1e99", ""] {
            assert_eq!(
                refusal(&format!("a,b\n{text},1\n")),
                format!("rows.csv, line 2, column 1: `{text}` (a) is not a finite number")
            );
        }
        assert!(refusal("a,b\n1,2\n\n3\n").starts_with("rows.csv, line 4: 1 columns where the model has 2 features"));
        assert!(refusal("a\n1,2\n").starts_with("rows.csv, line 1: 1 columns"));
        assert!(refusal("1,2\n3,4\n").starts_with("rows.csv, line 1: a number where the header"));
        assert_eq!(refusal("a,b\n"), "rows.csv: no rows below the header");
        assert!(refusal("").starts_with("rows.csv, line 1: 0 columns"));
    }

    #[test]
    fn bytes_that_are_no_text_are_refused_with_their_line() {
        let (place, reason) = parse(b"a,b\n1,\xff\n", 2).unwrap_err();
        assert!(matches!(place, Place::Line(2)), "{reason}");
    }
}
