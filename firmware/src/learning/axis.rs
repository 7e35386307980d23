//! Both learned parts of the correction of one axis.
//!
//! *in* the desired trajectory around now, what is measured, its rate of change; *out* the correction; *never* more than the
//! limits, nor a number that is not finite; *source* ours. Ticks are those of the learner: the loop's response should have
//! settled after about 80 of them.
//!
//! | part | features | least squares |
//! |---|---|---|
//! | preview | the desired trajectory at 12 offsets less the present, and a constant | G features . w = G c - e, c all of it |
//! | feedback | 10 lags of f and f', the error and its derivative as they would be without this part | G features . v = -f |
//! | | | effort: features . v = 0, a control weight |
//! | | | margin: (G features - G features of some ticks before) . v = 0: what more delay in the loop would change |

use super::{
    least_squares::LeastSquares,
    response::{Filter, MAX_DELAY, Response},
};
use crate::math::{clamp, finite_or_zero, sqrt};

/// Ticks that the learner looks behind and ahead.
pub const BEHIND: i32 = 40;
/// See [`BEHIND`].
pub const AHEAD: i32 = 80;

const OFFSETS: [i32; 12] = [-40, -30, -20, -10, 10, 20, 30, 40, 50, 60, 70, 80];
const PREVIEW: usize = OFFSETS.len() + 1;
const LAGS: [usize; 10] = [0, 1, 2, 4, 6, 9, 13, 18, 25, 34];
const FEEDBACK: usize = 2 * LAGS.len();
/// Of the derivative beside the value, s.
const SCALE: f32 = 0.3;
/// Ticks that the margin rows look behind.
const LATER: usize = 4;

/// Prior and noise of the preview part, each in the unit of the axis where it is a constant.
const PREVIEW_PRIOR: f32 = 1.0;
const CONSTANT_PRIOR: f32 = 0.05;
const PREVIEW_SIGMA: f32 = 0.03;
const FEEDBACK_PRIOR: f32 = 1.0;
const FEEDBACK_SIGMA: f32 = 0.003;
/// What is excited is forgotten with this time constant, s.
const MEMORY: f32 = 30.0;
/// Control weight, and weight of the margin rows.
const EFFORT: f32 = 0.03;
const MARGIN: f32 = 10.0;

/// Ticks from one row to the next, and without rows after the start, when the filters know too little yet.
const PREVIEW_EACH: u32 = 5;
const PREVIEW_AFTER: u32 = 60;
const FEEDBACK_EACH: u32 = 2;
const FEEDBACK_AFTER: u32 = 150;

/// The newest `N` values of a signal.
#[derive(Clone, Debug)]
struct Ring<const N: usize> {
    values: [f32; N],
    newest: usize,
}

impl<const N: usize> Ring<N> {
    fn filled(value: f32) -> Self {
        Self { values: [value; N], newest: 0 }
    }

    fn push(&mut self, value: f32) {
        self.newest = (self.newest + 1) % N;
        if let Some(place) = self.values.get_mut(self.newest) {
            *place = finite_or_zero(value);
        }
    }

    /// The value of so many ticks before the newest one.
    fn past(&self, ticks: usize) -> f32 {
        self.values.get((self.newest + N - ticks % N) % N).copied().unwrap_or(0.0)
    }
}

/// What the loop makes of a correction.
#[derive(Clone, Debug)]
struct Answer {
    inputs: Ring<{ MAX_DELAY + 1 }>,
    filter: Filter,
}

impl Answer {
    fn new() -> Self {
        Self { inputs: Ring::filled(0.0), filter: Filter::default() }
    }

    /// At a tick, before its correction is known.
    fn at(&mut self, response: &Response) -> f32 {
        self.filter.step(response, self.inputs.past(response.delay()))
    }
}

/// Which parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parts {
    /// The preview part.
    pub preview: bool,
    /// The feedback part.
    pub feedback: bool,
}

