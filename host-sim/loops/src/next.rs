//! Which flight next: what the logs so far lack, the trajectory that tells most of it, and whether it still pays.
//!
//! *in* a description, logs; *out* [`Knowledge`] and a trajectory; *never* faster, harder or further than sound logs were;
//! *source* bootstrap of the identified answer (`models`); power in proportion to the square root of what a band's error costs
//! (A-optimal input design: Goodwin and Payne 1977, chapter 6).

use std::f64::consts::TAU;

use impromptu_training::{
    feedback_design::{ArxModel, response::impulse_response},
    largest_sound_error,
};
use serde::Serialize;

use crate::{
    description::LoopDescription,
    prepared::{PreparedAxis, prepared},
    reading::{AxisLog, AxisSignals},
};

/// Models of which the spread is taken.
const DRAWS: usize = 12;
/// Bands, an octave each, from so many octaves below the inverse of the loop's time constant on.
const BANDS: usize = 7;
/// See [`BANDS`].
const BELOW: i32 = 3;
/// Frequencies in a band.
const LINES: usize = 4;
/// Ticks of an answer that are looked at.
const LONGEST: usize = 1000;
/// An answer smaller than this is not inverted.
const INVERTED: f64 = 0.3;
/// An axis that moves less than this share of the others' extent was not excited.
const STILL: f64 = 0.05;
/// As much flight again pays if it takes more than this off the error, %: from 5.5 to 11 minutes of a Crazyflie's logs both lanes
/// came from 97.1 to 97.5 %.
pub const PAYS_PERCENT: f64 = 0.5;

/// A band of frequencies.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Band {
    /// From, to, Hz.
    pub hz: [f64; 2],
    /// RMS of what was asked of the axis in it, in the axis' unit.
    pub asked: f64,
    /// Error of the identified answer in it, %; `None` where nothing was asked.
    pub error_percent: Option<f64>,
    /// What that error leaves of all of the axis' error, %.
    pub left_percent: Option<f64>,
}

/// What is known of an axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AxisKnowledge {
    /// Name.
    pub axis: String,
    /// Unit.
    pub unit: String,
    /// Whether it moved at all.
    pub excited: bool,
    /// Middle of what was desired, largest distance from it, speed and acceleration, in sound logs.
    pub survived: [f64; 4],
    /// Bands.
    pub bands: Vec<Band>,
    /// What would be left of its error because its answer is not known better, %; `None` if it was not excited.
    pub left_percent: Option<f64>,
}

/// What is known of a loop.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Knowledge {
    /// Flight in the logs, minutes.
    pub minutes: f64,
    /// Logs that were left out, as the loop was lost in them.
    pub left_out: Vec<String>,
    /// Axes.
    pub axes: Vec<AxisKnowledge>,
    /// What twice as much flight would take off the error of the axis that is known least, % of it; `None` if one was not
    /// excited at all.
    pub gain_percent: Option<f64>,
    /// Whether another flight pays.
    pub pays: bool,
}

/// Why nothing can be said.
#[derive(Debug, thiserror::Error)]
pub enum NextError {
    /// Nothing moves.
    #[error("--log: nothing moves in any log; fly something small by hand first, so that it is seen what the loop survives")]
    Still,
    /// An axis of a unit of its own never moved.
    #[error("axis {axis}: never moved, and no other axis in {unit} did: move it a little by hand first")]
    Unseen {
        /// Axis.
        axis: String,
        /// Unit.
        unit: String,
    },
}

/// RMS of signals in a band, Hz.
fn asked(signals: &[&[f64]], rate_hz: f64, hz: [f64; 2]) -> f64 {
    let (mut sum, mut ticks) = (0.0, 0.0);
    for values in signals {
        let count = values.len().max(1) as f64;
        let mean = values.iter().sum::<f64>() / count;
        for line in 0..LINES {
            let (low, high) = edges(hz, line);
            let omega = TAU * (low * high).sqrt() / rate_hz;
            let (mut re, mut im, mut window) = (0.0, 0.0, 0.0);
            for (tick, value) in values.iter().enumerate() {
                let weight = 0.5 - 0.5 * (TAU * tick as f64 / count).cos();
                let (s, c) = (omega * tick as f64).sin_cos();
                (re, im, window) = (re + weight * (value - mean) * c, im + weight * (value - mean) * s, window + weight * weight);
            }
            // Density times the line's width, weighted by the length of the log.
            sum += count * 2.0 * (re * re + im * im) / (rate_hz * f64::max(window, 1e-9)) * (high - low);
        }
        ticks += count;
    }
    (sum / f64::max(ticks, 1.0)).sqrt()
}

