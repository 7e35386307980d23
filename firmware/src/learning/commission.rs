//! Measures how an axis answers, while it rests.
//!
//! *in* the error at each tick while the reference steps to and fro; *out* the [`Response`] that fits, or why none does;
//! *never* an offset of more than the stated size, or the whole fit in one tick; *source* output-error identification (Ljung
//! 1999, 4.2) by a grid and a pattern search (Hooke and Jeeves 1961).
//!
//! The reference steps by the stated size in one order of fifteen parts, which every axis begins at another place, so that
//! several are measured at once. What is compared is the mean of so many ticks that the record holds the whole time; gain,
//! offset and drift of each candidate follow by least squares.

use core::num::NonZero;

use super::{
    fit::{CANDIDATES, Score, Search, Sums},
    response::{Filter, Response},
};
use crate::math::finite_or_zero;

/// Samples of a record, and parts of it in which the reference stands still.
const RECORD: usize = 400;
const PARTS: usize = 15;
/// Signs of the parts: a sequence of maximal length (Golomb 1967), which every axis begins at another place.
const SIGNS: u16 = 0b010110010001111;
const SHIFT: usize = 4;
/// Ticks that are simulated in one tick.
const WORK: u32 = 128;
/// Most of the record that may be missing.
const MISSING: f32 = 0.2;
/// Least share of what was seen that a response must explain.
const EXPLAINED: f32 = 0.6;
/// Least gain at rest of a loop that follows its reference, and most.
const GAINS: [f32; 2] = [0.2, 5.0];

/// How a response is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// By how much the reference steps to either side, in the unit of the axis.
    pub size: f32,
    /// How long, s: about three times the time in which the loop settles; at least 400 ticks.
    pub seconds: f32,
}

impl Probe {
    /// Whether size and time are positive numbers, and there are not too many ticks at this rate, Hz.
    pub(super) fn is_sane(&self, rate_hz: f32) -> bool {
        let ticks = self.seconds * rate_hz;
        self.size > 0.0 && self.size < 1e12 && ticks > 0.0 && ticks < 1e6
    }
}

/// Why no response was measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub enum Unfit {
    /// More than a fifth of the samples was missing.
    Missing,
    /// What was seen is not what the steps did, but something else.
    Noisy,
    /// The loop does not follow its reference, or by far too much.
    Gain,
    /// The loop goes the other way.
    Opposite,
    /// It is slower, faster or later than what the learner can work with at this rate.
    Speed,
}

impl core::fmt::Display for Unfit {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Missing => "a fifth of the samples was missing: see why they do not come, then measure again",
            Self::Noisy => "other motion than that of the steps: measure at rest, with larger steps or for longer",
            Self::Gain => "the loop does not follow its reference: check that the reference and the measured value are one axis",
            Self::Opposite => "the loop moves against its reference: check the sign of the reference or of the measured value",
            Self::Speed => {
                "the loop is too slow or too fast for this rate: measure for longer, or run the learner at another rate"
            }
        })
    }
}

impl core::error::Error for Unfit {}

/// Measures the response of one axis.
#[derive(Clone, Debug)]
pub struct Commission {
    probe: Probe,
    rate_hz: f32,
    /// Part of the signs that it begins with.
    first: u32,
    /// Ticks of a sample.
    every: NonZero<u32>,
    samples: [f32; RECORD],
    /// Of the sample in the making: sum, and how many.
    sum: f32,
    known: u32,
    ticks: u32,
    missing: u32,
    search: Search,
}

