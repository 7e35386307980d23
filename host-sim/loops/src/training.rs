//! From logs of a loop to a model file: window, feedback lane, limits, monitor, and what they will do.
//!
//! *in* a description, logs, the age of what was measured; *out* a [`Trained`] loop; *never* a log in the fit that judges it;
//! *source* Zhou 2017, sections III and V; the lanes as in `impromptu-training`.

use impromptu_diagnosis::{Diagnosis, Record, Settings as DiagnosisSettings, Verdict, diagnose};
use impromptu_firmware::{
    Lanes,
    features::{Feature, Relative, Source},
    model::{Interpolation, Output},
};
use impromptu_model_export::{
    Description, ExportError, FloatNetwork, Precision,
    description::{LaneDescription, MonitorAxisDescription, MonitorDescription, Provenance, Timing},
    encode,
};
use impromptu_training::{
    feedback_design::{DesignRefusal, DesignSettings, response::box_responses},
    hold_out::held_out,
};
use serde::Serialize;

use crate::{
    description::LoopDescription,
    design::{Chosen, DesignAxis, Judge, Scale, authority, lane_of},
    layout::{Layout, TooManyChannels},
    models::{Models, ratio_of_references},
    reading::{AxisLog, AxisSignals},
    response::{Answer, time_constant},
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
    /// Signals and sizes of a loop that is known: its layout, and designs as they are.
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
    /// Rates differ.
    #[error("{file}: {found:.2} rows a second, other logs have {usual:.2}: log them at one rate")]
    Rates {
        /// The file.
        file: String,
        /// Its rate, Hz.
        found: f64,
        /// That of the first log, Hz.
        usual: f64,
    },
    /// An axis that an add-on will not help.
    #[error("axis {axis}: {why}; `host-sim diagnose` says more, --force trains all the same, --axis trains others")]
    WillNot {
        /// Axis.
        axis: String,
        /// Verdict.
        why: String,
    },
    /// Too little to identify anything by.
    #[error("axis {axis}: {reason}")]
    Identification {
        /// Axis.
        axis: String,
        /// Why.
        reason: DesignRefusal,
    },
    /// Too little for a window.
    #[error("axis {axis}: the logs are shorter than two responses of the loop: log longer flights")]
    Short {
        /// Axis.
        axis: String,
    },
    /// More channels than a model holds.
    #[error(transparent)]
    Channels(#[from] TooManyChannels),
    /// No model file.
    #[error(transparent)]
    Export(#[from] ExportError),
}

/// What was found of an axis.
#[derive(Clone, Debug, Serialize)]
pub struct AxisFit {
    /// Name and unit.
    pub axis: String,
    /// See [`AxisFit::axis`].
    pub unit: String,
    /// Verdict of the diagnosis, in words.
    pub verdict: String,
    /// Time in which a step of the position reference has been followed to 63 %, s.
    pub time_constant_s: f64,
    /// RMS error of the logs kept apart without the add-on.
    pub error: f64,
    /// The same with the network lane, and with both.
    pub with_network: f64,
    /// See [`AxisFit::with_network`].
    pub with_both: f64,
    /// Reduction by all lanes there are: mean over pieces kept apart, least and greatest of 95 % of the pieces and models, %.
    pub reduction_percent: [f64; 3],
    /// The feedback lane's design, or why there is none.
    pub lane: Result<String, String>,
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

/// Fastest references of a model, Hz: a faster loop steps it at a divided rate.
pub const FASTEST: f64 = 200.0;
/// Ticks in which a loop that lags is looked at.
const TICKS_A_LAG: f64 = 70.0;
/// Limits above the largest correction of the logs, and ticks in which a correction crosses its range.
const LIMIT_FACTOR: f64 = 1.5;
/// See [`LIMIT_FACTOR`].
const SLEW_TICKS: f64 = 5.0;
/// Time in which a lane fades in, lags.
const FADE_LAGS: f64 = 1.0;
/// What a monitor's response lasts, lags.
const MONITORED: f64 = 3.2;
/// Taps of the monitor.
const TAPS: usize = 32;
/// Pieces by which lanes are judged, and how long each is, lags.
const PIECES: usize = 8;
/// See [`PIECES`].
const PIECE_LAGS: f64 = 40.0;
/// Ticks of the past and the future that a window may reach: those of an application with a preview of 1,024 samples, and of the
/// flight stack.
const REACH: [i32; 2] = [400, 600];
/// See [`REACH`].
const FLIGHT_REACH: [i32; 2] = [44, 136];
/// Rows for probes.
const ROWS: usize = 64;

/// Logs of an axis: to fit, and kept apart.
struct Split {
    training: Vec<AxisSignals>,
    apart: Vec<AxisSignals>,
}

impl Split {
    /// Makes one reference of the two that a loop receives, if it adds them up before anything else: then smooth trajectories tell
    /// as much of it as dither does. The ratio of its gains on the two, s, or `None` if there is but one or it does not.
    fn combine(&mut self, design: &DesignSettings, time_constant_s: f64) -> Option<f64> {
        let moves = |signals: &AxisSignals| signals.reference_velocity.iter().any(|value| *value != 0.0);
        if !self.training.iter().any(moves) {
            return None;
        }
        let ratio = ratio_of_references(&self.training.iter().collect::<Vec<_>>(), design, time_constant_s)?;
        self.training.iter_mut().chain(&mut self.apart).for_each(|signals| signals.combine(ratio));
        Some(ratio)
    }
}

/// Every fourth log is kept apart; of a single one, or two, the last quarter of each.
fn split(logs: &[&AxisLog], divisor: usize) -> Split {
    let (mut training, mut apart) = (Vec::new(), Vec::new());
    for (index, log) in logs.iter().enumerate() {
        let signals = log.signals.every(divisor);
        if logs.len() < 3 {
            let at = 3 * signals.len() / 4;
            training.push(part(&signals, 0, at));
            apart.push(part(&signals, at, signals.len()));
        } else if held_out(index, logs.len()) {
            apart.push(signals);
        } else {
            training.push(signals);
        }
    }
    Split { training, apart }
}

fn part(signals: &AxisSignals, from: usize, to: usize) -> AxisSignals {
    let cut = |values: &[f64]| values[from..to].to_vec();
    AxisSignals {
        desired: cut(&signals.desired),
        desired_velocity: cut(&signals.desired_velocity),
        reference: cut(&signals.reference),
        base: cut(&signals.base),
        reference_velocity: cut(&signals.reference_velocity),
        measured: cut(&signals.measured),
        velocity: cut(&signals.velocity),
        ratio: signals.ratio,
        fresh: None,
    }
}

/// Trains the loop of a description from its logs, `[file][axis]`.
///
/// # Errors
/// Names the axis or the file, and what to do.
pub fn train(described: &LoopDescription, logs: &[Vec<AxisLog>], settings: &Settings) -> Result<Trained, TrainError> {
    let layout = match &settings.known {
        Some(layout) => layout.clone(),
        None => Layout::of(described)?,
    };
    let chosen = chosen_axes(described, &settings.axes)?;
    let rate_hz = one_rate(logs)?;
    let mut notes = Vec::new();
    let diagnoses = chosen.iter().map(|&place| diagnosed(described, logs, place, settings, &mut notes)).collect::<Result<Vec<_>, _>>()?;
    let lags = chosen
        .iter()
        .zip(&diagnoses)
        .map(|(&place, found)| {
            let logs: Vec<&AxisLog> = logs.iter().map(|axes| &axes[place]).collect();
            time_constant_s(&logs, found.as_ref().map_or(LAG_UNKNOWN_S, |found| found.properties.lag_s.value))
                .map_err(|reason| TrainError::Identification { axis: described.axes[place].name.clone(), reason })
        })
        .collect::<Result<Vec<f64>, _>>()?;
    let (fastest, slowest) = (lags.iter().copied().fold(f64::INFINITY, f64::min), lags.iter().copied().fold(0.0, f64::max));
    let divisor = match settings.known {
        Some(_) => 1,
        None => ((rate_hz / FASTEST).ceil() as usize).max((rate_hz * fastest / TICKS_A_LAG).floor() as usize).max(1),
    };
    let model_hz = rate_hz / divisor as f64;
    let mut splits: Vec<Split> = chosen.iter().map(|&place| split(&logs.iter().map(|axes| &axes[place]).collect::<Vec<_>>(), divisor)).collect();
    let scales: Vec<Scale> = splits
        .iter()
        .zip(&lags)
        .map(|(split, lag)| match settings.known {
            Some(_) => Scale { length: 1.0, time: 1.0 },
            None => Scale::of(rms(split.training.iter().map(AxisSignals::error)), *lag),
        })
        .collect();
    let slow = scales.iter().map(|scale| scale.time).fold(0.0, f64::max);
    let designs: Vec<_> = scales.iter().map(|scale| scale.settings(model_hz, slow)).collect();
    let ratios: Vec<Option<f64>> = splits.iter_mut().zip(&designs).zip(&lags).map(|((split, design), lag)| split.combine(design, *lag)).collect();
    let models = chosen
        .iter()
        .zip(&splits)
        .zip(&designs)
        .map(|((&place, split), design)| {
            let logs: Vec<&AxisSignals> = split.training.iter().collect();
            Models::of(&logs, design, settings.draws, settings.seed).map_err(|reason| TrainError::Identification { axis: described.axes[place].name.clone(), reason })
        })
        .collect::<Result<Vec<_>, _>>()?;
    for (&place, ratio) in chosen.iter().zip(&ratios) {
        if let Some(ratio) = ratio {
            notes.push(format!("axis {}: a velocity reference weighs {ratio:.3} s beside the position", described.axes[place].name));
        }
    }
    let age_ticks = settings.age_s * model_hz;
    let sub = sub_divisor(fastest * model_hz);
    let reach = if settings.known.is_some() { FLIGHT_REACH } else { REACH };
    let windows = chosen
        .iter()
        .zip(&splits)
        .zip(&lags)
        .map(|((&place, split), lag)| {
            let short = || TrainError::Short { axis: described.axes[place].name.clone() };
            let logs: Vec<&AxisSignals> = split.training.iter().collect();
            let answer = Answer::of(&logs, model_hz).ok_or_else(short)?;
            let unit = lcm(answer.divisor as i32, i32::from(sub));
            let offsets = offsets(lag * model_hz, unit, reach);
            fit(&logs, &answer, &offsets, age_ticks, (lag * model_hz) as usize).ok_or_else(short)
        })
        .collect::<Result<Vec<Window>, _>>()?;

    let maker = Maker { described, layout: &layout, chosen: &chosen, windows: &windows, settings, model_hz, sub, fade_s: FADE_LAGS * slowest };
    let (network, rows) = maker.network(&splits);
    let axes: Vec<DesignAxis<'_>> = chosen
        .iter()
        .zip(&models)
        .zip(scales.iter().zip(&designs))
        .map(|((&place, models), (scale, design))| DesignAxis { models, scale: *scale, settings: design.clone(), place })
        .collect();
    let encode_lane = |lane: Option<&LaneDescription>| encode(&maker.description(lane, None, ""), Some(&network), Precision::Float, &rows);
    // Where only some axes are trained, the layout of what flies is that of these.
    let judged = judged_layout(&layout, &chosen);
    let pieces = pieces(&splits, (PIECE_LAGS * slowest * model_hz).ceil() as usize);
    let judge = Judge {
        layout: &judged,
        rate_hz: model_hz,
        age_ticks,
        settled: (maker.fade_s * model_hz).ceil() as usize,
        pieces,
        encode: &encode_lane,
    };
    let lanes = judge.choose(&axes, settings.draws)?;
    let found: Vec<(&Chosen, usize)> = lanes.iter().enumerate().filter_map(|(axis, lane)| lane.as_ref().ok().map(|lane| (lane, axis))).collect();
    let lane = (!found.is_empty()).then(|| {
        let parts: Vec<_> = found.iter().map(|(chosen, _)| (&chosen.lane, chosen.margins)).collect();
        lane_of(&parts, authority(&layout, &axes, model_hz))
    });
    let monitor = maker.monitor(&models, slowest);
    let minutes = logs.iter().map(|axes| axes.first().map_or(0.0, |log| log.signals.len() as f64 / log.rate_hz)).sum::<f64>() / 60.0;
    let words: Vec<String> = chosen.iter().zip(&lanes).map(|(&place, lane)| {
        let name = &described.axes[place].name;
        match lane {
            Ok(chosen) => format!("{name}: {}", chosen.design),
            Err(reason) => format!("{name}: no feedback lane: {reason}"),
        }
    }).collect();
    let remarks = format!("{minutes:.1} min of logs; {}", words.join("; "));
    let without = encode(&maker.description(lane.as_ref(), None, &remarks), Some(&network), Precision::Float, &rows)?;
    let both = judge.predicted(&axes, settings.draws, &without, Lanes::BOTH)?;
    let network_alone = judge.predicted(&axes, 0, &without, Lanes { network: true, feedback: false })?;
    let validated = validated_rms(&both, pieces_count(&splits));
    let monitor = MonitorDescription { validated_rms: validated as f32, ..monitor };
    let description = maker.description(lane.as_ref(), Some(monitor), &remarks);
    let model = encode(&description, Some(&network), Precision::Float, &rows)?;
    let axes = chosen
        .iter()
        .enumerate()
        .map(|(index, &place)| {
            let axis = &described.axes[place];
            let flights = &both[index];
            AxisFit {
                axis: axis.name.clone(),
                unit: axis.unit.clone(),
                verdict: diagnoses[index].as_ref().map_or("not judged", |found| found.verdict.words()).into(),
                time_constant_s: lags[index],
                error: rms(flights.iter().map(|[baseline, _]| *baseline)),
                with_network: rms(network_alone[index].iter().map(|[_, with]| *with)),
                with_both: rms(flights.iter().map(|[_, with]| *with)),
                reduction_percent: interval(flights),
                lane: lanes[index].as_ref().map(|chosen| chosen.design.clone()).map_err(ToString::to_string),
            }
        })
        .collect();
    if divisor > 1 {
        notes.push(format!("the model runs at {model_hz:.4} Hz, each {divisor} ticks of a loop at {rate_hz:.4} Hz (`Divided` in the firmware)"));
    }
    Ok(Trained { description, network, rows, model, axes, divisor, minutes, notes })
}

/// Least common multiple.
fn lcm(a: i32, b: i32) -> i32 {
    let (mut high, mut low) = (a.max(b), a.min(b));
    while low > 0 {
        (high, low) = (low, high % low);
    }
    a / high.max(1) * b
}

/// A loop of which nothing is known is taken to lag by this, s.
const LAG_UNKNOWN_S: f64 = 0.5;

/// Time constant of the answer to the position reference, s, identified at rates that suit what the one before was.
fn time_constant_s(logs: &[&AxisLog], guess_s: f64) -> Result<f64, DesignRefusal> {
    let rate_hz = logs[0].rate_hz;
    let mut found_s = guess_s.max(2.0 / rate_hz);
    for _ in 0..4 {
        let divisor = ((rate_hz * found_s / TICKS_A_LAG).floor() as usize).max(1);
        let signals: Vec<AxisSignals> = logs.iter().map(|log| log.signals.every(divisor)).collect();
        let scale = Scale::of(rms(signals.iter().map(AxisSignals::error)), found_s);
        let model_hz = rate_hz / divisor as f64;
        let settings = scale.settings(model_hz, scale.time);
        let models = Models::of(&signals.iter().collect::<Vec<_>>(), &settings, 0, 0)?;
        // A model of too short a memory has no end: look longer.
        let next_s = time_constant(&models.whole).map_or(2.0 * found_s, |ticks| (ticks / model_hz).max(1.0 / rate_hz));
        let done = (0.8..1.25).contains(&(next_s / found_s));
        found_s = next_s;
        if done {
            break;
        }
    }
    Ok(found_s)
}

fn sub_divisor(lag_ticks: f64) -> u16 {
    if lag_ticks >= 30.0 { 2 } else { 1 }
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for value in values {
        sum += value * value;
        count += 1;
    }
    (sum / count.max(1) as f64).sqrt()
}

/// Mean reduction, and the range of 95 % of the flights.
fn interval(flights: &[[f64; 2]]) -> [f64; 3] {
    let mut reductions: Vec<f64> = flights.iter().map(|[baseline, with]| 100.0 * (1.0 - with / baseline.max(1e-12))).collect();
    reductions.sort_by(f64::total_cmp);
    let at = |share: f64| reductions.get(((reductions.len() as f64 - 1.0) * share).round() as usize).copied().unwrap_or(0.0);
    [reductions.iter().sum::<f64>() / reductions.len().max(1) as f64, at(0.025), at(0.975)]
}

fn chosen_axes(described: &LoopDescription, wanted: &[String]) -> Result<Vec<usize>, TrainError> {
    if wanted.is_empty() {
        return Ok((0..described.axes.len()).collect());
    }
    for asked in wanted {
        if !described.axes.iter().any(|axis| axis.name == *asked) {
            let has = described.axes.iter().map(|axis| axis.name.as_str()).collect::<Vec<_>>().join(", ");
            return Err(TrainError::NoAxis { asked: asked.clone(), has });
        }
    }
    Ok((0..described.axes.len()).filter(|&place| wanted.contains(&described.axes[place].name)).collect())
}

fn one_rate(logs: &[Vec<AxisLog>]) -> Result<f64, TrainError> {
    let mut all = logs.iter().flatten();
    let usual = all.next().map_or(100.0, |log| log.rate_hz);
    for log in all {
        if (log.rate_hz / usual - 1.0).abs() > 0.02 {
            return Err(TrainError::Rates { file: log.file.clone(), found: log.rate_hz, usual });
        }
    }
    Ok(usual)
}

/// The diagnosis of an axis over all of its logs.
fn diagnosed(described: &LoopDescription, logs: &[Vec<AxisLog>], place: usize, settings: &Settings, notes: &mut Vec<String>) -> Result<Option<Diagnosis>, TrainError> {
    let axis = &described.axes[place].name;
    let records = logs.iter().map(|axes| {
        let log = &axes[place];
        let time: Vec<f64> = (0..log.signals.len()).map(|row| row as f64 / log.rate_hz).collect();
        let late = (settings.age_s * log.rate_hz).round() as usize;
        let rows = log.signals.len().saturating_sub(late);
        Record::new(&time[..rows], &log.signals.reference[..rows], &log.signals.measured[late..])
    });
    let found = records.collect::<Result<Vec<_>, _>>().and_then(Record::joined).map_err(Into::into);
    match found.and_then(|record| diagnose(&record, &DiagnosisSettings { seed: settings.seed, ..DiagnosisSettings::default() })) {
        Ok(found) => {
            if found.verdict == Verdict::WillNot && !settings.force {
                return Err(TrainError::WillNot { axis: axis.clone(), why: found.verdict_text() });
            }
            if matches!(found.verdict, Verdict::WillNot | Verdict::CannotTell) {
                notes.push(format!("warning: axis {axis}: {}", found.verdict_text()));
            }
            Ok(Some(found))
        }
        Err(error) if settings.force => {
            notes.push(format!("warning: axis {axis}: {error}"));
            Ok(None)
        }
        Err(error) => Err(TrainError::WillNot { axis: axis.clone(), why: error.to_string() }),
    }
}

/// The layout with only the chosen axes.
fn judged_layout(layout: &Layout, chosen: &[usize]) -> Layout {
    Layout { signals: layout.signals.clone(), axes: chosen.iter().map(|&place| layout.axes[place]).collect() }
}

fn pieces_count(splits: &[Split]) -> usize {
    splits.first().map_or(0, |split| split.apart.len())
}

/// Pieces of the logs kept apart.
fn pieces(splits: &[Split], ticks: usize) -> Vec<Vec<&AxisSignals>> {
    let _ = ticks;
    let count = pieces_count(splits).min(PIECES);
    (0..count).map(|index| splits.iter().map(|split| &split.apart[index]).collect()).collect()
}

/// Median over pieces of the RMS error of all axes together.
fn validated_rms(flights: &[Vec<[f64; 2]>], pieces: usize) -> f64 {
    let count = flights.first().map_or(0, Vec::len).min(pieces.max(1));
    let mut all: Vec<f64> = (0..count).map(|index| flights.iter().map(|axis| axis[index][1].powi(2)).sum::<f64>().sqrt()).collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(0.0)
}

/// What a description is made of.
struct Maker<'a> {
    described: &'a LoopDescription,
    layout: &'a Layout,
    chosen: &'a [usize],
    windows: &'a [Window],
    settings: &'a Settings,
    model_hz: f64,
    sub: u16,
    fade_s: f64,
}

impl Maker<'_> {
    fn features(&self) -> Vec<Feature> {
        let sub = i32::from(self.sub);
        let of_axis = |(&place, window): (&usize, &Window)| {
            let channel = self.layout.axes[place].desired[0].unwrap_or(0);
            let feature = |(offset, _): &(i32, f64)| Feature {
                source: Source::Desired,
                channel,
                offset: (offset / sub) as i16,
                relative: Relative::Desired(channel),
            };
            window.weights.iter().map(feature).collect::<Vec<_>>()
        };
        self.chosen.iter().zip(self.windows).flat_map(of_axis).collect()
    }

    /// The windows as a network that is all skip, and rows of its features.
    fn network(&self, splits: &[Split]) -> (FloatNetwork, Vec<Vec<f32>>) {
        let input_scale: Vec<f32> = self.envelope().iter().map(|(low, high)| low.abs().max(high.abs()).max(1e-9)).collect();
        let output_scale: Vec<f32> = self.windows.iter().map(|window| (window.largest as f32).max(1e-9)).collect();
        let inputs = input_scale.len();
        let mut skip = vec![0.0f32; inputs * self.windows.len()];
        let mut input = 0;
        for (output, window) in self.windows.iter().enumerate() {
            for (_, weight) in &window.weights {
                skip[output * inputs + input] = *weight as f32 * input_scale[input] / output_scale[output];
                input += 1;
            }
        }
        let network = FloatNetwork {
            input_mean: vec![0.0; inputs],
            input_scale,
            layers: Vec::new(),
            skip: Some(skip),
            output_mean: self.windows.iter().map(|window| window.constant as f32).collect(),
            output_scale,
            notes: Default::default(),
        };
        let shortest = splits.iter().flat_map(|split| &split.training).map(AxisSignals::len).min().unwrap_or(1);
        let rows = (0..shortest).step_by((shortest / ROWS).max(1)).map(|tick| {
            let of_axis = |(split, window): (&Split, &Window)| {
                let values = &split.training[0].desired;
                let last = values.len() as i32 - 1;
                let value = |(offset, _): &(i32, f64)| (values[(tick as i32 + offset).clamp(0, last) as usize] - values[tick]) as f32;
                window.weights.iter().map(value).collect::<Vec<_>>()
            };
            splits.iter().zip(self.windows).flat_map(of_axis).collect()
        });
        (network, rows.collect())
    }

    fn envelope(&self) -> Vec<(f32, f32)> {
        self.windows.iter().flat_map(|window| &window.envelope).map(|(low, high)| (*low as f32, *high as f32)).collect()
    }

    fn outputs(&self, lane: Option<&LaneDescription>) -> Vec<Output> {
        let of_axis = |(output, (&place, window)): (usize, (&usize, &Window))| {
            let axis = &self.described.axes[place];
            let of_lane = lane.and_then(|lane| lane.axes.iter().find(|axis| usize::from(axis.output) == output));
            let feedback = of_lane.map_or(0.0, |axis| f64::from(axis.fast_limit + axis.integral_limit));
            let limit = (LIMIT_FACTOR * window.largest + feedback).min(axis.cap.unwrap_or(f64::INFINITY));
            let slew = (limit / SLEW_TICKS).min(axis.cap_rate.map_or(f64::INFINITY, |rate| rate / self.model_hz));
            Output { channel: self.layout.axes[place].reference[0].unwrap_or(0), limit: limit as f32, slew: slew as f32 }
        };
        self.chosen.iter().zip(self.windows).enumerate().map(of_axis).collect()
    }

    /// The response of each axis to its correction; errors of one unit only can be added up.
    fn monitor(&self, models: &[Models], slowest: f64) -> MonitorDescription {
        let divisor = ((MONITORED * slowest * self.model_hz / TAPS as f64).ceil() as usize).max(1);
        let unit = &self.described.axes[self.chosen[0]].unit;
        let axes = self.chosen.iter().zip(models).zip(0u8..).filter(|((place, _), _)| self.described.axes[**place].unit == *unit);
        let axes = axes.filter_map(|((&place, models), output)| {
            let [taps, _] = box_responses(&models.whole, divisor, TAPS);
            let channels = &self.layout.axes[place];
            Some(MonitorAxisDescription {
                error: (channels.measured[0]?, channels.desired[0]?),
                inputs: vec![output],
                taps: vec![taps.iter().map(|tap| *tap as f32).collect()],
            })
        });
        MonitorDescription { divisor: divisor as u16, validated_rms: 0.0, axes: axes.collect() }
    }

    fn description(&self, lane: Option<&LaneDescription>, monitor: Option<MonitorDescription>, remarks: &str) -> Description {
        let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
        let mut digest = crc.digest();
        for (_, weight) in self.windows.iter().flat_map(|window| &window.weights) {
            digest.update(&weight.to_le_bytes());
        }
        Description {
            name: self.settings.name.clone(),
            provenance: Provenance {
                vehicle: self.described.name.clone(),
                gains: "its own".into(),
                condition: "its logs".into(),
                software: format!("host-sim {}", env!("CARGO_PKG_VERSION")),
                seed: self.settings.seed,
                data_crc: digest.finalize(),
                remarks: remarks.into(),
            },
            signals: self.layout.signals.clone(),
            timing: Timing {
                reference_rate_hz: self.model_hz as f32,
                divisor: self.sub,
                interpolation: Interpolation::Linear,
                measurement_delay_s: self.settings.age_s as f32,
                fade_s: self.fade_s as f32,
            },
            features: self.features(),
            outputs: self.outputs(lane),
            envelope: self.envelope(),
            feedback_lane: lane.cloned(),
            monitor,
            tie: None,
        }
    }
}
