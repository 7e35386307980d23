//! What of a loop decides whether its inverse can be learned, each with its uncertainty.
//!
//! *in* an identified model and draws from its distribution; *out* [`Properties`]; *never* a value outside of its interval;
//! *source* Zhou 2017, Insight 1 (relative degree, zero dynamics), Lemma 1 (gain).

use nalgebra::{Complex, DVector};
use rand::SeedableRng as _;
use rand_distr::{Distribution as _, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;

use crate::{
    columns::mean,
    excitation::increments,
    identification::{Identified, Member},
    record::{Record, Segment},
    transfer_function::TransferFunction,
};

/// A value with the interval that holds it with 95 % of the draws' weight.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Value.
    pub value: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// The middle 95 % of samples, widened so that it holds the value.
    pub fn of(value: f64, samples: impl IntoIterator<Item = f64>) -> Self {
        Self::without(0.025, value, samples)
    }

    /// What is left of samples without this share of them at either end, widened so that it holds the value.
    pub fn without(ends: f64, value: f64, samples: impl IntoIterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = samples.into_iter().filter(|sample| sample.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let index = (share * sorted.len().saturating_sub(1) as f64).round() as usize;
            sorted.get(index).copied().unwrap_or(value)
        };
        Self { low: at(ends).min(value), value, high: at(1.0 - ends).max(value) }
    }

    /// The interval with half widths that are longer by a share of them and by an amount.
    #[must_use]
    pub fn wider(self, share: f64, amount: f64) -> Self {
        let wider = |end: f64, sign: f64| end + (end - self.value) * share + sign * amount;
        Self { low: wider(self.low, -1.0), value: self.value, high: wider(self.high, 1.0) }
    }

    /// Whether a value lies inside.
    pub fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }
}

/// Ticks from a step of the reference to the first answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct RelativeDegree {
    /// Lower end of the interval.
    pub low: usize,
    /// The value.
    pub value: usize,
    /// Upper end of the interval.
    pub high: usize,
}

/// Where a zero lies with respect to the unit circle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Place {
    /// Inside, in 95 % of the draws.
    Inside,
    /// Outside, in 95 % of the draws.
    Outside,
    /// The record does not say.
    Undecided,
}

/// A zero of the channel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Zero {
    /// Real part.
    pub re: f64,
    /// Imaginary part; one zero stands for the pair.
    pub im: f64,
    /// Distance from the origin.
    pub magnitude: Interval,
    /// Natural frequency |ln z| / 2π, Hz: how fast what it holds grows or dies, or turns.
    pub frequency_hz: f64,
    /// With respect to the unit circle.
    pub place: Place,
}

/// Properties of a channel at its sub-rate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Properties {
    /// Strict: the first coefficient of the response that the data can tell from zero (weights of BIC).
    pub strict_degree: RelativeDegree,
    /// Practical: the first tick at which the step response is above [`THRESHOLD`] of its end.
    pub practical_degree: RelativeDegree,
    /// Steady-state gain. So far as errors are not white, and the model perhaps not the whole truth, the interval is wider by
    /// what the model's gain changes between the lowest frequency that the record shows and rest: that is extrapolated.
    pub gain: Interval,
    /// Output at zero input, in the output's unit.
    pub offset: Interval,
    /// How far the step response first goes the wrong way, as a share of its end (above 1: further than the end itself); 0: it
    /// does not.
    pub reversal: Interval,
    /// Ticks until the step response has its final sign for good.
    pub reversal_ticks: usize,
    /// Zeros, the largest first.
    pub zeros: Vec<Zero>,
    /// Lag of slow signals, s.
    pub lag_s: Interval,
    /// Frequency of the log's own motions, Hz: the reference's RMS speed over its RMS distance from its mean.
    pub motion_hz: f64,
    /// Lag of motions that fast, s: what one sees who lays one curve over the other.
    pub motion_lag_s: Interval,
    /// Frequency of -3 dB, Hz; half the sub-rate if the loop is faster.
    pub bandwidth_hz: Interval,
    /// Time until a step has settled to 2 %, s.
    pub settling_s: f64,
    /// Standard deviation of what the model does not explain, in the output's unit.
    pub noise: f64,
    /// Share of the measured variance that the model explains.
    pub explained: f64,
}