impl Commission {
    /// Of an axis, whose number says where the steps begin, at this rate, Hz; what is found of it stays near a guess, if there is
    /// one, as far as the record is noisy. `None` if size or time is not a positive number.
    pub fn new(axis: usize, probe: Probe, rate_hz: f32, guess: Option<&Response>) -> Option<Self> {
        if !probe.is_sane(rate_hz) {
            return None;
        }
        let ticks = probe.seconds * rate_hz;
        Some(Self {
            probe,
            rate_hz,
            first: (axis * SHIFT % PARTS) as u32,
            every: NonZero::new(libm::ceilf(ticks / RECORD as f32) as u32).unwrap_or(NonZero::<u32>::MIN),
            samples: [0.0; RECORD],
            sum: 0.0,
            known: 0,
            ticks: 0,
            missing: 0,
            search: Search::around(guess, rate_hz),
        })
    }

    /// Ticks of the record.
    fn length(&self) -> u32 {
        RECORD as u32 * self.every.get()
    }

    /// Whether the reference still steps.
    pub fn steps(&self) -> bool {
        self.ticks < self.length()
    }

    /// How much is done, 0..1.
    pub fn progress(&self) -> f32 {
        let measured = self.ticks as f32 / self.length() as f32;
        0.5 * (measured + f32::from(self.search.candidate.min(CANDIDATES)) / f32::from(CANDIDATES))
    }

    /// Offset of the reference at a tick of the record.
    fn offset(&self, tick: u32) -> f32 {
        let part = tick / self.every * PARTS as u32 / RECORD as u32;
        if SIGNS >> ((part + self.first) % PARTS as u32) & 1 == 1 { self.probe.size } else { -self.probe.size }
    }

    /// A tick: `error` is what is measured less what is desired, `None` where a sample is missing. Returns the offset of the
    /// reference. When the record is full, each tick does a part of the fit; what came of it, in the end.
    pub fn step(&mut self, error: Option<f32>) -> (f32, Option<Result<Response, Unfit>>) {
        if !self.steps() {
            return (0.0, self.fit());
        }
        match error.filter(|error| error.is_finite()) {
            Some(error) => {
                self.sum += error;
                self.known += 1;
            }
            None => self.missing += 1,
        }
        let offset = self.offset(self.ticks);
        self.ticks += 1;
        if self.ticks.is_multiple_of(self.every.get()) {
            let place = (self.ticks / self.every) as usize - 1;
            let before = place.checked_sub(1).and_then(|place| self.samples.get(place)).copied().unwrap_or(0.0);
            let sample = if self.known > 0 { self.sum / self.known as f32 } else { before };
            if let Some(place) = self.samples.get_mut(place) {
                *place = finite_or_zero(sample);
            }
            (self.sum, self.known) = (0.0, 0);
        }
        (offset, None)
    }

    fn fit(&mut self) -> Option<Result<Response, Unfit>> {
        if self.missing as f32 > MISSING * self.length() as f32 {
            return Some(Err(Unfit::Missing));
        }
        for _ in 0..WORK {
            if self.search.done {
                return Some(self.outcome());
            }
            self.simulate();
        }
        None
    }

    /// One tick of a candidate.
    fn simulate(&mut self) {
        let tick = self.search.tick;
        if tick == 0 {
            let tried = self.search.candidate(self.probe.seconds);
            let [frequency, damping, delay] = tried;
            self.search.tried = tried;
            self.search.response = Response::second_order(1.0, frequency, damping, delay, self.rate_hz);
            (self.search.filter, self.search.sum, self.search.sums) = (Filter::default(), 0.0, Sums::default());
        }
        let Some(response) = self.search.response else {
            self.search.judge(Score::NONE);
            return;
        };
        let input = tick.checked_sub(1 + response.delay() as u32).map_or(0.0, |tick| self.offset(tick));
        let Search { filter, sum, sums, tick: next, tried, .. } = &mut self.search;
        *sum += filter.step(&response, input);
        *next += 1;
        if next.is_multiple_of(self.every.get()) {
            let place = (*next / self.every) as usize - 1;
            let time = 2.0 * place as f32 / (RECORD as f32 - 1.0) - 1.0;
            sums.add(time, *sum / self.every.get() as f32, self.samples.get(place).copied().unwrap_or(0.0));
            *sum = 0.0;
            if place + 1 == RECORD {
                let (sums, tried) = (*sums, *tried);
                let score = sums.score(RECORD, tried, self.search.doubt(tried));
                self.search.judge(score);
            }
        }
    }

