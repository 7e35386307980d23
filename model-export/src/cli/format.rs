//! How results are printed.

use std::io::Write;

use anyhow::Result;
use clap::ValueEnum;
use impromptu_files::text::{json, lines};
use serde::Serialize;

/// How results are printed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum Format {
    /// For people.
    #[default]
    Text,
    /// One JSON document.
    Json,
}

impl Format {
    /// Prints a result; `text` is made only if it is wanted.
    pub(super) fn print(self, out: &mut dyn Write, result: &impl Serialize, text: impl FnOnce() -> String) -> Result<()> {
        match self {
            Self::Text => out.write_all(lines(&text()).as_bytes())?,
            Self::Json => writeln!(out, "{}", json(&serde_json::to_string_pretty(result)?))?,
        }
        Ok(out.flush()?)
    }
}
