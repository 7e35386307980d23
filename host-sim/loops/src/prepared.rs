//! Logs of a loop made ready: one rate, logs kept apart, sizes of the axes, models.
//!
//! *in* logs, `[file][axis]`; *out* [`Prepared`] axes; *never* a log kept apart in what is fitted; *source* every fourth log is
//! held out, as in `impromptu-training`.

use impromptu_diagnosis::prediction::root_mean_square;
use impromptu_training::{
    feedback_design::{DesignRefusal, DesignSettings},
    hold_out::held_out,
};
use rayon::prelude::*;

use crate::{
    candidates::Scale,
    description::LoopDescription,
    models::{Models, ratios_of_references},
    reading::{AxisLog, AxisSignals},
    response::time_constant,
};

/// Fastest references of a model, Hz: a faster loop steps it at a divided rate.
pub const FASTEST: f64 = 200.0;
/// Ticks in a time constant of a loop with which designs were found good.
const TICKS: f64 = 70.0;
/// A loop of which nothing is known is taken to have this time constant, s.
const UNKNOWN_S: f64 = 0.5;

/// Why logs are not ready.
#[derive(Debug, thiserror::Error)]
pub enum PrepareError {
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
    /// Too little to identify anything by.
    #[error("axis {axis}: {reason}")]
    Identification {
        /// Axis.
        axis: String,
        /// Why.
        reason: DesignRefusal,
    },
}

/// Logs of an axis: to fit, and kept apart.
#[derive(Clone, Debug)]
pub struct Split {
    /// To fit.
    pub training: Vec<AxisSignals>,
    /// Kept apart.
    pub apart: Vec<AxisSignals>,
}

/// An axis whose logs are ready.
#[derive(Clone, Debug)]
pub struct PreparedAxis {
    /// Its place in the description.
    pub place: usize,
    /// Logs at the rate of the model.
    pub split: Split,
    /// Time constant of its answer to the position reference, s.
    pub time_constant_s: f64,
    /// What a velocity reference weighs beside the position reference, s; 0 if nothing.
    pub ratio: f64,
    /// Its sizes.
    pub scale: Scale,
    /// Settings of designs.
    pub design: DesignSettings,
    /// What the logs leave possible.
    pub models: Models,
}

/// Logs that are ready.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// Rate of the model, Hz.
    pub model_hz: f64,
    /// Ticks of the loop in one of the model.
    pub divisor: usize,
    /// Axes.
    pub axes: Vec<PreparedAxis>,
    /// Time constant of the fastest and of the slowest axis, s.
    pub time_constants_s: [f64; 2],
    /// Flight in the logs, minutes.
    pub minutes: f64,
}