    fn outcome(&self) -> Result<Response, Unfit> {
        let Search { best: [frequency, damping, delay], score, .. } = self.search;
        let [least, most] = GAINS;
        if score.left > 1.0 - EXPLAINED {
            return Err(Unfit::Noisy);
        }
        if score.raw < 0.0 {
            return Err(Unfit::Opposite);
        }
        if !(least..=most).contains(&score.raw) {
            return Err(Unfit::Gain);
        }
        // Beyond what was looked at, the response is another one.
        if frequency < Search::slowest(self.probe.seconds) {
            return Err(Unfit::Speed);
        }
        Response::second_order(score.gain, frequency, damping, delay, self.rate_hz).ok_or(Unfit::Speed)
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::{draw::draw, response::MAX_DELAY},
        *,
    };
    use proptest::prelude::*;

    /// Measures a loop with noise, drift and lost samples: what was found, and the largest offset.
    fn measured(truth: &Response, rate: f32, probe: Probe, noise: f32, lost: u32, axis: usize) -> (Result<Response, Unfit>, f32) {
        let mut seed = 7;
        found(Commission::new(axis, probe, rate, None).unwrap(), truth, lost, |_| noise * draw(&mut seed))
    }

    /// The same with what pushes the loop at each tick.
    fn found(
        mut commission: Commission,
        truth: &Response,
        lost: u32,
        mut push: impl FnMut(u32) -> f32,
    ) -> (Result<Response, Unfit>, f32) {
        let mut filter = Filter::default();
        let mut inputs = [0.0; MAX_DELAY + 1];
        let (mut most, drift) = (0f32, 0.3 * commission.probe.size / 5e3);
        for tick in 0..4_000_000u32 {
            let value = filter.step(truth, inputs[truth.delay()]) + push(tick) + drift * tick as f32;
            let error = (tick % 100 >= lost).then_some(value);
            let (offset, outcome) = commission.step(error);
            if let Some(outcome) = outcome {
                return (outcome, most);
            }
            most = most.max(offset.abs());
            inputs.rotate_right(1);
            inputs[0] = offset;
        }
        panic!("it never ends");
    }

    /// RMS of what a loop answers to the steps.
    fn answered(truth: &Response, rate: f32, probe: Probe, axis: usize) -> f32 {
        let mut commission = Commission::new(axis, probe, rate, None).unwrap();
        let (mut filter, mut squares, length) = (Filter::default(), 0.0, commission.length());
        for _ in 0..length {
            let answer = filter.step(truth, commission.step(Some(0.0)).0);
            squares += answer * answer;
        }
        (squares / length as f32).sqrt()
    }

    /// What two responses answer to a step differs by at most so much of it.
    fn differ(a: &Response, b: &Response) -> f32 {
        let mut filters = [Filter::default(); 2];
        let mut most = 0f32;
        for tick in 0..400i32 {
            let [a, b] = [(a, 0), (b, 1)]
                .map(|(response, index)| filters[index].step(response, f32::from(u8::from(tick > response.delay() as i32))));
            most = most.max((a - b).abs());
        }
        most
    }

    #[test]
    fn steps_of_different_axes_share_little() {
        let order = |axis: usize| -> Vec<f32> {
            let commission = Commission::new(axis, Probe { size: 1.0, seconds: 4.0 }, 100.0, None).unwrap();
            (0..400).map(|tick| commission.offset(tick)).collect()
        };
        for axis in 1..4 {
            let shared: f32 = order(0).iter().zip(order(axis)).map(|(a, b)| a * b / 400.0).sum();
            assert!(shared.abs() < 0.1, "{shared}");
        }
    }