/// Edges of a line of a band, Hz.
fn edges([low, high]: [f64; 2], line: usize) -> (f64, f64) {
    let at = |place: usize| low * (high / low).powf(place as f64 / LINES as f64);
    (at(line), at(line + 1))
}

/// Answer to a position reference at a frequency, Hz.
fn answer(response: &[f64], hz: f64, rate_hz: f64) -> [f64; 2] {
    let omega = TAU * hz / rate_hz;
    response.iter().enumerate().fold([0.0; 2], |[re, im], (tick, value)| {
        // A tick passes before anything is measured.
        let (s, c) = (omega * (tick + 1) as f64).sin_cos();
        [re + value * c, im - value * s]
    })
}

fn square([re, im]: [f64; 2]) -> f64 {
    re * re + im * im
}

/// What the models of an axis differ by in each band, relative to the answer: mean square; and the error that the loop leaves
/// there by itself, relative to what is asked.
fn spread(axis: &PreparedAxis, rate_hz: f64, bands: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let response = |model: &ArxModel| impulse_response(model, LONGEST);
    let whole = response(&axis.models.whole);
    // Models of a shorter memory differ by what no flight mends.
    let lags = axis.models.whole.lags();
    let draws: Vec<Vec<f64>> = axis.models.draws.iter().filter(|draw| draw.lags() == lags).map(response).collect();
    let of_band = |&[low, high]: &[f64; 2]| {
        let hz = (low * high).sqrt();
        let [re, im] = answer(&whole, hz, rate_hz);
        let size = square([re, im]).max(INVERTED * INVERTED);
        let differences = draws.iter().map(|draw| {
            let [a, b] = answer(draw, hz, rate_hz);
            square([a - re, b - im]) / size
        });
        // A velocity reference was made part of the position reference.
        let weight = TAU * hz * axis.ratio;
        let alone = square([1.0 - (re - im * weight), -(im + re * weight)]);
        [differences.sum::<f64>() / draws.len().max(1) as f64, alone]
    };
    bands.iter().map(of_band).collect()
}

/// Largest magnitude of rates of change.
fn steepest(values: &[f64], rate_hz: f64) -> f64 {
    values.windows(2).fold(0.0f64, |most, pair| most.max((pair[1] - pair[0]).abs() * rate_hz))
}

fn range(logs: &[&AxisSignals]) -> [f64; 2] {
    let all = || logs.iter().flat_map(|log| log.desired.iter().copied());
    [all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max)]
}

