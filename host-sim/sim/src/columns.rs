//! Tables of numbers with named columns, as CSV: what every log is read from.
//!
//! *in* CSV with a header, the columns in any order, spaces round the cells ignored; *out* rows of finite numbers; *never* a
//! refusal that does not name the file and, where there are any, line and column; *source* RFC 4180.

use std::{io, path::Path};

use impromptu_files::reading::{self, Bounded};

/// Why a table cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The file cannot be opened, read or written.
    #[error("{file}: {source}")]
    File {
        /// The file.
        file: String,
        /// What the system says.
        source: io::Error,
    },
    /// Not CSV.
    #[error("{file}: {source}")]
    Csv {
        /// The file.
        file: String,
        /// What is wrong, with the line.
        source: csv::Error,
    },
    /// A column is missing.
    #[error("{file}: column `{column}` is missing (there are: {found}); {advice}")]
    Column {
        /// The file.
        file: String,
        /// The column.
        column: String,
        /// The first columns that there are.
        found: String,
        /// What to do.
        advice: &'static str,
    },
    /// A row has more or fewer cells than the header.
    #[error("{file}, line {line}: {found} columns, the header has {expected}; drop or repair the row")]
    Ragged {
        /// The file.
        file: String,
        /// The line, from 1.
        line: u64,
        /// Cells of the row.
        found: usize,
        /// Cells of the header.
        expected: usize,
    },
    /// A cell is not a finite number, or none that the quantity can have.
    #[error("{file}, line {line}: `{column}` is `{found}`, {why}; drop or repair the row")]
    Cell {
        /// The file.
        file: String,
        /// The line, from 1.
        line: u64,
        /// The column.
        column: String,
        /// The text.
        found: String,
        /// What is wrong with it.
        why: String,
    },
}

/// Columns that a refusal names.
const NAMED: usize = 12;

/// A table whose header has been read.
pub struct Table<R> {
    file: String,
    header: csv::StringRecord,
    reader: csv::Reader<R>,
    /// Whether a last row with too few cells is left out, and the line of it, if it was.
    forgiving: bool,
    cut: Option<u64>,
}

/// Largest magnitude of a number in a table, in any unit: squares and sums of what is larger leave the numbers.
pub const LARGEST: f64 = 1e30;

impl Table<Bounded> {
    /// Opens a regular file of at most [`reading::TABLE`] bytes.
    ///
    /// # Errors
    /// If it cannot be opened, is none, or its header cannot be read.
    pub fn open(path: &Path) -> Result<Self, TableError> {
        let file = path.display().to_string();
        match reading::open(path, reading::TABLE) {
            Ok(reader) => Self::new(reader, &file),
            Err(source) => Err(TableError::File { file, source }),
        }
    }
}

impl<R: io::Read> Table<R> {
    /// Reads the header from any source; `file` is the name in messages.
    ///
    /// # Errors
    /// If the header cannot be read.
    pub fn new(reader: R, file: &str) -> Result<Self, TableError> {
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).from_reader(reader);
        let header = reader.headers().map_err(|source| TableError::Csv { file: file.into(), source })?.clone();
        Ok(Self { file: file.into(), header, reader, forgiving: false, cut: None })
    }

    /// A last row with too few cells, as a logger leaves whose battery was pulled, is left out ([`Table::cut`]).
    #[must_use]
    pub fn forgiving(self) -> Self {
        Self { forgiving: true, ..self }
    }

    /// Line of the last row, if that was left out, once the rows have been read.
    pub fn cut(&self) -> Option<u64> {
        self.cut
    }

    /// Name in messages.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Names of the columns.
    pub fn header(&self) -> impl Iterator<Item = &str> {
        self.header.iter()
    }

    /// Place of a column, if there is one of that name.
    pub fn find(&self, column: &str) -> Option<usize> {
        self.header.iter().position(|name| name == column)
    }

    /// Place of a column; `advice` is what somebody shall do who has none.
    ///
    /// # Errors
    /// If there is none.
    pub fn require(&self, column: &str, advice: &'static str) -> Result<usize, TableError> {
        self.find(column).ok_or_else(|| {
            let found = self.header.iter().take(NAMED).collect::<Vec<_>>().join(", ");
            let more = if self.header.len() > NAMED { ", …" } else { "" };
            TableError::Column { file: self.file.clone(), column: column.into(), found: found + more, advice }
        })
    }

    /// The rows, one after another; blank lines are none.
    pub fn rows(&mut self) -> impl Iterator<Item = Result<Row<'_>, TableError>> {
        let Self { file, header, reader, forgiving, cut } = self;
        let (file, header, forgiving) = (file.as_str(), &*header, *forgiving);
        let mut records = reader.records().peekable();
        std::iter::from_fn(move || {
            let record = match records.next()? {
                Ok(record) => record,
                Err(source) => return Some(Err(TableError::Csv { file: file.into(), source })),
            };
            let (found, expected) = (record.len(), header.len());
            let line = record.position().map_or(0, csv::Position::line);
            if found == expected {
                return Some(Ok(Row { file, header, record }));
            }
            if forgiving && found < expected && records.peek().is_none() {
                *cut = Some(line);
                return None;
            }
            Some(Err(TableError::Ragged { file: file.into(), line, found, expected }))
        })
    }
}

