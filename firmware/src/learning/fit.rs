//! The search for the response that fits a record.
//!
//! *in* the score of one candidate after another; *out* the next candidate, and the best one; *never* more than
//! [`CANDIDATES`]; *source* a grid, then a pattern search (Hooke and Jeeves 1961).

use super::response::{Filter, Response};
use crate::math::clamp;

/// A loop that tracks has a gain of 1 at rest. What is taken for that, of the squares that no gain explains: the noisier, the
/// more.
const TRUST: f32 = 0.5;
/// Natural frequencies of the grid: how many, and the factor from one to the next.
const FREQUENCIES: usize = 8;
const FACTOR: f32 = 1.7;
/// Of the slowest one, in turns of the whole record, rad.
const SLOWEST: f32 = 3.5;
const DAMPINGS: [f32; 2] = [0.5, 0.9];
/// Delays of the grid, in rad of the natural frequency.
const DELAYS: [f32; 3] = [0.05, 0.2, 0.6];
/// Delay in rad of the natural frequency that costs nothing, and what each further rad does, of all squares. A loop of higher
/// order looks late, but begins to answer at once: the feedback part would wait for what comes earlier.
const PROMPT: f32 = 0.25;
/// See [`PROMPT`].
const LATE: f32 = 0.2;
/// What is known beforehand is worth so many samples that have nothing to do with each other: a disturbance of a record has no
/// more. It is known to these shares, standard deviations: of natural frequency, of damping, and of delay in rad.
const SAMPLES: f32 = 5.0;
const KNOWN: f32 = 0.4;
/// Candidates of the grid and altogether.
const GRID: u16 = (FREQUENCIES * DAMPINGS.len() * DELAYS.len()) as u16;
pub(super) const CANDIDATES: u16 = 220;
/// Relative steps of the pattern search: the first and the last.
const STEPS: [f32; 2] = [0.25, 0.02];

/// What a candidate says.
#[derive(Clone, Copy, Debug)]
pub(super) struct Score {
    /// To be made small: squares that are left, of all, and what speaks against the candidate beforehand.
    pub(super) cost: f32,
    /// Squares that are left of all.
    pub(super) left: f32,
    /// Gain at rest that fits best,
    pub(super) raw: f32,
    /// and after what is taken for a loop that tracks.
    pub(super) gain: f32,
}

impl Score {
    /// Of what is no candidate.
    pub(super) const NONE: Self = Self { cost: f32::MAX, left: f32::MAX, raw: 0.0, gain: 0.0 };
}

/// Looks for the best response.
#[derive(Clone, Debug)]
pub(super) struct Search {
    /// What is known beforehand: natural frequency, rad/s; 0 if nothing is; damping; delay, s.
    guess: [f32; 3],
    /// Natural frequency, rad/s; damping; delay, s.
    pub(super) best: [f32; 3],
    pub(super) score: Score,
    /// Relative step.
    step: f32,
    /// Which candidate, and which one around the best in turn.
    pub(super) candidate: u16,
    turn: usize,
    /// One of a round was better.
    better: bool,
    pub(super) tried: [f32; 3],
    pub(super) response: Option<Response>,
    pub(super) filter: Filter,
    pub(super) tick: u32,
    /// Of the sample in the making.
    pub(super) sum: f32,
    pub(super) sums: Sums,
    pub(super) done: bool,
}

/// Sums over the record: of the model alone, with time, squared, with the samples; of the samples in the same way.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    model: [f32; 4],
    seen: [f32; 3],
}

impl Sums {
    pub(super) fn add(&mut self, time: f32, model: f32, seen: f32) {
        let [one, timed, squared, both] = &mut self.model;
        *one += model;
        *timed += time * model;
        *squared += model * model;
        *both += model * seen;
        let [one, timed, squared] = &mut self.seen;
        *one += seen;
        *timed += time * seen;
        *squared += seen * seen;
    }

