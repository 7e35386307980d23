//! What the add-on will reach, before it is trained: the whole procedure is repeated on models that could be the true loop.
//!
//! *in* a record, its identified model, draws; *out* a [`Prediction`]; *never* a flight along what the add-on was trained on;
//! *source* parametric bootstrap (Efron and Tibshirani, "An Introduction to the Bootstrap", 1993, ch. 6). In each draw the log is
//! simulated again with the log's own noise in other places, the add-on learns from that, and flies along half of the log's
//! references run backwards at another speed: of the same kind, and new to it (backwards alone, tones would be those that it was
//! trained on). Errors are measured ones, so the noise floor is in them.

use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use serde::Serialize;

use crate::{
    add_on::{AddOn, Features, Window},
    identification::Identified,
    properties::Interval,
    record::{Record, Segment},
    transfer_function::TransferFunction,
};

/// Predicted outcome.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Prediction {
    /// Window that it is about, in ticks of the sub-rate.
    pub window: Window,
    /// Features that it is about.
    pub features: Features,
    /// RMS of desired minus measured output without the add-on, in the output's unit.
    pub baseline: Interval,
    /// The same with the add-on.
    pub with_add_on: Interval,
    /// Reduction of the error, %; negative: worse.
    pub reduction_percent: Interval,
    /// The same where what the model does not explain comes once, as it does if it is a disturbance from outside; 95 % of the
    /// draws are above its lower end, and as many below its upper one: what the verdict is about.
    pub undisturbed_percent: Interval,
    /// RMS that the noise alone leaves, in the output's unit.
    pub floor: f64,
}

/// What flies, and along what.
struct Bench<'a> {
    record: &'a Record,
    noise: &'a [Vec<f64>],
    /// Ticks at the start of each flight that are not scored.
    skipped: usize,
}

/// Windows ahead that are tried, in ticks beyond the dead time.
const PREVIEWS: [usize; 8] = [0, 1, 2, 4, 7, 11, 16, 24];
/// Windows back that are tried, in ticks.
const PASTS: [usize; 4] = [2, 4, 8, 14];
/// A smaller window is taken if its error is at most this factor of the least one.
const TOLERANCE: f64 = 1.03;
/// What the draws cannot know (signals of the same kind, the form of the model) widens their interval by this share of its half
/// widths...
const WIDENING: f64 = 0.3;
/// ...and by this much, in percentage points.
const LEAST_WIDENING: f64 = 0.5;
/// Forms of less weight do not lengthen the window.
const LEAST_WEIGHT: f64 = 0.03;
/// Share of draws beyond an end that alone is asked for.
const ONE_SIDED: f64 = 0.05;
/// Size in which what the model does not explain comes a second time, at worst.
const AGAIN: f64 = 1.8;
/// Most samples that are simulated in a draw.
const LONGEST: usize = 4_000;
/// Signals are flown at up to this factor of their speed, or as much slower.
const SPEED: f64 = 1.15;
/// Share of unchanged samples above which a signal is one of held values.
const HELD: f64 = 0.3;

/// The window that a model asks for: the smallest that is nearly as good as the best.
pub fn window(record: &Record, identified: &Identified, features: Features, seed: u64) -> Option<Window> {
    let bench = Bench::new(record, identified);
    // Of the latest form that could be the true one: a shorter window would see nothing of what it asks for.
    let latest =
        identified.members.iter().filter(|member| member.weight > LEAST_WEIGHT).map(|member| member.model.dead_time).max();
    let degree = latest.unwrap_or(0).max(identified.model.dead_time);
    let windows = PREVIEWS.iter().flat_map(|more| PASTS.iter().map(move |&past| Window { past, preview: degree + more }));
    let tried: Vec<(Window, f64)> = windows
        .collect::<Vec<_>>()
        .into_par_iter()
        .filter_map(|window| {
            let (_, error) = bench.fly(&identified.model, window, features, seed)?;
            error.is_finite().then_some((window, error))
        })
        .collect();
    let least = tried.iter().map(|(_, error)| *error).fold(f64::INFINITY, f64::min);
    let near = tried.into_iter().filter(|(_, error)| *error <= TOLERANCE * least);
    near.min_by_key(|(window, _)| 2 * window.preview + window.past).map(|(window, _)| window)
}

