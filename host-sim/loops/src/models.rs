//! Models of an axis that its logs leave possible.
//!
//! *in* signals of an axis; *out* the model of longest memory, and others that could as well be the true one; *never* a model
//! from which a vehicle is needed; *source* least-squares ARX (Ljung, System Identification, 7.3); the others are fitted to
//! pieces of the logs drawn with replacement (Künsch 1989, block bootstrap), at a shorter memory every second one.

use impromptu_training::feedback_design::{ArxModel, AxisLog, DesignRefusal, DesignSettings, IdentificationData};
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

use crate::{reading::AxisSignals, response::Answer};

/// Models of an axis.
#[derive(Clone, Debug)]
pub struct Models {
    /// Sums of products, for designs.
    pub data: IdentificationData,
    /// The model of longest memory from all logs.
    pub whole: ArxModel,
    /// Others that could as well be the true one.
    pub draws: Vec<ArxModel>,
}

/// Pieces that the logs are cut into, at least.
const PIECES: usize = 12;

/// The signals as the identification reads them; without desired position nothing was dithered.
fn axis_log(signals: &AxisSignals) -> AxisLog<'_> {
    AxisLog {
        measured_position: &signals.measured,
        measured_velocity: &signals.velocity,
        reference_position: &signals.reference,
        reference_velocity: &signals.reference_velocity,
        dither: None,
    }
}

/// Ratios tried, in time constants of the loop: none, and those of PD loops of little to much damping.
const RATIOS: [f64; 9] = [0.0, 0.5, 0.62, 0.74, 0.86, 0.98, 1.1, 1.25, 1.4];
/// Ticks of logs that are looked at.
const LOOKED_AT: usize = 24_000;

/// What a velocity reference weighs beside the position reference of each axis, s, of a loop that adds them up before anything
/// else: the ratio at which one combined reference explains most; 0 where it weighs nothing, which is true of all axes or none.
pub fn ratios_of_references(axes: &[Vec<&AxisSignals>], rate_hz: f64, time_constants_s: &[f64]) -> Vec<f64> {
    let curves: Vec<Vec<Option<f64>>> =
        axes.iter().zip(time_constants_s).map(|(logs, constant)| unexplained(logs, rate_hz, *constant)).collect();
    // Of all axes together, as a share of what is left without.
    let sum = |place: usize| -> f64 {
        curves
            .iter()
            .filter_map(|curve| Some((curve.get(place).copied()??, curve.first().copied()??)))
            .map(|(a, b)| (a / b).ln())
            .sum()
    };
    let helps = (1..RATIOS.len()).any(|place| sum(place) < 0.0);
    let of_axis = |curve: &Vec<Option<f64>>| {
        let found: Vec<(f64, f64)> =
            RATIOS.iter().zip(curve).skip(1).filter_map(|(share, left)| Some((*share, (*left)?))).collect();
        let best = found.iter().enumerate().min_by(|(_, a), (_, b)| a.1.total_cmp(&b.1)).map(|(index, _)| index)?;
        match (best.checked_sub(1).and_then(|before| found.get(before)), found.get(best + 1)) {
            (Some(before), Some(after)) => Some(lowest([*before, found[best], *after])),
            _ => Some(found[best].0),
        }
    };
    curves
        .iter()
        .zip(time_constants_s)
        .map(|(curve, constant)| if helps { of_axis(curve).unwrap_or(0.0) * constant } else { 0.0 })
        .collect()
}

/// What a combined reference leaves unexplained at each of the ratios; nothing of an axis without a velocity reference.
fn unexplained(logs: &[&AxisSignals], rate_hz: f64, time_constant_s: f64) -> Vec<Option<f64>> {
    if logs.iter().all(|log| log.reference_velocity.iter().all(|velocity| *velocity == 0.0)) {
        return Vec::new();
    }
    let mut ticks = 0;
    let enough = logs.iter().take_while(|log| {
        let before = ticks;
        ticks += log.len();
        before < LOOKED_AT
    });
    let owned: Vec<AxisSignals> = enough.map(|log| (*log).clone()).collect();
    RATIOS
        .par_iter()
        .map(|share| {
            let mut combined = owned.clone();
            combined.iter_mut().for_each(|signals| signals.combine(share * time_constant_s));
            Answer::of(&combined.iter().collect::<Vec<_>>(), rate_hz).map(|answer| answer.unexplained)
        })
        .collect()
}

/// Where the parabola through three points is lowest, of which the middle one is.
fn lowest([(a, at_a), (b, at_b), (c, at_c)]: [(f64, f64); 3]) -> f64 {
    let (left, right) = ((b - a) * (at_b - at_c), (b - c) * (at_b - at_a));
    if left == right { b } else { b - 0.5 * ((b - a) * left - (b - c) * right) / (left - right) }
}

impl Models {
    /// Of logs of an axis; `draws` others.
    ///
    /// # Errors
    /// If the logs are too short or cannot tell cause from effect.
    pub fn of(logs: &[&AxisSignals], settings: &DesignSettings, draws: usize, seed: u64) -> Result<Self, DesignRefusal> {
        let all: Vec<AxisLog<'_>> = logs.iter().map(|signals| axis_log(signals)).collect();
        let data = IdentificationData::collect(&all, settings.margin_lags)?;
        let whole = data.fit(settings.margin_lags, [0.0; 2], settings.regularisation)?;
        if draws == 0 {
            return Ok(Self { data, whole, draws: Vec::new() });
        }
        let ticks: usize = logs.iter().map(|signals| signals.len()).sum();
        let length = (ticks / PIECES).max(4 * settings.margin_lags);
        let pieces: Vec<AxisLog<'_>> = all.iter().flat_map(|log| cut(log, length)).collect();
        let sums = IdentificationData::sums(&pieces, settings.margin_lags);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let draws = (0..draws).filter_map(|draw| {
            let drawn: Vec<usize> = (0..sums.len()).map(|_| random.random_range(0..sums.len())).collect();
            let lags = if draw % 2 == 0 { settings.margin_lags } else { settings.lags };
            data.resampled(drawn.iter().map(|&piece| &sums[piece])).fit(lags, [0.0; 2], settings.regularisation).ok()
        });
        let draws = draws.collect();
        Ok(Self { data, whole, draws })
    }
}

/// A log in pieces of `length` ticks.
fn cut<'a>(log: &AxisLog<'a>, length: usize) -> Vec<AxisLog<'a>> {
    let AxisLog { measured_position, measured_velocity, reference_position, reference_velocity, .. } = *log;
    let pieces = (measured_position.len() / length).max(1);
    let size = measured_position.len() / pieces;
    (0..pieces)
        .map(|piece| {
            let range = piece * size..(piece + 1) * size;
            AxisLog {
                measured_position: &measured_position[range.clone()],
                measured_velocity: &measured_velocity[range.clone()],
                reference_position: &reference_position[range.clone()],
                reference_velocity: &reference_velocity[range],
                dither: None,
            }
        })
        .collect()
}
