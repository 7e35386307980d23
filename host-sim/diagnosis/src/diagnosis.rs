//! The whole diagnosis of a record.
//!
//! *in* a [`Record`], [`Settings`]; *out* a [`Diagnosis`]; *never* two answers for one seed, on any number of threads;
//! *source* Zhou 2017, Insights 1 to 3; what differs: everything that the paper reads off by eye has an interval here.

use rand::SeedableRng as _;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;

use crate::{
    add_on::Features,
    excitation::{self, Coverage},
    identification::{Draws, Identified, identify},
    plausibility::moves,
    prediction::{Prediction, predict, root_mean_square, window},
    properties::Properties,
    record::{FEWEST_ROWS, Record, RecordError, Segment},
    transfer_function::TransferFunction,
    verdict::{Gate, Gates, Verdict},
};

/// How a record is diagnosed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Rate of the add-on, Hz; chosen from the record if not given. The nearest whole part of the record's rate is taken.
    pub sub_rate_hz: Option<f64>,
    /// Draws from the models that could be the true one.
    pub draws: usize,
    /// Seed of the draws.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { sub_rate_hz: None, draws: 100, seed: 1 }
    }
}

/// Why there is no diagnosis.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DiagnosisError {
    /// The record is none.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The reference does not move.
    #[error("no excitation: the reference does not move; log steps of random height, or several tones")]
    NoExcitation,
    /// The reference holds too few tones.
    #[error(
        "too little excitation: the reference tells {order} coefficients apart, as {tones} sine(s) would, and {needed} are \
         needed; log steps of random height, or five tones or more"
    )]
    FewTones {
        /// Coefficients told apart.
        order: usize,
        /// Tones that would do as much.
        tones: usize,
        /// Coefficients needed.
        needed: usize,
    },
    /// The measured value does not move.
    #[error("no answer: the measured value does not move although the reference does; check which column is which")]
    NoAnswer,
    /// Nothing explains the record.
    #[error(
        "no stable linear model explains the log (best: {percent:.0} % of the measured variance); check which column is which, \
         cut out take-off, landing and failures, or log with larger amplitude"
    )]
    Unexplained {
        /// Share explained by the best model, %.
        percent: f64,
    },
    /// The rate asked for is impossible.
    #[error("a sub-rate of {asked} Hz is impossible for a log of {rate:.2} Hz; give a rate up to that")]
    SubRate {
        /// Rate asked for, Hz.
        asked: f64,
        /// The record's, Hz.
        rate: f64,
    },
    /// At the sub-rate the record is too short.
    #[error(
        "{rows} rows at the sub-rate of {sub_rate_hz:.2} Hz are too few: at least {needed} are needed; log longer, or ask for a \
         higher --sub-rate"
    )]
    Short {
        /// Rows at the sub-rate.
        rows: usize,
        /// The sub-rate, Hz.
        sub_rate_hz: f64,
        /// Rows needed.
        needed: usize,
    },
}

/// What is known of a channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Diagnosis {
    /// Seed of the draws.
    pub seed: u64,
    /// Rate of the record, Hz.
    pub rate_hz: f64,
    /// Rate at which the channel was identified, Hz: ticks are of this one.
    pub sub_rate_hz: f64,
    /// Samples at that rate.
    pub samples: usize,
    /// RMS of reference minus measured value in the log itself, in the output's unit.
    pub logged_error: f64,
    /// Identified model.
    pub model: TransferFunction,
    /// Properties.
    pub properties: Properties,
    /// Excitation.
    pub coverage: Coverage,
    /// Gates.
    pub gates: Gates,
    /// Verdict on an add-on that learns the inverse.
    pub verdict: Verdict,
    /// Rate recommended for the add-on, Hz.
    pub recommended_sub_rate_hz: f64,
    /// Preview recommended for the add-on, s.
    pub recommended_preview_s: f64,
    /// What a bounded window over the desired output reaches, with the features recommended. Where the inverse is unstable this
    /// is all there is.
    pub prediction: Prediction,
    /// The same with difference learning where that is not allowed.
    pub with_difference_learning: Option<Prediction>,
}

/// Most samples at the sub-rate that are looked at.
const MOST_SAMPLES: usize = 16_000;
/// Sub-rate in multiples of the band that passes the loop.
const SAMPLES_A_PERIOD: f64 = 16.0;
/// How often the sub-rate is halved if nothing is found at it.
const SLOWER: usize = 4;
/// Coefficients that the reference has to tell apart.
const LEAST_ORDER: usize = 5;
/// Least share of the measured variance that a model has to explain.
const LEAST_EXPLAINED: f64 = 0.3;

/// What is known of a channel before anything is predicted.
#[derive(Clone, Debug)]
pub struct Assessment {
    /// Rate of the record, Hz.
    pub rate_hz: f64,
    /// Rate at which the channel was identified, Hz.
    pub sub_rate_hz: f64,
    /// The record at that rate.
    pub record: Record,
    /// Model and covariance.
    pub identified: Identified,
    /// Models that could as well be the true one.
    pub draws: Draws,
    /// Properties.
    pub properties: Properties,
    /// Excitation.
    pub coverage: Coverage,
    /// Gates.
    pub gates: Gates,
}