/// What logs, `[file][axis]`, tell of a loop and what they do not.
///
/// # Errors
/// If nothing moves.
pub fn knowledge(described: &LoopDescription, logs: &[Vec<AxisLog>], same_rate: bool, seed: u64) -> Result<Knowledge, NextError> {
    let errors: Vec<f64> = logs.iter().map(|axes| largest(axes)).collect();
    let bound = largest_sound_error(&errors);
    let is_sound = |index: usize| errors[index] <= bound;
    let name = |axes: &Vec<AxisLog>| axes.first().map_or_else(String::new, |log| log.file.clone());
    let left_out = logs.iter().enumerate().filter(|(index, _)| !is_sound(*index)).map(|(_, axes)| name(axes)).collect();
    let sound: Vec<Vec<AxisLog>> =
        logs.iter().enumerate().filter(|(index, _)| is_sound(*index)).map(|(_, axes)| axes.clone()).collect();
    let rate_hz = sound.first().and_then(|axes| axes.first()).map_or(100.0, |log| log.rate_hz);
    let minutes =
        sound.iter().filter_map(|axes| axes.first()).map(|log| log.signals.len() as f64 / log.rate_hz).sum::<f64>() / 60.0;

    let signals = |place: usize| sound.iter().map(|axes| &axes[place].signals).collect::<Vec<_>>();
    let places: Vec<usize> = (0..described.axes.len()).collect();
    let mut survived: Vec<[f64; 4]> = places
        .iter()
        .map(|&place| {
            let logs = signals(place);
            let [low, high] = range(&logs);
            let most = |of: &dyn Fn(&AxisSignals) -> f64| logs.iter().fold(0.0f64, |most, log| most.max(of(log)));
            let speed = most(&|log| log.desired_velocity.iter().fold(0.0, |most, value| most.max(value.abs())));
            [0.5 * (low + high), 0.5 * (high - low), speed, most(&|log| steepest(&log.desired_velocity, rate_hz))]
        })
        .collect();
    // Axes of one unit are beside each other.
    let widest = |unit: &str, survived: &[[f64; 4]]| {
        places
            .iter()
            .filter(|place| described.axes[**place].unit == unit)
            .fold(0.0f64, |most, place| most.max(survived[*place][1]))
    };
    let excited: Vec<bool> = places
        .iter()
        .map(|&place| survived[place][1] > STILL * widest(&described.axes[place].unit, &survived) && survived[place][1] > 0.0)
        .collect();
    if !excited.contains(&true) {
        return Err(NextError::Still);
    }
    for &place in places.iter().filter(|place| !excited[**place]) {
        let unit = &described.axes[place].unit;
        let beside = places.iter().filter(|other| excited[**other] && described.axes[**other].unit == *unit);
        let least = beside.map(|other| survived[*other]).reduce(|a, b| std::array::from_fn(|index| a[index].min(b[index])));
        let Some(least) = least else {
            return Err(NextError::Unseen { axis: described.axes[place].name.clone(), unit: unit.clone() });
        };
        // What it survives was not seen: half of what the others do.
        survived[place] = [survived[place][0], 0.5 * least[1], 0.5 * least[2], 0.5 * least[3]];
    }

    let ready: Vec<Option<(PreparedAxis, f64)>> = places
        .iter()
        .map(|&place| {
            let mut ready = excited[place].then(|| prepared(described, &sound, &[place], same_rate, (DRAWS, seed)).ok())??;
            Some((ready.axes.pop()?, ready.model_hz))
        })
        .collect();
    let slowest = ready.iter().flatten().map(|(axis, _)| axis.time_constant_s).fold(0.0, f64::max);
    let corner = 1.0 / (TAU * if slowest > 0.0 { slowest } else { 0.5 });
    let bands: Vec<[f64; 2]> = (0..BANDS as i32)
        .map(|band| [corner * 2f64.powi(band - BELOW), corner * 2f64.powi(band + 1 - BELOW)])
        .filter(|[_, high]| *high < 0.5 * rate_hz)
        .collect();
    let powers: Vec<Vec<f64>> = places
        .iter()
        .map(|&place| {
            let logs = signals(place);
            let desired: Vec<&[f64]> = logs.iter().map(|log| log.desired.as_slice()).collect();
            bands.iter().map(|hz| asked(&desired, rate_hz, *hz)).collect()
        })
        .collect();
    let axes: Vec<AxisKnowledge> = places
        .iter()
        .map(|&place| {
            let axis = &described.axes[place];
            // What will be asked of it: what is asked of the axes in its unit.
            let wanted = |band: usize| {
                let beside: Vec<f64> = places
                    .iter()
                    .filter(|other| excited[**other] && described.axes[**other].unit == axis.unit)
                    .map(|other| powers[*other][band].powi(2))
                    .collect();
                beside.iter().sum::<f64>() / beside.len().max(1) as f64
            };
            let spreads = ready[place].as_ref().map(|(axis, model_hz)| spread(axis, *model_hz, &bands));
            let alone = spreads.as_ref().map_or(f64::NAN, |spreads| {
                spreads.iter().enumerate().map(|(band, [_, alone])| wanted(band) * alone).sum::<f64>().max(f64::MIN_POSITIVE)
            });
            let percent = |square: f64| 100.0 * square.sqrt();
            let of_band = |(band, hz): (usize, &[f64; 2])| Band {
                hz: *hz,
                asked: powers[place][band],
                error_percent: spreads.as_ref().map(|spreads| percent(spreads[band][0])),
                left_percent: spreads.as_ref().map(|spreads| percent(wanted(band) * spreads[band][0] / alone)),
            };
            let left = spreads
                .as_ref()
                .map(|spreads| percent(spreads.iter().enumerate().map(|(band, of)| wanted(band) * of[0] / alone).sum::<f64>()));
            AxisKnowledge {
                axis: axis.name.clone(),
                unit: axis.unit.clone(),
                excited: excited[place],
                survived: survived[place],
                bands: bands.iter().enumerate().map(of_band).collect(),
                left_percent: left,
            }
        })
        .collect();
    // Errors of an estimate go with the inverse square root of the flight.
    let most = axes.iter().map(|axis| axis.left_percent).try_fold(0.0f64, |most, left| Some(most.max(left?)));
    let gain_percent = most.map(|left| left * (1.0 - 0.5f64.sqrt()));
    let pays = gain_percent.is_none_or(|gain| gain > PAYS_PERCENT);
    Ok(Knowledge { minutes, left_out, axes, gain_percent, pays })
}

/// Largest error of a flight, all axes together; infinite if a number was lost.
fn largest(axes: &[AxisLog]) -> f64 {
    let ticks = axes.iter().map(|log| log.signals.len()).min().unwrap_or(0);
    let at = |tick: usize| axes.iter().map(|log| (log.signals.measured[tick] - log.signals.desired[tick]).powi(2)).sum::<f64>();
    (0..ticks).map(at).fold(0.0, |most, value| if value.is_nan() { f64::INFINITY } else { f64::max(most, value) }).sqrt()
}
