//! From logs of a loop to a model file: window, feedback lane, limits, monitor, and what they will do.
//!
//! *in* a description, logs, the age of what was measured; *out* a [`Trained`] loop; *never* a log in the fit that judges it;
//! *source* Zhou 2017, sections III and V; the lanes as in `impromptu-training`.

use impromptu_diagnosis::{Record, Settings as DiagnosisSettings, Verdict, diagnose};
use impromptu_model_export::{
    Description, ExportError, FloatNetwork, Precision,
    description::{LaneDescription, MonitorDescription},
    encode,
};
use rayon::prelude::*;

use crate::{
    complete::{AxisFit, Request, complete},
    description::LoopDescription,
    layout::{Layout, TooManyChannels},
    model::Maker,
    prepared::{PrepareError, Prepared, PreparedAxis, prepared},
    reading::{AxisLog, AxisSignals},
    response::Answer,
    window::{Window, fit, offsets},
};

/// How a loop is trained.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Age of what is measured, s.
    pub age_s: f64,
    /// Seed of everything random.
    pub seed: u64,
    /// Name of the model.
    pub name: String,
    /// Signals of a loop whose application is known; its model runs at the logs' rate.
    pub known: Option<Layout>,
    /// Axes that are trained, by name; all if none is named.
    pub axes: Vec<String>,
    /// Models that the logs leave possible on which lanes are judged, beside the likeliest.
    pub draws: usize,
    /// Train although the diagnosis says that it will not help.
    pub force: bool,
}

