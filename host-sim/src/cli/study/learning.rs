//! `host-sim study learning`.

use anyhow::Result;
use clap::Args;
use impromptu_report::study::Study;
use impromptu_reproduction::learning::{Row, Settings, run};
use serde::Serialize;

use super::found::show_as;
use crate::cli::Invocation;

/// Arguments of `study learning`.
#[derive(Debug, Args)]
#[command(after_help = "\
Each row is a loop under a condition, what was known before, how long it learned, and what is left of the error of unseen
strokes. With --format json the document has them as `rows`: vehicle, loop, condition, start (nothing, same, other_vehicle,
other_gains), seconds (a number or from_first_stroke), parts (preview, feedback, both), rms_cm_mean, reduction_mean and
reduction_worst (%), seed.

Examples:
  host-sim study learning
  host-sim study learning --from-nothing --strokes 8 --format json")]
pub(super) struct Learning {
    /// Number of test strokes of each row.
    #[arg(long, value_name = "N", default_value = "30", value_parser = clap::value_parser!(u32).range(5..=10_000))]
    strokes: u32,
    /// Only rows that start from nothing: no model is trained.
    #[arg(long)]
    from_nothing: bool,
}

/// What is printed as JSON.
#[derive(Debug, Serialize)]
struct Document<'a> {
    rows: &'a [Row],
    #[serde(flatten)]
    study: &'a Study,
}

impl Learning {
    pub(super) fn run(self, invocation: &Invocation) -> Result<()> {
        let settings = Settings {
            seed: invocation.configuration.seed(),
            strokes: self.strokes as usize,
            recipe: invocation.configuration.study_recipe(),
            models: !self.from_nothing,
        };
        let found = run(&settings, &invocation.command, &invocation.console)?;
        invocation.console.finish();
        show_as(invocation, "learning", &found.study, &Document { rows: &found.rows, study: &found.study })
    }
}
