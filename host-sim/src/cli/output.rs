//! What is printed on stdout, and files that are written as a whole or not at all.

use std::{io::Write as _, path::Path};

use anyhow::{Context as _, Result};
use clap::ValueEnum;
use comfy_table::{Cell, CellAlignment, LineStyle, Table, presets};
use impromptu_model_export::replacement::replace;
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
            Self::Json => print(&(serde_json::to_string_pretty(result)? + "\n")),
        }
    }
}

/// Writes to stdout.
pub(super) fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())?;
    Ok(out.flush()?)
}

/// Writes a file as a whole, or leaves what was there.
pub(super) fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    replace(path, bytes).with_context(|| format!("{}: cannot be written", path.display()))
}

/// A table of text; all columns but the first `left` ones are set right, as numbers are.
pub(super) fn table<const N: usize>(header: [&str; N], left: usize, rows: impl IntoIterator<Item = [String; N]>) -> String {
    table_of(header.map(str::to_owned), left, rows)
}

/// The same with as many columns as the header has.
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