/// Why nothing was trained.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// No such axis.
    #[error("--axis {asked}: the loop has no axis of that name (it has {has})")]
    NoAxis {
        /// Asked for.
        asked: String,
        /// Its axes.
        has: String,
    },
    /// An axis that an add-on will not help.
    #[error("axis {axis}: {why}; `host-sim diagnose` says more, --force trains all the same, --axis trains others")]
    WillNot {
        /// Axis.
        axis: String,
        /// Verdict.
        why: String,
    },
    /// Too little for a window.
    #[error("axis {axis}: no model explains the logs, or they are shorter than two responses of the loop: log longer flights")]
    Short {
        /// Axis.
        axis: String,
    },
    /// The logs cannot be made ready.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// More channels than a model holds.
    #[error(transparent)]
    Channels(#[from] TooManyChannels),
    /// No model file.
    #[error(transparent)]
    Export(#[from] ExportError),
}

/// A loop that was trained.
#[derive(Debug)]
pub struct Trained {
    /// What the file says of itself.
    pub description: Description,
    /// Its network.
    pub network: FloatNetwork,
    /// Rows of its features.
    pub rows: Vec<Vec<f32>>,
    /// The file.
    pub model: Vec<u8>,
    /// Of each axis that was trained what was found.
    pub axes: Vec<AxisFit>,
    /// Reference ticks of the logs in one of the model.
    pub divisor: usize,
    /// Flight in the logs, minutes.
    pub minutes: f64,
    /// What is to be said.
    pub notes: Vec<String>,
}

/// Time in which a lane fades in, time constants.
const FADE: f64 = 0.7;
/// From so many ticks in a time constant on, the network is evaluated every second one.
const TICKS_OF_TWO: f64 = 40.0;
/// Ticks of the past and the future that a window may reach: those of an application with a preview of 1,024 samples, and of the
/// flight stack.
const REACH: [i32; 2] = [400, 600];
/// See [`REACH`].
const FLIGHT_REACH: [i32; 2] = [44, 136];

/// Trains the loop of a description from its logs, `[file][axis]`.
///
/// # Errors
/// Names the axis or the file, and what to do.
pub fn train(described: &LoopDescription, logs: &[Vec<AxisLog>], settings: &Settings) -> Result<Trained, TrainError> {
    let layout = match &settings.known {
        Some(layout) => layout.clone(),
        None => Layout::of(described)?,
    };
    let places = chosen(described, &settings.axes)?;
    let mut notes = Vec::new();
    for &place in &places {
        notes.extend(judged(described, logs, place, settings)?);
    }
    let ready = prepared(described, logs, &places, settings.known.is_some(), (settings.draws, settings.seed))?;
    let sub = if ready.time_constants_s[0] * ready.model_hz >= TICKS_OF_TWO { 2 } else { 1 };
    let windows = windows(described, &ready, settings, sub)?;
    let maker = Maker {
        described,
        layout: &layout,
        axes: &ready.axes,
        windows: &windows,
        name: &settings.name,
        seed: settings.seed,
        age_s: settings.age_s,
        model_hz: ready.model_hz,
        sub,
        fade_s: FADE * ready.time_constants_s[1],
    };
    let (network, rows) = maker.network();
    let file = |description: &Description| encode(description, Some(&network), Precision::Float, &rows);
    let completed = complete(&Request {
        described,
        layout: &layout,
        prepared: &ready,
        age_s: settings.age_s,
        fade_s: maker.fade_s,
        draws: settings.draws,
        velocity_outputs: vec![None; ready.axes.len()],
        encode: &|lane: Option<&LaneDescription>, monitor: Option<&MonitorDescription>| {
            file(&maker.description(lane, monitor.cloned(), ""))
        },
    })?;
    let Prepared { divisor, minutes, model_hz, .. } = ready;
    let remarks = format!("{minutes:.1} min of logs; {}", completed.words());
    let description = maker.description(completed.lane.as_ref(), completed.monitor, &remarks);
    let model = file(&description)?;
    if divisor > 1 {
        notes.push(format!(
            "the model runs at {model_hz:.4} Hz, once in {divisor} ticks of the loop: step the add-on that often and ramp its \
             correction between"
        ));
    }
    Ok(Trained { description, model, axes: completed.axes, divisor, minutes, notes, network, rows })
}

/// The window of each axis.
fn windows(described: &LoopDescription, ready: &Prepared, settings: &Settings, sub: u16) -> Result<Vec<Window>, TrainError> {
    let reach = if settings.known.is_some() { FLIGHT_REACH } else { REACH };
    let window = |axis: &PreparedAxis| {
        let logs: Vec<&AxisSignals> = axis.split.training.iter().collect();
        let answer = Answer::of(&logs, ready.model_hz)?;
        let ticks = axis.time_constant_s * ready.model_hz;
        let offsets = offsets(ticks, lcm(answer.divisor as i32, i32::from(sub)), reach);
        fit(&logs, &answer, &offsets, settings.age_s * ready.model_hz, ticks as usize)
    };
    let short = |axis: &PreparedAxis| TrainError::Short { axis: described.axes[axis.place].name.clone() };
    ready.axes.par_iter().map(|axis| window(axis).ok_or_else(|| short(axis))).collect()
}

/// Least common multiple.
fn lcm(a: i32, b: i32) -> i32 {
    let (mut high, mut low) = (a.max(b), a.min(b));
    while low > 0 {
        (high, low) = (low, high % low);
    }
    a / high.max(1) * b
}

/// Places of the axes that are trained.
fn chosen(described: &LoopDescription, wanted: &[String]) -> Result<Vec<usize>, TrainError> {
    for asked in wanted {
        if !described.axes.iter().any(|axis| axis.name == *asked) {
            let has = described.axes.iter().map(|axis| axis.name.as_str()).collect::<Vec<_>>().join(", ");
            return Err(TrainError::NoAxis { asked: asked.clone(), has });
        }
    }
    let trained = |place: &usize| wanted.is_empty() || wanted.contains(&described.axes[*place].name);
    Ok((0..described.axes.len()).filter(trained).collect())
}

/// What the diagnosis says of an axis, if it is to be said; refuses what will not help.
fn judged(
    described: &LoopDescription,
    logs: &[Vec<AxisLog>],
    place: usize,
    settings: &Settings,
) -> Result<Option<String>, TrainError> {
    let axis = &described.axes[place].name;
    let records = logs.iter().map(|axes| {
        let log = &axes[place];
        let time: Vec<f64> = (0..log.signals.len()).map(|row| row as f64 / log.rate_hz).collect();
        let late = (settings.age_s * log.rate_hz).round() as usize;
        let rows = log.signals.len().saturating_sub(late);
        Record::new(&time[..rows], &log.signals.reference[..rows], &log.signals.measured[log.signals.len() - rows..])
    });
    let found = records.collect::<Result<Vec<_>, _>>().and_then(Record::joined).map_err(Into::into);
    let settings_of = DiagnosisSettings { seed: settings.seed, ..DiagnosisSettings::default() };
    let why = match found.and_then(|record| diagnose(&record, &settings_of)) {
        Ok(found) if found.verdict == Verdict::CannotTell => {
            return Ok(Some(format!("warning: axis {axis}: {}", found.verdict_text())));
        }
        Ok(found) if found.verdict != Verdict::WillNot => return Ok(None),
        Ok(found) => found.verdict_text(),
        Err(error) => error.to_string(),
    };
    if settings.force {
        Ok(Some(format!("warning: axis {axis}: {why}")))
    } else {
        Err(TrainError::WillNot { axis: axis.clone(), why })
    }
}