/// Identifies a channel and passes it through the gates, without a prediction.
///
/// # Errors
/// If the record is too short, excites nothing, or no model explains it.
pub fn assess(record: &Record, settings: &Settings) -> Result<Assessment, DiagnosisError> {
    let rate_hz = 1.0 / record.period_s;
    if !record.segments.iter().any(|segment| moves(&segment.reference)) {
        return Err(DiagnosisError::NoExcitation);
    }
    if !record.segments.iter().any(|segment| moves(&segment.measured)) {
        return Err(DiagnosisError::NoAnswer);
    }
    let slowest = match settings.sub_rate_hz {
        Some(asked) if !(asked > 0.0 && asked <= 1.01 * rate_hz) => return Err(DiagnosisError::SubRate { asked, rate: rate_hz }),
        Some(asked) => return assess_at(record, (rate_hz / asked).round().max(1.0) as usize, settings),
        None => record.longest() / FEWEST_ROWS,
    };
    let first = excitation::divisor(record, SAMPLES_A_PERIOD);
    let found = assess_at(record, first, settings);
    // What a log shows may drown at a high rate, in noise or in rounding.
    let too_fast = |found: &Result<Assessment, DiagnosisError>| {
        matches!(found, Err(DiagnosisError::Unexplained { .. } | DiagnosisError::FewTones { .. }))
    };
    let slower = (1..=SLOWER).map(|power| first << power).take_while(|divisor| *divisor <= slowest);
    if too_fast(&found) {
        slower.map(|divisor| assess_at(record, divisor, settings)).find(Result::is_ok).unwrap_or(found)
    } else {
        found
    }
}

/// The same at every `divisor`-th row.
fn assess_at(record: &Record, divisor: usize, settings: &Settings) -> Result<Assessment, DiagnosisError> {
    let rate_hz = 1.0 / record.period_s;
    let record = record.slower(divisor).shorter(MOST_SAMPLES).centred();
    let sub_rate_hz = rate_hz / divisor as f64;
    if record.len() < FEWEST_ROWS || record.shortest() < FEWEST_ROWS / 2 {
        return Err(DiagnosisError::Short { rows: record.len(), sub_rate_hz, needed: FEWEST_ROWS });
    }
    let order = excitation::order_of_excitation(&record);
    if order < LEAST_ORDER {
        return Err(match order {
            0 => DiagnosisError::NoExcitation,
            _ => DiagnosisError::FewTones { order, tones: order.div_ceil(2), needed: LEAST_ORDER },
        });
    }
    let identified = identify(&record).ok_or(DiagnosisError::Unexplained { percent: 0.0 })?;
    let mut random = Xoshiro256PlusPlus::seed_from_u64(settings.seed);
    let draws = identified.draws(&record, settings.draws, &mut random);
    let lowest_hz = excitation::lowest(&record);
    let mut properties = Properties::of(&identified, &draws.models, &record, lowest_hz);
    if properties.explained < LEAST_EXPLAINED {
        return Err(DiagnosisError::Unexplained { percent: 100.0 * properties.explained });
    }
    if divisor > 1 {
        // The mean before decimation also looks half a tick ahead.
        let degree = &mut properties.strict_degree;
        (degree.low, degree.value, degree.high) = (degree.low.max(1), degree.value.max(1), degree.high.max(1));
    }
    // The mean before decimation leaves zeros at half the sub-rate that are its own, not the loop's.
    let trusted_hz = if divisor > 1 { 0.25 * sub_rate_hz } else { 0.5 * sub_rate_hz };
    let coverage = excitation::coverage(&record, properties.bandwidth_hz.value, lowest_hz, trusted_hz);
    let gates = Gates::of(&properties, &coverage, [&draws.models, &identified.rivals], sub_rate_hz);
    Ok(Assessment { rate_hz, sub_rate_hz, identified, draws, properties, coverage, gates, record })
}

/// Diagnoses a record.
///
/// # Errors
/// As [`assess`].
pub fn diagnose(record: &Record, settings: &Settings) -> Result<Diagnosis, DiagnosisError> {
    let Assessment { rate_hz, sub_rate_hz, record, identified, draws, properties, coverage, gates } = assess(record, settings)?;
    let features = if gates.unit_gain == Gate::Passed { Features::Relative } else { Features::Absolute };
    let seed = settings.seed;
    let too_short = || DiagnosisError::Short { rows: record.len(), sub_rate_hz, needed: 4 * FEWEST_ROWS };
    let best = window(&record, &identified, features, seed).ok_or_else(too_short)?;
    let of = |features| predict(&record, &identified, &draws.models, best, features, seed);
    let prediction = of(features).ok_or_else(too_short)?;
    let recommended = recommended_divisor(&properties, excitation::band(&record), record.period_s);
    Ok(Diagnosis {
        seed,
        rate_hz,
        sub_rate_hz,
        samples: record.len(),
        logged_error: logged_error(&record),
        verdict: Verdict::of(&gates, &prediction, draws.lost),
        recommended_sub_rate_hz: sub_rate_hz / recommended as f64,
        recommended_preview_s: best.preview as f64 * record.period_s,
        with_difference_learning: if features == Features::Absolute { of(Features::Relative) } else { None },
        model: identified.model,
        properties,
        coverage,
        gates,
        prediction,
    })
}

/// RMS of reference minus measured value.
fn logged_error(record: &Record) -> f64 {
    let error = |segment: &Segment| -> Vec<f64> { segment.reference.iter().zip(&segment.measured).map(|(u, y)| u - y).collect() };
    root_mean_square(record.segments.iter().flat_map(error))
}

/// Four evaluations in the time by which the loop lags, and five in the shortest period that it passes: with interpolation
/// between them more rates only cost (facts 4.2, items 4 and 6).
fn recommended_divisor(properties: &Properties, band_hz: f64, period_s: f64) -> usize {
    let time = (properties.lag_s.value / 4.0).min(1.0 / (5.0 * band_hz));
    (time / period_s).floor().max(1.0) as usize
}
