//! What is printed on stdout, and files that are written as a whole or not at all.

use std::{io::Write as _, path::Path};

use anyhow::{Context as _, Result};
use clap::ValueEnum;
use comfy_table::{Cell, CellAlignment, LineStyle, Table, presets};
use impromptu_files::{
    replacement::{replace, replace_all},
    text::{json, line, lines},
};
use serde::Serialize;

/// How results are printed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum Format {
    /// For people.
    #[default]
    Table,
    /// One JSON document.
    Json,
}

impl Format {
    /// Prints a result; `text` is made only if it is wanted.
    pub(super) fn print(self, result: &impl Serialize, text: impl FnOnce() -> String) -> Result<()> {
        match self {
            Self::Table => print(&text()),
            Self::Json => print_json(&(serde_json::to_string_pretty(result)? + "\n")),
        }
    }
}

/// Writes a text to stdout; what would act on a terminal is written out.
pub(super) fn print(text: &str) -> Result<()> {
    pour(&lines(text))
}

/// The same of a JSON document, which means the same to whoever parses it.
pub(super) fn print_json(document: &str) -> Result<()> {
    pour(&json(document))
}

fn pour(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())?;
    Ok(out.flush()?)
}

/// Writes a file as a whole, or leaves what was there.
pub(super) fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    replace(path, bytes).with_context(|| format!("{}: cannot be written", path.display()))
}

/// Writes files, all of them or none.
pub(super) fn write_all(files: &[(&Path, &[u8])]) -> Result<()> {
    Ok(replace_all(files)?)
}

/// A table of text, a line a row; all columns but the first `left` ones are set right, as numbers are.
pub(super) fn table<const N: usize>(header: [&str; N], left: usize, rows: impl IntoIterator<Item = [String; N]>) -> String {
    table_of(header.map(str::to_owned), left, rows.into_iter().map(|row| row.map(|cell| line(&cell).into_owned())))
}

/// The same with as many columns as the header has; cells may have several lines.
pub(super) fn table_of<R: IntoIterator<Item = String>>(
    header: impl IntoIterator<Item = String>,
    left: usize,
    rows: impl IntoIterator<Item = R>,
) -> String {
    fn cells(texts: impl IntoIterator<Item = String>, left: usize) -> impl Iterator<Item = Cell> {
        texts.into_iter().enumerate().map(move |(column, text)| {
            let alignment = if column < left { CellAlignment::Left } else { CellAlignment::Right };
            Cell::new(text).set_alignment(alignment)
        })
    }
    let mut table = Table::new();
    // Lines of text are close enough to be read without rules between them.
    table.load_style(presets::UTF8_HORIZONTAL_ONLY.row_separator(LineStyle::none())).set_header(cells(header, left));
    for row in rows {
        table.add_row(cells(row, left));
    }
    table.trim_fmt() + "\n"
}

/// A number for people: `n/a` where it is not finite.
pub(super) fn number(value: f64, decimals: usize) -> String {
    if value.is_finite() { format!("{value:.decimals$}") } else { "n/a".into() }
}
