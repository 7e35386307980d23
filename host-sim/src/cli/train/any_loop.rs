//! `host-sim train --loop`: any loop from its description and its logs.

use std::path::Path;

use anyhow::{Context as _, Result};
use impromptu_files::reading;
use impromptu_loops::{
    LoopDescription, Settings,
    built_in::{QUADROTOR, quadrotor},
    complete::AxisFit,
    layout::Layout,
    reading::{header, read},
    train,
};
use impromptu_training::{
    files::{model_files, write_set},
    observer::Observer as _,
};
use serde::Serialize;

use super::Train;
use crate::cli::{Invocation, log_reading::say, output::table};

/// What is printed as JSON.
#[derive(Debug, Serialize)]
struct Summary {
    name: String,
    seed: u64,
    logs: usize,
    minutes: f64,
    age_ms: f64,
    bytes: usize,
    axes: Vec<AxisFit>,
    files: Vec<std::path::PathBuf>,
}

/// Models of which logs are judged beside the likeliest.
const DRAWS: usize = 4;

/// The description of a loop by name or file, and its layout if that is known.
pub(in crate::cli) fn described(name: &str, log: &Path) -> Result<(LoopDescription, Option<Layout>)> {
    if name == QUADROTOR {
        let columns = header(log)?;
        let (described, layout) = quadrotor(columns.iter().any(|column| column == "measured_pitch_rad"));
        return Ok((described, Some(layout)));
    }
    let text = reading::read_text(Path::new(name), reading::SETTINGS).with_context(|| format!("--loop {name}"))?;
    Ok((LoopDescription::parse(&text).with_context(|| format!("--loop {name}"))?, None))
}

pub(super) fn run(arguments: &Train, name: &str, invocation: &Invocation) -> Result<()> {
    let (described, known) = described(name, &arguments.log[0])?;
    let seed = invocation.configuration.seed();
    invocation.console.note(&format!("seed {seed}"));
    let folder = invocation.configuration.folder()?;
    for output in model_files(&folder, &arguments.name)? {
        invocation.check_output(&output, arguments.log.iter().map(std::path::PathBuf::as_path).chain([Path::new(name)]))?;
    }
    let reading = arguments.reading.reading();
    let mut logs = Vec::with_capacity(arguments.log.len());
    for path in &arguments.log {
        let axes = read(path, &described, &reading)?;
        say(invocation, &path.display().to_string(), axes.iter().flat_map(|log| &log.notes));
        logs.push(axes);
    }
    let age_s = arguments.delay_ms.or(described.age_ms).unwrap_or(24.0) / 1e3;
    invocation.console.stage(&format!("training on {} logs", logs.len()));
    let settings = Settings {
        age_s,
        seed,
        name: arguments.name.clone(),
        known,
        axes: arguments.axis.clone(),
        draws: DRAWS,
        force: arguments.force,
    };
    let trained = train(&described, &logs, &settings)?;
    invocation.console.finish();
    for note in &trained.notes {
        invocation.console.note(note);
    }
    let files = write_set(&folder, &arguments.name, (&trained.network, &trained.rows), &trained.description, &trained.model)?;
    let summary = Summary {
        name: arguments.name.clone(),
        seed,
        logs: logs.len(),
        minutes: trained.minutes,
        age_ms: 1e3 * age_s,
        bytes: trained.model.len(),
        axes: trained.axes,
        files,
    };
    invocation.format.print(&summary, || text(&summary))
}

fn text(summary: &Summary) -> String {
    let mut rows = vec![
        ["model".to_owned(), format!("{}, {} bytes, seed {}", summary.name, summary.bytes, summary.seed)],
        [
            "trained on".to_owned(),
            format!("{:.1} min of flight in {} logs, measurements {:.0} ms old", summary.minutes, summary.logs, summary.age_ms),
        ],
    ];
    for fit in &summary.axes {
        let AxisFit { axis, unit, error, with_network, with_both, reduction_percent: [mean, low, high], lane, refusal, .. } = fit;
        rows.push([
            format!("axis {axis}"),
            format!(
                "{error:.4} {unit} alone, {with_network:.4} with the network lane, {with_both:.4} with both: {mean:.0} % less ({low:.0} … {high:.0})"
            ),
        ]);
        rows.push([
            String::new(),
            match lane {
                Some(design) => format!("feedback lane: {design}"),
                None => format!("no feedback lane: {}", refusal.as_deref().unwrap_or_default()),
            },
        ]);
    }
    rows.extend(summary.files.iter().map(|file| ["file".to_owned(), file.display().to_string()]));
    table(["", "result"], 2, rows)
}
