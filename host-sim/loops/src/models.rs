//! Models of an axis that its logs leave possible.
//!
//! *in* signals of an axis; *out* the model of longest memory, and others that could as well be the true one; *never* a model
//! from which a vehicle is needed; *source* least-squares ARX (Ljung, System Identification, 7.3); the others are fitted to pieces
//! of the logs drawn with replacement (Künsch 1989, block bootstrap), at a shorter memory every second one.

use impromptu_training::feedback_design::{ArxModel, AxisLog, DesignRefusal, DesignSettings, IdentificationData};
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

use crate::reading::AxisSignals;

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
pub fn axis_log(signals: &AxisSignals) -> AxisLog<'_> {
    AxisLog {
        measured_position: &signals.measured,
        measured_velocity: &signals.velocity,
        reference_position: &signals.reference,
        reference_velocity: &signals.reference_velocity,
        dither: None,
    }
}

/// Ratios tried, in time constants of the loop.
const RATIOS: [f64; 9] = [0.1, 0.25, 0.4, 0.55, 0.7, 0.85, 1.0, 1.2, 1.5];
/// A loop adds its references up if one combined explains what it does but for this share more of the residual.
const MORE: f64 = 0.02;

/// What a velocity reference weighs beside the position reference, s, if the loop adds them up before anything else: the ratio at
/// which one combined reference explains most. `None` if two explain more.
pub fn ratio_of_references(logs: &[&AxisSignals], settings: &DesignSettings, time_constant_s: f64) -> Option<f64> {
    let left = |logs: &[AxisSignals]| {
        let all: Vec<AxisLog<'_>> = logs.iter().map(axis_log).collect();
        let data = IdentificationData::collect(&all, settings.lags).ok()?;
        let [position, velocity] = data.fit(settings.lags, [0.0; 2], settings.regularisation).ok()?.residual;
        Some(if velocity > 0.0 { velocity } else { position })
    };
    let owned: Vec<AxisSignals> = logs.iter().map(|log| (*log).clone()).collect();
    let free = left(&owned)?;
    let of = |ratio: f64| {
        let mut combined = owned.clone();
        combined.iter_mut().for_each(|signals| signals.combine(ratio));
        left(&combined)
    };
    let found: Vec<(f64, f64)> = RATIOS
        .par_iter()
        .filter_map(|share| of(share * time_constant_s).map(|left| (share * time_constant_s, left)))
        .collect();
    let best = found.iter().enumerate().min_by(|(_, a), (_, b)| a.1.total_cmp(&b.1)).map(|(index, _)| index)?;
    let ratio = match (best.checked_sub(1).and_then(|before| found.get(before)), found.get(best + 1)) {
        (Some(before), Some(after)) => lowest(*before, found[best], *after),
        _ => found[best].0,
    };
    (of(ratio)? <= (1.0 + MORE) * free).then_some(ratio)
}

/// Where the parabola through three points is lowest.
fn lowest((a, at_a): (f64, f64), (b, at_b): (f64, f64), (c, at_c): (f64, f64)) -> f64 {
    let (left, right) = ((b - a) * (at_b - at_c), (b - c) * (at_b - at_a));
    let below = left - right;
    if below == 0.0 { b } else { b - 0.5 * ((b - a) * left - (b - c) * right) / below }
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
