//! `host-sim train --loop`: any loop from its description and its logs.

use std::path::Path;

use anyhow::{Context as _, Result};
use impromptu_diagnosis::digits::digits;
use impromptu_files::reading;
use impromptu_loops::{
    LoopDescription, Settings,
    age::{Age, UnknownAge, cost, estimated, pooled},
    built_in::{QUADROTOR, axis_logs, quadrotor},
    complete::{AxisFit, Request, complete},
    layout::Layout,
    prepared::{prepared, time_constant_s},
    reading::{AxisLog, AxisSignals, header, read},
    train,
};
use impromptu_model_export::{
    Description, ExportError,
    description::{LaneDescription, MonitorDescription},
};
use impromptu_sim::flight_log::FlightLog;
use impromptu_training::{
    LaneChoice, LaneRefusal, LearnSettings, Learned, Pipeline, Trained,
    breakdown::sound,
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
    let age_s = match arguments.delay_ms.or(described.age_ms) {
        Some(told) => told / 1e3,
        None => found_age(&described, &logs, invocation)?,
    };
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

/// The age of what is measured, s, as fresher signals of the logs tell it, axis by axis: the surest counts.
///
/// # Errors
/// If none does.
fn found_age(described: &LoopDescription, logs: &[Vec<AxisLog>], invocation: &Invocation) -> Result<f64, UnknownAge> {
    let mut found: Vec<(&str, Age)> = Vec::new();
    for (place, axis) in described.axes.iter().enumerate() {
        let Some(fresh) = &axis.fresh else { continue };
        let of_axis: Vec<&AxisLog> = logs.iter().map(|axes| &axes[place]).collect();
        let Ok(time_constant_s) = time_constant_s(&of_axis) else { continue };
        let signals: Vec<_> = of_axis.iter().map(|log| (&log.signals, fresh.kind)).collect();
        if let Some(age) = estimated(&signals, of_axis[0].rate_hz, time_constant_s) {
            found.push((&axis.name, age));
        }
    }
    let Some(age) = pooled(&found.iter().map(|(_, age)| *age).collect::<Vec<_>>()) else {
        let fresh = described.axes.iter().any(|axis| axis.fresh.is_some());
        let why = if fresh { "the fresher signal does not go with it" } else { "the logs hold nothing fresher" };
        let axis = &described.axes[0];
        let signals: Vec<_> = logs.iter().map(|axes| &axes[0].signals).collect();
        return Err(UnknownAge { why: why.into(), cost: cost(&signals, &axis.unit, &axis.name) });
    };
    invocation.console.note(&format!(
        "what is measured is {:.0} ms old (± {:.1} ms, by the fresher signal of axis {}); --delay-ms says otherwise",
        1e3 * age.seconds,
        2e3 * age.error_s,
        found.iter().map(|(axis, _)| *axis).collect::<Vec<_>>().join(", ")
    ));
    Ok(age.seconds)
}

/// The age of what flight logs measured, s: that which attitude tells, or the usual one with a warning.
pub(super) fn age_of_flights(logs: &[FlightLog], invocation: &Invocation) -> f64 {
    let (sound, _) = sound(logs);
    let axes: Vec<Vec<AxisLog>> = sound.into_iter().map(axis_logs).collect();
    let with_tilt = axes.iter().flatten().any(|log| log.signals.fresh.is_some());
    found_age(&quadrotor(with_tilt).0, &axes, invocation).unwrap_or_else(|unknown| {
        invocation.console.note(&format!("warning: taken to be {:.0} ms old: {unknown}", 1e3 * USUAL_AGE_S));
        USUAL_AGE_S
    })
}

/// Age of a position from motion capture over radio, s.
const USUAL_AGE_S: f64 = 0.024;

/// What logs without dither lack, and what it would add.
const NO_DITHER: &str = "\
no log has a dither, which tells what a correction does: add a dither to the position reference (1 cm, a new random sign every \
50 ms) on flights of a few minutes and give their logs as --dithered; it would add the feedback lane, which removes most of what \
the network lane leaves, and the guard's monitor";

/// Whether a reference is more than what is desired.
fn dithers(signals: &AxisSignals) -> bool {
    let away = signals.reference.iter().zip(&signals.base).map(|(reference, base)| (reference - base).abs());
    away.fold(0.0, f64::max) > 1e-9
}

/// Lane and monitor from flight logs alone, beside a network.
pub(super) fn beside(
    pipeline: &Pipeline<'_>,
    learned: &Learned,
    logs: &[FlightLog],
    name: &str,
    remark: Option<&str>,
) -> Result<(Trained, Vec<AxisFit>)> {
    let LearnSettings { recipe, seed, measurement_delay_s, .. } = &pipeline.settings;
    let (described, layout) = quadrotor(false);
    let (sound, _) = sound(logs);
    let axes: Vec<Vec<AxisLog>> = sound.into_iter().map(axis_logs).collect();
    let file = |lane: Option<&LaneDescription>, monitor: Option<&MonitorDescription>, remarks: &str| {
        let description = Description { monitor: monitor.cloned(), ..pipeline.describe(learned, lane, name, remarks) };
        Ok::<_, ExportError>((learned.encode(&description)?, description))
    };
    let places: Vec<usize> = (0..layout.axes.len()).collect();
    let dithered = axes.iter().flatten().any(|log| dithers(&log.signals));
    let ready = match dithered {
        true => prepared(&described, &axes, &places, true, (DRAWS, *seed)).map_err(|error| error.to_string()),
        false => Err(NO_DITHER.into()),
    };
    let completed = ready.map(|ready| {
        complete(&Request {
            described: &described,
            layout: &layout,
            prepared: &ready,
            age_s: *measurement_delay_s,
            fade_s: recipe.fade_s,
            draws: DRAWS,
            velocity_outputs: (3..6).map(Some).collect(),
            encode: &|lane, monitor| Ok(file(lane, monitor, "")?.0),
        })
    });
    let (lane, monitor, words, fits) = match completed {
        Ok(completed) => {
            let completed = completed?;
            let words = completed.words();
            (completed.lane, completed.monitor, words, completed.axes)
        }
        Err(reason) => (None, None, format!("no feedback lane: {reason}"), Vec::new()),
    };
    let remarks = [Some(words.as_str()), remark].into_iter().flatten().collect::<Vec<_>>().join("; ");
    let (model, description) = file(lane.as_ref(), monitor.as_ref(), &remarks)?;
    let lane = match lane {
        Some(lane) => {
            let worst = fits.iter().map(|fit| fit.reduction_percent[1]).fold(f64::INFINITY, f64::min);
            let score = fits.iter().map(|fit| fit.reduction_percent[0]).sum::<f64>() / fits.len().max(1) as f64;
            Ok(LaneChoice { lane, design: words, score, worst })
        }
        None => Err(LaneRefusal::Logs(words)),
    };
    Ok((Trained { lane, description, model }, fits))
}

fn text(summary: &Summary) -> String {
    let mut rows = vec![
        ["model".to_owned(), format!("{}, {} bytes, seed {}", summary.name, summary.bytes, summary.seed)],
        [
            "trained on".to_owned(),
            format!("{:.1} min of flight in {} logs, measurements {:.0} ms old", summary.minutes, summary.logs, summary.age_ms),
        ],
    ];
    rows.extend(summary.axes.iter().flat_map(fit_rows));
    rows.extend(summary.files.iter().map(|file| ["file".to_owned(), file.display().to_string()]));
    table(["", "result"], 2, rows)
}

/// What was found of an axis, for a table.
pub(super) fn fit_rows(fit: &AxisFit) -> [[String; 2]; 2] {
    let AxisFit { axis, unit, error, with_network, with_both, reduction_percent: [mean, low, high], lane, refusal, .. } = fit;
    let [error, with_network, with_both] = [error, with_network, with_both].map(|value| digits(*value));
    [
        [
            format!("axis {axis}"),
            format!(
                "{error} {unit} alone on logs kept apart, {with_network} with the network lane, {with_both} with both: \
                 {mean:.0} % less ({low:.0} … {high:.0})"
            ),
        ],
        [
            String::new(),
            match lane {
                Some(design) => format!("feedback lane: {design}"),
                None => format!("no feedback lane: {}", refusal.as_deref().unwrap_or_default()),
            },
        ],
    ]
}
