//! Rows of numbers from CSV text, with line and field in every error.

use super::TrajectoryError;
use std::io::Read;

/// A CSV file of numbers: header and rows.
pub(super) struct Rows {
    /// Name for messages.
    pub(super) file: String,
    /// Column names, in lower case.
    pub(super) header: Vec<String>,
    records: Vec<(u64, csv::StringRecord)>,
}

/// A row of finite numbers, as many as the header has columns.
pub(super) struct Row {
    /// Line in the file, from 1.
    pub(super) line: u64,
    pub(super) values: Vec<f64>,
}

impl Rows {
    /// Reads all records. Spaces round fields and an empty column at the end (Crazyswarm's own files have one) are ignored.
    pub(super) fn read(source: impl Read, file: &str) -> Result<Self, TrajectoryError> {
        let mut reader = csv::ReaderBuilder::new().has_headers(false).flexible(true).trim(csv::Trim::All).from_reader(source);
        let mut records = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|error| refused(error, file))?;
            let line = record.position().map_or(0, csv::Position::line);
            records.push((line, record));
        }
        if records.is_empty() {
            return Err(TrajectoryError::Header { file: file.into(), problem: "the file is empty".into() });
        }
        let (_, first) = records.remove(0);
        let header: Vec<String> = first.iter().map(str::to_ascii_lowercase).collect();
        let columns = used(&header);
        Ok(Self { file: file.into(), header: header[..columns].to_vec(), records })
    }

    /// All rows as numbers.
    pub(super) fn numbers(&self) -> Result<Vec<Row>, TrajectoryError> {
        self.records.iter().map(|(line, record)| self.row(*line, record)).collect()
    }

    fn row(&self, line: u64, record: &csv::StringRecord) -> Result<Row, TrajectoryError> {
        let fields: Vec<&str> = record.iter().collect();
        let (found, expected) = (fields.len().max(1), self.header.len());
        let surplus = fields.get(expected..).unwrap_or_default();
        let problem = match self.header.get(found) {
            Some(missing) => Some(format!("`{missing}` is missing")),
            None if surplus.iter().any(|field| !field.is_empty()) => Some(format!("column {} is surplus", expected + 1)),
            None => None,
        };
        if let Some(problem) = problem {
            return Err(TrajectoryError::Columns { file: self.file.clone(), line, found, expected, problem });
        }
        let number = |(text, column): (&&str, usize)| match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            Ok(_) => Err(self.field(line, column, format!("`{text}` is not a finite number"))),
            Err(_) if text.is_empty() => Err(self.field(line, column, "is empty, expected a number".into())),
            Err(_) => Err(self.field(line, column, format!("`{text}` is not a number"))),
        };
        let values = fields.iter().take(expected).zip(0..).map(number).collect::<Result<_, _>>()?;
        Ok(Row { line, values })
    }

    /// The error for a field of the table.
    pub(super) fn field(&self, line: u64, column: usize, problem: String) -> TrajectoryError {
        TrajectoryError::Field { file: self.file.clone(), line, field: self.header[column].clone(), problem }
    }

    /// Checks the header against the expected names, of which the last `optional` may be absent.
    pub(super) fn expect_header(&self, expected: &[String], optional: usize) -> Result<(), TrajectoryError> {
        let problem = |problem| TrajectoryError::Header { file: self.file.clone(), problem };
        for (column, name) in expected.iter().enumerate() {
            match self.header.get(column) {
                Some(found) if found == name => {}
                Some(found) => {
                    let column = column + 1;
                    return Err(problem(format!("column {column} is `{found}` instead of `{name}`")));
                }
                None if self.header.len() == expected.len() - optional => return Ok(()),
                None => {
                    return Err(problem(format!("column {} (`{name}`) is missing", column + 1)));
                }
            }
        }
        match self.header.get(expected.len()) {
            Some(surplus) => Err(problem(format!("column `{surplus}` is surplus"))),
            None => Ok(()),
        }
    }
}

/// Columns without the empty ones at the end.
fn used(fields: &[String]) -> usize {
    fields.iter().rposition(|field| !field.is_empty()).map_or(0, |last| last + 1)
}

fn refused(error: csv::Error, file: &str) -> TrajectoryError {
    let line = error.position().map_or(0, csv::Position::line);
    let problem = error.to_string();
    match error.into_kind() {
        csv::ErrorKind::Io(source) => TrajectoryError::Unreadable { file: file.into(), source },
        _ => TrajectoryError::NotCsv { file: file.into(), line, problem },
    }
}
