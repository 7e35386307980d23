//! `host-sim report`: stored results to the page, the tables and the console.

use std::path::PathBuf;

use anyhow::{Context as _, Result};
use clap::Args;
use impromptu_files::reading;
use impromptu_report::Results;

use super::{Invocation, demo};

/// Arguments of `report`.
#[derive(Debug, Args)]
#[command(after_help = "\
Writes report.html, table.csv and flights.csv into --out, and prints the table.

Example:
  host-sim report out/results.json --out again")]
pub(super) struct Report {
    /// Results of the demo: results.json, or what --format json printed.
    #[arg(value_name = "RESULTS.json")]
    results: PathBuf,
}

impl Report {
    pub(super) fn run(self, invocation: &Invocation) -> Result<()> {
        let name = self.results.display();
        let text = reading::read_text(&self.results, reading::DOCUMENT).with_context(|| name.to_string())?;
        let results = Results::from_json(&text).with_context(|| name.to_string())?;
        let folder = invocation.configuration.folder()?;
        for view in demo::VIEWS {
            invocation.check_output(&folder.join(view), [self.results.as_path()])?;
        }
        demo::show(invocation, &results, &folder)
    }
}