impl Parts {
    /// Both.
    pub const BOTH: Self = Self { preview: true, feedback: true };
    /// None.
    pub const NONE: Self = Self { preview: false, feedback: false };
}

/// How the correction is bounded, in the unit of the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// All of it.
    pub correction: f32,
    /// What the feedback part has of it.
    pub feedback: f32,
}

/// Learns both parts of one axis.
#[derive(Clone, Debug)]
pub struct Learner {
    response: Response,
    rate_hz: f32,
    /// Age of a measurement, ticks.
    delay: f32,
    preview: LeastSquares<PREVIEW>,
    feedback: LeastSquares<FEEDBACK>,
    /// All of the correction, and the feedback part's.
    all: Answer,
    fed: Answer,
    /// What the loop would make of the desired trajectory, from [`AHEAD`] ticks ahead to [`BEHIND`] behind.
    ahead: Filter,
    filtered: Ring<{ (AHEAD + BEHIND) as usize + 1 }>,
    /// The error without the feedback part and its derivative, and what the loop makes of them.
    free: [Ring<64>; 2],
    answers: [Filter; 2],
    answered: [Ring<64>; 2],
    ticks: u32,
}

impl Learner {
    /// Nothing learned yet, of a loop with this response at this rate, Hz, whose measurements are `delay_s` old.
    pub fn new(response: Response, rate_hz: f32, delay_s: f32) -> Self {
        let mut preview = [PREVIEW_PRIOR; PREVIEW];
        preview[PREVIEW - 1] = CONSTANT_PRIOR;
        Self {
            response,
            rate_hz,
            delay: clamp(delay_s * rate_hz, 0.0, (BEHIND - 2) as f32),
            preview: LeastSquares::new(&preview),
            feedback: LeastSquares::new(&[FEEDBACK_PRIOR; FEEDBACK]),
            all: Answer::new(),
            fed: Answer::new(),
            ahead: Filter::default(),
            filtered: Ring::filled(0.0),
            free: [Ring::filled(0.0), Ring::filled(0.0)],
            answers: [Filter::default(); 2],
            answered: [Ring::filled(0.0), Ring::filled(0.0)],
            ticks: 0,
        }
    }

    /// The loop has rested where it is desired to be for long: histories begin anew, what was learned stays.
    pub fn start(&mut self, desired: f32) {
        (self.all, self.fed, self.ticks) = (Answer::new(), Answer::new(), 0);
        self.ahead = Filter::at_rest(&self.response, desired);
        self.filtered = Ring::filled(self.response.gain() * desired);
        for rings in [&mut self.free, &mut self.answered] {
            *rings = [Ring::filled(0.0), Ring::filled(0.0)];
        }
        self.answers = [Filter::default(); 2];
    }

    /// Forgets what was learned.
    pub fn forget(&mut self) {
        self.preview.reset();
        self.feedback.reset();
    }