/// The prediction for a window and features, over draws.
pub fn predict(
    record: &Record,
    identified: &Identified,
    draws: &[TransferFunction],
    window: Window,
    features: Features,
    seed: u64,
) -> Option<Prediction> {
    let bench = Bench::new(record, identified);
    let outcomes: Vec<(f64, f64)> = draws
        .par_iter()
        .enumerate()
        .filter_map(|(draw, model)| bench.fly(model, window, features, seed.wrapping_add(1 + draw as u64)))
        .collect();
    let (baseline, error) = middle(&outcomes)?;
    let reduction = |(baseline, error): &(f64, f64)| 100.0 * (1.0 - error / baseline);
    let found = Interval::of(reduction(&(baseline, error)), outcomes.iter().map(reduction));
    let floor = root_mean_square(identified.noise.iter().flatten().copied());
    // What the model does not explain need not come from outside: so far as it is the loop's own answer to its references
    // (limits, other axes), the add-on's references, which move more, bring it a second time.
    let twice = |error: f64| error.hypot(AGAIN * floor);
    let wider = |end: f64| end + (end - found.value) * WIDENING + (end - found.value).signum() * LEAST_WIDENING;
    let least = wider(found.low).min(found.value - LEAST_WIDENING);
    let most = wider(found.high).max(found.value + LEAST_WIDENING).min(100.0);
    let with_add_on = Interval::of(error, outcomes.iter().map(|outcome| outcome.1));
    Some(Prediction {
        window,
        features,
        baseline: Interval::of(baseline, outcomes.iter().map(|outcome| outcome.0)),
        with_add_on: Interval { high: twice(with_add_on.high), ..with_add_on },
        undisturbed_percent: Interval::without(ONE_SIDED, found.value, outcomes.iter().map(reduction)),
        reduction_percent: Interval {
            low: reduction(&(baseline, twice((1.0 - least / 100.0) * baseline))),
            value: found.value,
            high: most,
        },
        floor,
    })
}

/// Medians of both errors.
fn middle(outcomes: &[(f64, f64)]) -> Option<(f64, f64)> {
    let median = |pick: fn(&(f64, f64)) -> f64| {
        let mut values: Vec<f64> = outcomes.iter().map(pick).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    Some((median(|outcome| outcome.0)?, median(|outcome| outcome.1)?))
}

/// RMS of errors.
pub fn root_mean_square(errors: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) = errors.into_iter().fold((0.0, 0usize), |(sum, count), error| (sum + error * error, count + 1));
    (sum / count.max(1) as f64).sqrt()
}

impl<'a> Bench<'a> {
    fn new(record: &'a Record, identified: &'a Identified) -> Self {
        let skipped = identified.model.settling().clamp(10, 40).min(record.shortest() / 8);
        Self { record, noise: &identified.noise, skipped }
    }

    /// Trains on one simulated log and flies along others: RMS errors of the baseline and with the add-on.
    fn fly(&self, model: &TransferFunction, window: Window, features: Features, seed: u64) -> Option<(f64, f64)> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut samples = 0;
        let mut logs = Vec::new();
        for (segment, noise) in self.record.segments.iter().zip(self.noise) {
            if samples > LONGEST {
                break;
            }
            samples += segment.reference.len();
            let measured = with_noise(model.simulate(&segment.reference), noise, &mut random);
            logs.push((Segment { reference: segment.reference.clone(), measured }, noise));
        }
        let add_on = AddOn::fit(logs.iter().map(|(segment, _)| segment), window, features)?;
        let (mut baseline, mut corrected) = (Vec::new(), Vec::new());
        for (Segment { reference, .. }, noise) in &logs {
            let half = reference.len() / 2;
            let first = random.random_range(0..=reference.len() - half);
            let desired = backwards(&reference[first..first + half], random.random_range(1.0 / SPEED..SPEED));
            for (references, errors) in [(desired.clone(), &mut baseline), (add_on.references(&desired), &mut corrected)] {
                let measured = with_noise(model.simulate(&references), noise, &mut random);
                errors.extend(desired.iter().zip(measured).skip(self.skipped).map(|(desired, y)| desired - y));
            }
        }
        Some((root_mean_square(baseline), root_mean_square(corrected)))
    }
}

/// The signal run backwards, `speed` times as fast: held values stay held, others are interpolated (Catmull and Rom).
fn backwards(signal: &[f64], speed: f64) -> Vec<f64> {
    let Some(last) = signal.len().checked_sub(1) else { return Vec::new() };
    let held = signal.windows(2).filter(|pair| pair[0] == pair[1]).count() as f64 > HELD * last as f64;
    let at = |index: usize, shift: isize| signal[index.saturating_add_signed(shift).min(last)];
    let count = ((last as f64 / speed) as usize).max(1);
    let value = |tick: usize| {
        let place = (last as f64 - tick as f64 * speed).max(0.0);
        if held {
            return at(place.round() as usize, 0);
        }
        let (index, share) = (place as usize, place.fract());
        let [a, b, c, d] = [at(index, -1), at(index, 0), at(index, 1), at(index, 2)];
        b + 0.5 * share * (c - a + share * (2.0 * a - 5.0 * b + 4.0 * c - d + share * (3.0 * (b - c) + d - a)))
    };
    (0..count).map(value).collect()
}

/// The output with the noise's own course, from another moment on, either sign: its colour is kept.
fn with_noise(mut output: Vec<f64>, noise: &[f64], random: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    let (first, sign) = (random.random_range(0..noise.len().max(1)), if random.random::<bool>() { 1.0 } else { -1.0 });
    for (index, value) in output.iter_mut().enumerate() {
        *value += sign * noise.get((first + index) % noise.len().max(1)).copied().unwrap_or_default();
    }
    output
}