/// Share of the final value that the practical relative degree waits for.
pub const THRESHOLD: f64 = 0.1;
/// A reversal smaller than this share of the end is no reversal.
const LEAST_REVERSAL: f64 = 0.02;
/// What draws cannot know, since no model of few coefficients at a sub-rate has the loop's own form, widens intervals of lag and
/// bandwidth by this share of their half widths...
const FORM: f64 = 0.3;
/// ...and by this much of a tick, and of the bandwidth.
const FORM_TICKS: f64 = 0.03;
const FORM_BANDWIDTH: f64 = 0.003;
/// Longest step response that is looked at, ticks.
const HORIZON: usize = 400;

impl Properties {
    /// Properties of a model that was identified from the record, which shows nothing below `lowest_hz`; `draws` are other models
    /// that could be the true one.
    pub fn of(identified: &Identified, draws: &[TransferFunction], record: &Record, lowest_hz: f64) -> Self {
        let period_s = record.period_s;
        let model = &identified.model;
        let over = |property: &dyn Fn(&TransferFunction) -> f64| Interval::of(property(model), draws.iter().map(property));
        let degree = |property: &dyn Fn(&TransferFunction) -> usize| {
            let found = over(&|model| property(model) as f64);
            RelativeDegree { low: found.low as usize, value: found.value as usize, high: found.high as usize }
        };
        let horizon = (model.settling() + 20).min(HORIZON);
        let (noise, explained) = fit(identified, record);
        let bandwidth_hz = over(&|model| model.bandwidth() / (std::f64::consts::TAU * period_s));
        let Interval { low, high, .. } = bandwidth_hz.wider(FORM, FORM_BANDWIDTH * bandwidth_hz.value);
        let half_hz = 0.5 / period_s;
        let motion = motion(record);
        let reversals = |model: &TransferFunction| reversal(model, horizon).0;
        Self {
            strict_degree: strict(identified),
            practical_degree: degree(&|model| model.first_above(THRESHOLD, horizon)),
            gain: gain(identified, lowest_hz * std::f64::consts::TAU * period_s),
            offset: over(&|model| model.offset),
            reversal: over(&reversals),
            reversal_ticks: reversal(model, horizon).1,
            zeros: zeros(model, draws, period_s),
            motion_hz: motion / (std::f64::consts::TAU * period_s),
            motion_lag_s: over(&|model| model.phase_delay(motion) * period_s).wider(FORM, FORM_TICKS * period_s),
            lag_s: over(&|model| model.lag() * period_s).wider(FORM, FORM_TICKS * period_s),
            bandwidth_hz: Interval { low: low.max(0.5 * bandwidth_hz.low), high: high.min(half_hz), ..bandwidth_hz },
            settling_s: model.settling() as f64 * period_s,
            noise,
            explained,
        }
    }
}

/// Samples of the gain of all members.
const GAINS: usize = 2000;

/// The gain, and 95 % of it by each member's covariance, linearised: draws of coefficients whose poles nearly cancel zeros leave
/// the valley in which the data hold them, and their gains with it. Below `angle`, in radians a sample, the record shows nothing.
fn gain(identified: &Identified, angle: f64) -> Interval {
    let value = identified.model.gain();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut samples = Vec::with_capacity(GAINS);
    for Member { weight, model, covariance } in &identified.members {
        let value = model.gain();
        let sum: f64 = model.denominator.iter().sum();
        let (terms, order) = (model.numerator.len(), model.order());
        let slope = DVector::from_fn(covariance.nrows(), |index, _| match index {
            _ if index < terms => 1.0 / sum,
            _ if index < terms + order => -value / sum,
            _ => 0.0,
        });
        let deviation = slope.dot(&(covariance * &slope)).max(0.0).sqrt();
        let wanted = (weight * GAINS as f64).round() as usize;
        samples.extend(StandardNormal.sample_iter(&mut random).take(wanted).map(|normal: f64| value + deviation * normal));
    }
    let Interval { low, high, .. } = Interval::of(value, samples);
    let extrapolated = coloured(&identified.noise) * (identified.model.response(angle).norm() - value.abs()).abs();
    Interval { low: low - extrapolated, value, high: high + extrapolated }
}