    /// A tick: `desired` gives the trajectory at an offset of so many ticks, from -[`BEHIND`] to [`AHEAD`]. Returns the
    /// correction of the reference.
    pub fn step(
        &mut self,
        desired: impl Fn(i32) -> f32,
        measured: f32,
        rate: f32,
        learn: Parts,
        act: Parts,
        limits: &Limits,
    ) -> f32 {
        let delay = self.response.delay() as i32;
        // The whole window of what the loop makes of the desired trajectory, one tick further.
        let newest = self.ahead.step(&self.response, desired(AHEAD - 1 - delay));
        self.filtered.push(newest);
        let past = |offset: i32| desired(offset.max(-BEHIND));
        let (whole, part) = (self.delay as i32, self.delay - self.delay as i32 as f32);
        let when = |value: &dyn Fn(i32) -> f32| (1.0 - part) * value(-whole) + part * value(-whole - 1);
        let slope = |offset: i32| 0.5 * self.rate_hz * (past(offset + 1) - past(offset - 1));
        let (error, error_rate) = (measured - when(&past), rate - when(&slope));
        let all = self.all.at(&self.response);
        let fed = self.fed.at(&self.response);
        let fed_rate = self.fed.filter.change() * self.rate_hz;
        if learn.preview && self.ticks.is_multiple_of(PREVIEW_EACH) && self.ticks > PREVIEW_AFTER {
            let filtered = |offset: i32| self.filtered.past((AHEAD - offset) as usize);
            let row = window(filtered, self.response.gain());
            self.preview.learn(&row, all - error, PREVIEW_SIGMA, PREVIEW_EACH as f32 / (MEMORY * self.rate_hz));
        }
        for (answer, (ring, free)) in self.answers.iter_mut().zip(self.answered.iter_mut().zip(&self.free)) {
            ring.push(answer.step(&self.response, free.past(self.response.delay())));
        }
        self.free[0].push(error - fed);
        self.free[1].push(error_rate - fed_rate);
        if learn.feedback && self.ticks.is_multiple_of(FEEDBACK_EACH) && self.ticks > FEEDBACK_AFTER {
            let share = FEEDBACK_EACH as f32 / (MEMORY * self.rate_hz);
            let now = lags(&self.answered, 0);
            self.feedback.learn(&now, -self.free[0].past(0), FEEDBACK_SIGMA, share);
            self.feedback.learn(&lags(&self.free, 0), 0.0, FEEDBACK_SIGMA / sqrt(EFFORT), share);
            let before = lags(&self.answered, LATER);
            let change = core::array::from_fn(|index| now[index] - before[index]);
            self.feedback.learn(&change, 0.0, FEEDBACK_SIGMA / sqrt(MARGIN), share);
        }
        let preview = if act.preview { self.preview.dot(&window(&desired, 1.0)) } else { 0.0 };
        let feedback = if act.feedback { self.feedback.dot(&lags(&self.free, 0)) } else { 0.0 };
        let feedback = clamp(feedback, -limits.feedback, limits.feedback);
        let correction = clamp(preview + feedback, -limits.correction, limits.correction);
        self.all.inputs.push(correction);
        self.fed.inputs.push(feedback);
        self.ticks = self.ticks.saturating_add(1);
        correction
    }
}

/// Features of the preview part.
fn window(signal: impl Fn(i32) -> f32, one: f32) -> [f32; PREVIEW] {
    let present = signal(0);
    core::array::from_fn(|index| OFFSETS.get(index).map_or(one, |offset| signal(*offset) - present))
}

/// Features of the feedback part, of so many ticks before.
fn lags(rings: &[Ring<64>; 2], before: usize) -> [f32; FEEDBACK] {
    core::array::from_fn(|index| match LAGS.get(index) {
        Some(lag) => rings[0].past(lag + before),
        None => SCALE * rings[1].past(LAGS[index - LAGS.len()] + before),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]

        #[test]
        fn a_correction_is_within_its_limits_whatever_comes_in(
            signals in prop::collection::vec(prop_oneof![4 => any::<[f32; 3]>(), 6 => prop::array::uniform3(-2f32..2.0)], 1..60)
        ) {
            let response = Response::second_order(1.0, 8.0, 0.7, 0.02, 100.0).unwrap();
            let mut learner = Learner::new(response, 100.0, 0.0);
            learner.start(0.0);
            let limits = Limits { correction: 0.5, feedback: 0.3 };
            for tick in 0..600 {
                let at = |tick: i32| signals[tick.rem_euclid(signals.len() as i32) as usize];
                let [_, measured, rate] = at(tick);
                let correction = learner.step(|offset| at(tick + offset)[0], measured, rate, Parts::BOTH, Parts::BOTH, &limits);
                prop_assert!(correction.abs() <= limits.correction, "{correction} at {tick}");
            }
            prop_assert!(learner.preview.values().iter().chain(learner.feedback.values()).all(|value| value.is_finite()));
        }
    }
}
