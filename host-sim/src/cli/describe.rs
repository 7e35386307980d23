//! `host-sim describe`: a loop's description, drafted from the header of a log.

use std::path::PathBuf;

use anyhow::{Context as _, Result};
use clap::Args;
use impromptu_files::replacement::replace;
use impromptu_loops::{
    LoopDescription,
    draft::{drafted, stated},
    reading::header,
};

use super::Invocation;

/// Arguments of `describe`.
#[derive(Debug, Args)]
#[command(after_help = "\
Prints the description as TOML, or writes it with --output. What the names of the columns do not say is left at its default: read
it, complete unit, frame, caps and age, then train with it. Keys of an axis: name, unit, frame, accepts (position,
position_velocity or position_velocity_feed_forward), the columns reference, measured and, where there are any, desired, velocity,
reference_velocity, desired_velocity; fresh = { column, kind = \"acceleration\" or \"velocity\" } for a signal that is fresher
than the measured position, wrap for an angle that wraps, cap and cap_rate for the largest correction and its fastest change.

Examples:
  host-sim describe --log host-sim/reproduction/data/nanobench/B3_figure8_slow_rep1.csv --columns t,sp_ctrltarget_x,px
  host-sim describe --log motor.csv
  host-sim describe --log motor.csv --columns t,setpoint,angle --name motor --output motor.toml
  host-sim train --loop motor.toml --log motor-*.csv --delay-ms 5 --out models")]
pub(super) struct Describe {
    /// A log of the loop.
    #[arg(long, value_name = "FILE.csv")]
    log: PathBuf,
    /// Columns of an axis, once for each: time, reference, measured value and, where there is one, its rate of change.
    #[arg(long, value_name = "TIME,REFERENCE,MEASURED[,VELOCITY]", value_parser = columns)]
    columns: Vec<Columns>,
    /// Name of the machine [default: the log's].
    #[arg(long)]
    name: Option<String>,
    /// File for the description, in the place of stdout.
    #[arg(long, value_name = "FILE.toml")]
    output: Option<PathBuf>,
}

/// Names of three or four columns.
#[derive(Clone, Debug)]
struct Columns(Vec<String>);

fn columns(text: &str) -> Result<Columns, String> {
    let names: Vec<String> = text.split(',').map(|name| name.trim().to_owned()).collect();
    if (3..=4).contains(&names.len()) && names.iter().all(|name| !name.is_empty()) {
        Ok(Columns(names))
    } else {
        Err("expected three or four names of columns with commas between them".into())
    }
}

impl Describe {
    pub(super) fn run(self, invocation: &Invocation) -> Result<()> {
        let found = header(&self.log)?;
        let stem = self.log.file_stem().map_or_else(|| "loop".into(), |stem| stem.to_string_lossy().into_owned());
        let name = self.name.as_deref().unwrap_or(&stem);
        let described = match self.columns.as_slice() {
            [] => drafted(name, &found).with_context(|| self.log.display().to_string())?,
            [Columns(first), ..] => LoopDescription {
                name: name.into(),
                time: first[0].clone(),
                rate_hz: None,
                age_ms: None,
                axes: self.columns.iter().filter_map(|Columns(names)| stated(&names[1..])).collect(),
            },
        };
        described.check().context("--columns")?;
        let text = described.to_toml();
        match &self.output {
            Some(path) => {
                invocation.check_output(path, [self.log.as_path()])?;
                replace(path, text.as_bytes()).with_context(|| path.display().to_string())?;
                invocation.console.note(&format!("written: {}", path.display()));
                Ok(())
            }
            None => invocation.format.print(&described, || text),
        }
    }
}