/// A row.
pub struct Row<'a> {
    file: &'a str,
    header: &'a csv::StringRecord,
    record: csv::StringRecord,
}

impl Row<'_> {
    /// Line in the file, from 1.
    pub fn line(&self) -> u64 {
        self.record.position().map_or(0, csv::Position::line)
    }

    /// The finite number at the place of a column.
    ///
    /// # Errors
    /// If it is none.
    pub fn number(&self, place: usize) -> Result<f64, TableError> {
        self.within(place, LARGEST)
    }

    /// The text at the place of a column.
    pub fn text(&self, place: usize) -> &str {
        self.record.get(place).unwrap_or_default()
    }

    /// The number at the place of a column, whose magnitude is at most `largest`; `None` if the cell is empty.
    ///
    /// # Errors
    /// If there is something else, or it is larger.
    pub fn optional(&self, place: usize, largest: f64) -> Result<Option<f64>, TableError> {
        if self.record.get(place).is_none_or(str::is_empty) { Ok(None) } else { self.within(place, largest).map(Some) }
    }

    /// The number at the place of a column, whose magnitude is at most `largest`.
    ///
    /// # Errors
    /// If it is none, or larger.
    pub fn within(&self, place: usize, largest: f64) -> Result<f64, TableError> {
        let text = self.record.get(place).unwrap_or_default();
        let why = match text.parse::<f64>() {
            Ok(value) if value.abs() <= largest => return Ok(value),
            Ok(value) if value.is_finite() => format!("not a number from -{largest:e} to {largest:e}"),
            _ => "not a finite number".into(),
        };
        let column = self.header.get(place).unwrap_or_default().into();
        Err(TableError::Cell { file: self.file.into(), line: self.line(), column, found: text.into(), why })
    }

    /// The finite numbers at the places of several columns.
    ///
    /// # Errors
    /// Names the first that is none.
    pub fn numbers<const N: usize>(&self, places: [usize; N]) -> Result<[f64; N], TableError> {
        self.numbers_within(places, LARGEST)
    }

    /// The same with magnitudes of at most `largest`.
    ///
    /// # Errors
    /// Names the first that is none, or larger.
    pub fn numbers_within<const N: usize>(&self, places: [usize; N], largest: f64) -> Result<[f64; N], TableError> {
        let mut numbers = [0.0; N];
        for (number, place) in numbers.iter_mut().zip(places) {
            *number = self.within(place, largest)?;
        }
        Ok(numbers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairs(text: &str) -> Result<Vec<(u64, [f64; 2])>, TableError> {
        let mut table = Table::new(text.as_bytes(), "t.csv")?;
        let places = [table.require("b", "give b")?, table.require("a", "give a")?];
        table.rows().map(|row| row.and_then(|row| Ok((row.line(), row.numbers(places)?)))).collect()
    }

    #[test]
    fn columns_are_found_by_name_in_any_order() {
        assert_eq!(pairs("a, more ,b\n 1,x,2\n3,y, -4e-1 \n\n").unwrap(), [(2, [2.0, 1.0]), (3, [-0.4, 3.0])]);
        assert_eq!(pairs("b,a\n").unwrap(), []);
    }

    /// The last row alone, and only if it is asked for.
    #[test]
    fn a_last_row_that_was_cut_short_costs_that_row() {
        let read = |text: &str| {
            let mut table = Table::new(text.as_bytes(), "t.csv")?.forgiving();
            let rows = table.rows().map(|row| row?.numbers([0, 1])).collect::<Result<Vec<_>, _>>()?;
            Ok::<_, TableError>((rows, table.cut()))
        };
        assert_eq!(read("a,b\n1,2\n3\n").unwrap(), (vec![[1.0, 2.0]], Some(3)));
        assert_eq!(read("a,b\n1,2\n3,4").unwrap(), (vec![[1.0, 2.0], [3.0, 4.0]], None));
        assert!(read("a,b\n1\n3,4\n").is_err() && read("a,b\n1,2\n3,4,5\n").is_err());
    }

    #[test]
    fn a_refusal_names_file_line_and_column_and_says_what_to_do() {
        let refusal = |text: &str| pairs(text).expect_err("refused").to_string();
        assert_eq!(refusal("time,b\n1,2\n"), "t.csv: column `a` is missing (there are: time, b); give a");
        for cell in ["", "north", "nan", "inf"] {
            let text = format!("a,b\n1,2\n3,{cell}\n");
            assert_eq!(refusal(&text), format!("t.csv, line 3: `b` is `{cell}`, not a finite number; drop or repair the row"));
        }
        for cell in ["1e31", "-1e308"] {
            let why = format!("t.csv, line 2: `b` is `{cell}`, not a number from -1e30 to 1e30; drop or repair the row");
            assert_eq!(refusal(&format!("a,b\n1,{cell}\n")), why);
        }
        let ragged = "t.csv, line 3: 1 columns, the header has 2; drop or repair the row";
        assert_eq!(refusal("a,b\n1,2\n3\n"), ragged);
        let wide = refusal(&format!("{}\n", (0..20).map(|index| format!("c{index}")).collect::<Vec<_>>().join(",")));
        assert!(wide.contains("c11, …)") && !wide.contains("c12"), "{wide}");
        let absent = Table::open(Path::new("no/such.csv")).err().expect("absent").to_string();
        assert!(absent.starts_with("no/such.csv: "), "{absent}");
    }
}