    /// After mean and drift are taken out of so many samples; `doubt` is what speaks against the candidate beforehand, as a share
    /// of the squares that are left.
    pub(super) fn score(&self, samples: usize, tried: [f32; 3], doubt: f32) -> Score {
        let count = samples as f32;
        // Of times from -1 to 1.
        let times = (count + 1.0) / (3.0 * (count - 1.0)) * count;
        let [m1, mt, mm, ms] = self.model;
        let [s1, st, ss] = self.seen;
        let mm = mm - m1 * m1 / count - mt * mt / times;
        let ms = ms - m1 * s1 / count - mt * st / times;
        let ss = ss - s1 * s1 / count - st * st / times;
        let raw = ms / mm;
        let least = ss - raw * ms;
        let trust = TRUST * least;
        let gain = (ms + trust) / (mm + trust);
        let with = ss - gain * (2.0 * ms - gain * mm) + trust * (gain - 1.0) * (gain - 1.0);
        let [frequency, _, delay] = tried;
        let score =
            Score { cost: (1.0 + doubt) * with / ss + LATE * (delay * frequency - PROMPT).max(0.0), left: least / ss, raw, gain };
        if score.cost.is_finite() { score } else { Score::NONE }
    }
}

impl Search {
    /// Before the first candidate.
    const NEW: Self = Self {
        guess: [0.0; 3],
        best: [0.0; 3],
        score: Score::NONE,
        step: STEPS[0],
        candidate: 0,
        turn: 0,
        better: false,
        tried: [0.0; 3],
        response: None,
        filter: Filter::NONE,
        tick: 0,
        sum: 0.0,
        sums: Sums { model: [0.0; 4], seen: [0.0; 3] },
        done: false,
    };

    /// Around what is known beforehand of a loop at this rate, Hz.
    pub(super) fn around(guess: Option<&Response>, rate_hz: f32) -> Self {
        let guess = guess.map(|guess| guess.second_order_of(rate_hz));
        // Written so that NaN, of poles that no such system has, is none.
        let known = guess.filter(|[frequency, damping, delay]| *frequency > 0.0 && *damping > 0.0 && *delay >= 0.0);
        Self { guess: known.unwrap_or_default(), ..Self::NEW }
    }

    /// What speaks against a candidate beforehand.
    pub(super) fn doubt(&self, tried: [f32; 3]) -> f32 {
        let ([frequency, damping, delay], [known, damped, late]) = (tried, self.guess);
        if known <= 0.0 {
            return 0.0;
        }
        let far = [libm::logf(frequency / known), libm::logf(damping / damped), (delay - late) * known];
        far.iter().fold(0.0, |sum, far| sum + far * far) / (KNOWN * KNOWN * SAMPLES)
    }

    /// The slowest natural frequency that is found in a record of so many seconds, rad/s.
    pub(super) fn slowest(seconds: f32) -> f32 {
        0.5 * SLOWEST / seconds
    }

    /// Natural frequency, damping and delay of the candidate whose turn it is.
    pub(super) fn candidate(&self, seconds: f32) -> [f32; 3] {
        let number = usize::from(self.candidate);
        if self.candidate < GRID {
            let frequency = SLOWEST / seconds * libm::powf(FACTOR, (number % FREQUENCIES) as f32);
            let rest = number / FREQUENCIES;
            let delay = DELAYS[rest % DELAYS.len()] / frequency;
            return [frequency, DAMPINGS[rest / DELAYS.len() % DAMPINGS.len()], delay];
        }
        let mut tried = self.best;
        let sign = if self.turn.is_multiple_of(2) { 1.0 } else { -1.0 };
        let [frequency, damping, delay] = &mut tried;
        match self.turn / 2 {
            0 => *frequency *= 1.0 + sign * self.step,
            1 => *damping = clamp(*damping * (1.0 + sign * self.step), 0.1, 4.0),
            _ => *delay = (*delay + sign * self.step / *frequency).max(0.0),
        }
        tried
    }

    /// The score of the candidate whose turn it was.
    pub(super) fn judge(&mut self, score: Score) {
        if score.cost < self.score.cost {
            (self.best, self.score, self.better) = (self.tried, score, true);
        }
        self.candidate += 1;
        self.tick = 0;
        if self.candidate > GRID {
            self.turn += 1;
            if self.turn == 6 {
                self.turn = 0;
                if !self.better {
                    self.step *= 0.5;
                }
                self.better = false;
            }
        }
        self.done = self.candidate >= CANDIDATES || self.step < STEPS[1];
    }
}