/// Share of the errors' variance that the error before tells, 0 to 1.
fn coloured(errors: &[Vec<f64>]) -> f64 {
    let square: f64 = errors.iter().flatten().map(|error| error * error).sum();
    let product: f64 = errors.iter().flat_map(|errors| errors.windows(2)).map(|pair| pair[0] * pair[1]).sum();
    if square > 0.0 { (product / square).clamp(0.0, 1.0).powi(2) } else { 0.0 }
}

/// Dead times with 95 % of the weight, round the best.
fn strict(identified: &Identified) -> RelativeDegree {
    let value = identified.model.dead_time;
    let mut inside = RelativeDegree { low: value, value, high: value };
    let mut sorted = identified.dead_times.clone();
    sorted.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut weight = 0.0;
    for (dead_time, share) in sorted {
        if weight >= 0.95 {
            break;
        }
        weight += share;
        (inside.low, inside.high) = (inside.low.min(dead_time), inside.high.max(dead_time));
    }
    inside
}

/// Largest excursion against the final sign, as a share of the end, and the ticks until the final sign stays.
fn reversal(model: &TransferFunction, horizon: usize) -> (f64, usize) {
    let gain = model.gain();
    let response = model.step_response(horizon);
    // An answer in the tick of the step itself is the mean before decimation, not the loop.
    let wrong = response.iter().skip(1).map(|value| -value / gain).fold(0.0, f64::max);
    if wrong < LEAST_REVERSAL {
        return (0.0, 0);
    }
    (wrong, response.iter().rposition(|value| -value / gain > 0.0).map_or(0, |tick| tick + 1))
}

fn zeros(model: &TransferFunction, draws: &[TransferFunction], period_s: f64) -> Vec<Zero> {
    let upper = |model: &TransferFunction| {
        let mut zeros: Vec<_> = model.zeros().into_iter().filter(|zero| zero.im >= -1e-9).collect();
        zeros.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
        zeros
    };
    let of_draws: Vec<_> = draws.iter().map(upper).collect();
    upper(model)
        .into_iter()
        .map(|zero| {
            // In each draw the zero nearest to this one, seen from the origin by the ratio: 0.5 and 2 are as far from 1.
            let nearest = of_draws.iter().filter_map(|zeros| {
                let distance = |other: &Complex<f64>| (other - zero).norm() / (other.norm() + zero.norm());
                zeros.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).map(|other| other.norm())
            });
            let magnitudes: Vec<f64> = nearest.collect();
            let outside = magnitudes.iter().filter(|magnitude| **magnitude > 1.0).count() as f64 / magnitudes.len().max(1) as f64;
            let place = match zero.norm() > 1.0 {
                true if outside >= 0.95 => Place::Outside,
                false if outside <= 0.05 => Place::Inside,
                _ => Place::Undecided,
            };
            Zero {
                re: zero.re,
                im: zero.im,
                magnitude: Interval::of(zero.norm(), magnitudes),
                frequency_hz: frequency_hz(zero, period_s),
                place,
            }
        })
        .collect()
}

/// Frequency of the reference's motions, rad a sample.
fn motion(record: &Record) -> f64 {
    let (mut speeds, mut distances) = (0.0, 0.0);
    for Segment { reference, .. } in &record.segments {
        let mean = mean(reference);
        speeds += increments(reference).iter().map(|step| step.powi(2)).sum::<f64>();
        distances += reference.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
    }
    (speeds / distances).sqrt().clamp(1e-6, 1.0)
}

/// Natural frequency of a zero, Hz.
pub(crate) fn frequency_hz(zero: Complex<f64>, period_s: f64) -> f64 {
    zero.ln().norm() / (std::f64::consts::TAU * period_s)
}

fn fit(identified: &Identified, record: &Record) -> (f64, f64) {
    let variance = |values: &mut dyn Iterator<Item = f64>| {
        let values: Vec<f64> = values.collect();
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / values.len().max(1) as f64
    };
    let noise = variance(&mut identified.noise.iter().flatten().copied());
    let total = variance(&mut record.segments.iter().flat_map(|segment| &segment.measured).copied());
    (noise.sqrt(), if total > 0.0 { (1.0 - noise / total).max(0.0) } else { 0.0 })
}