/// Makes the logs of the axes at these places ready. `same_rate`: the model runs at the logs' rate, whatever the loop's is.
///
/// # Errors
/// Names the file or the axis.
pub fn prepared(
    described: &LoopDescription,
    logs: &[Vec<AxisLog>],
    places: &[usize],
    same_rate: bool,
    (draws, seed): (usize, u64),
) -> Result<Prepared, PrepareError> {
    let rate_hz = one_rate(logs)?;
    let axis_error =
        |place: usize| move |reason| PrepareError::Identification { axis: described.axes[place].name.clone(), reason };
    let of_axis = |place: usize| logs.iter().map(|axes| &axes[place]).collect::<Vec<_>>();
    let constants = places
        .iter()
        .map(|&place| time_constant_s(&of_axis(place)).map_err(axis_error(place)))
        .collect::<Result<Vec<f64>, _>>()?;
    let fastest = constants.iter().copied().fold(f64::INFINITY, f64::min);
    let slowest = constants.iter().copied().fold(0.0, f64::max);
    let divisor = if same_rate {
        1
    } else {
        ((rate_hz / FASTEST).ceil() as usize).max((rate_hz * fastest / TICKS).floor() as usize).max(1)
    };
    let model_hz = rate_hz / divisor as f64;
    let mut splits: Vec<Split> = places.iter().map(|&place| split(&of_axis(place), divisor)).collect();
    let errors: Vec<f64> = splits.iter().map(|split| root_mean_square(split.training.iter().map(AxisSignals::error))).collect();
    // Axes of one unit are parts of one distance: the smallest of them is not to be corrected by its own small error.
    let distance = |unit: &str| {
        let of_unit = places.iter().zip(&errors).filter(|(place, _)| described.axes[**place].unit == unit);
        of_unit.map(|(_, error)| error * error).sum::<f64>().sqrt()
    };
    let scales: Vec<Scale> = places
        .iter()
        .zip(&constants)
        .map(|(&place, constant)| Scale::of(distance(&described.axes[place].unit), *constant))
        .collect();
    let slow = scales.iter().map(|scale| scale.time).fold(0.0, f64::max);
    let designs: Vec<DesignSettings> = scales.iter().map(|scale| scale.settings(model_hz, slow)).collect();
    let training: Vec<Vec<&AxisSignals>> = splits.iter().map(|split| split.training.iter().collect()).collect();
    let ratios = ratios_of_references(&training, model_hz, &constants);
    for (split, ratio) in splits.iter_mut().zip(&ratios) {
        split.training.iter_mut().chain(&mut split.apart).for_each(|signals| signals.combine(*ratio));
    }
    let axes = splits
        .into_par_iter()
        .enumerate()
        .map(|(index, split)| {
            let (place, scale, design) = (places[index], scales[index], designs[index].clone());
            let logs: Vec<&AxisSignals> = split.training.iter().collect();
            let models = Models::of(&logs, &design, draws, seed).map_err(axis_error(place))?;
            let (time_constant_s, ratio) = (constants[index], ratios[index]);
            Ok(PreparedAxis { place, split, time_constant_s, ratio, scale, design, models })
        })
        .collect::<Result<Vec<_>, PrepareError>>()?;
    let minutes =
        logs.iter().map(|axes| axes.first().map_or(0.0, |log| log.signals.len() as f64 / log.rate_hz)).sum::<f64>() / 60.0;
    Ok(Prepared { model_hz, divisor, axes, time_constants_s: [fastest, slowest], minutes })
}

fn one_rate(logs: &[Vec<AxisLog>]) -> Result<f64, PrepareError> {
    let mut all = logs.iter().flatten();
    let usual = all.next().map_or(100.0, |log| log.rate_hz);
    match all.find(|log| (log.rate_hz / usual - 1.0).abs() > 0.02) {
        Some(log) => Err(PrepareError::Rates { file: log.file.clone(), found: log.rate_hz, usual }),
        None => Ok(usual),
    }
}

/// Every fourth log is kept apart; of one or two the last quarter of each.
fn split(logs: &[&AxisLog], divisor: usize) -> Split {
    let (mut training, mut apart) = (Vec::new(), Vec::new());
    for (index, log) in logs.iter().enumerate() {
        let signals = log.signals.every(divisor);
        if logs.len() < 3 {
            let at = 3 * signals.len() / 4;
            training.push(signals.part(0..at));
            apart.push(signals.part(at..signals.len()));
        } else if held_out(index, logs.len()) {
            apart.push(signals);
        } else {
            training.push(signals);
        }
    }
    Split { training, apart }
}

/// Time constant of an axis' answer to its position reference, s, identified at rates that suit what the one before was.
///
/// # Errors
/// If nothing can be identified.
pub fn time_constant_s(logs: &[&AxisLog]) -> Result<f64, DesignRefusal> {
    let rate_hz = logs.first().map_or(100.0, |log| log.rate_hz);
    let mut found_s = UNKNOWN_S.max(2.0 / rate_hz);
    for _ in 0..5 {
        let divisor = ((rate_hz * found_s / TICKS).floor() as usize).max(1);
        let signals: Vec<AxisSignals> = logs.iter().map(|log| log.signals.every(divisor)).collect();
        let model_hz = rate_hz / divisor as f64;
        let scale = Scale::of(root_mean_square(signals.iter().map(AxisSignals::error)), found_s);
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