    #[test]
    fn what_is_wrong_is_named() {
        let probe = Probe { size: 0.05, seconds: 5.0 };
        let good = Response::second_order(1.0, 3.0, 0.7, 0.08, 100.0).unwrap();
        let found = |truth: Response, noise, lost| measured(&truth, 100.0, probe, noise, lost, 0).0;
        assert!(found(good, 0.0, 0).is_ok());
        assert_eq!(found(good, 0.0, 30), Err(Unfit::Missing));
        assert_eq!(found(good, 0.5, 0), Err(Unfit::Noisy));
        assert_eq!(found(good.amplified(-1.0), 0.0, 0), Err(Unfit::Opposite));
        assert_eq!(found(good.amplified(0.05), 0.0, 0), Err(Unfit::Gain));
        assert_eq!(found(good.amplified(0.0), 0.0, 0), Err(Unfit::Noisy));
        for odd in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(Commission::new(0, Probe { size: odd, ..probe }, 100.0, None).is_none());
            assert!(Commission::new(0, Probe { seconds: odd, ..probe }, 100.0, None).is_none());
        }
    }

    /// In gusts a record fits many a loop: with a guess what is found stays near it, and without gusts the guess, wrong by
    /// half, is of no account.
    #[test]
    fn a_guess_counts_as_far_as_the_record_is_noisy() {
        let probe = Probe { size: 0.1, seconds: 6.0 };
        let truth = Response::second_order(1.0, 2.6, 0.75, 0.08, 100.0).unwrap();
        let (mut with, mut without) = (0f32, 0f32);
        for gust in 1..20u32 {
            let found = |guess: Option<&Response>| {
                let (mut seed, mut push) = (gust, 0.0);
                let gusts = |_| {
                    push += 0.01 * (20.0 * probe.size * draw(&mut seed) - push);
                    push
                };
                found(Commission::new(0, probe, 100.0, guess).unwrap(), &truth, 0, gusts).0
            };
            // A tenth off.
            let guess = Response::second_order(1.0, 2.85, 0.7, 0.07, 100.0).unwrap();
            let worse = |found: Result<Response, Unfit>| found.map_or(0.0, |found| differ(&truth, &found));
            with += worse(found(Some(&guess)));
            without += worse(found(None));
        }
        assert!(with < 0.75 * without, "{with} {without}");
        for guess in [1.3, 5.2].map(|frequency| Response::second_order(1.0, frequency, 0.75, 0.08, 100.0).unwrap()) {
            let found = found(Commission::new(0, probe, 100.0, Some(&guess)).unwrap(), &truth, 0, |_| 0.0).0.unwrap();
            assert!(differ(&truth, &found) < 0.05, "{found:?}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// At any rate and speed a loop is found beside noise of up to half of what it answers, well within the factor of two
        /// that a learner bears, with no more than the stated steps.
        #[test]
        fn it_finds_what_answered(
            gain in 0.5f32..2.0, rounds in 1.2f32..6.0, damping in 0.3f32..1.5, late in 0f32..0.6, rate in 80f32..1000.0,
            noise in 0f32..0.5, lost in 0u32..15, axis in 0usize..4
        ) {
            // As long as a record at 100 Hz, or longer.
            let seconds = (400.0f32 / rate).max(1.0);
            let frequency = 2.0 * core::f32::consts::PI * rounds / seconds;
            let delay = (late / frequency).min(30.0 / rate);
            prop_assume!(frequency / rate < 0.5);
            let truth = Response::second_order(gain, frequency, damping, delay, rate).unwrap();
            let probe = Probe { size: 0.1, seconds };
            let (found, most) = measured(&truth, rate, probe, noise * answered(&truth, rate, probe, axis), lost, axis);
            let found = found.unwrap();
            prop_assert!(most <= probe.size);
            prop_assert!(differ(&truth, &found) < (0.4 + 0.5 * noise) * gain, "{truth:?} {found:?} {}", differ(&truth, &found));
        }
    }
}
