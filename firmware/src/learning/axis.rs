//! Both learned parts of the correction of one axis.
//!
//! *in* the desired trajectory around now, what is measured, its rate of change; *out* the correction; *never* more than the
//! limits, nor a number that is not finite; *source* ours.
//!
//! | part | features | least squares |
//! |---|---|---|
//! | preview | the desired trajectory at 12 offsets less the present, and a constant | G features . w = G c - e, c all of it |
//! | feedback | 6 lags of f and f', the error and its derivative as they would be without this part | G features . v = -f |
//! | | | effort: features . v = 0, a control weight |
//! | | | margin: (G features - G features of some ticks before) . v = 0: what more delay in the loop would change |
//!
//! Offsets and lags are those of a loop with a natural frequency of 0.0255 rad a tick (2.55 rad/s at 100 Hz); of a faster one
//! they are shorter in proportion. What is learned is one row a tick: preview, feedback, margin, effort.

use super::{
    judge::Judge,
    least_squares::{LeastSquares, above},
    response::{Answer, Filter, Response},
    ring::Ring,
};
use crate::math::{clamp, sqrt};

/// Ticks that the learner looks behind and ahead.
pub const BEHIND: i32 = 31;
/// See [`BEHIND`].
pub const AHEAD: i32 = 80;

const OFFSETS: [i16; 12] = [-30, -20, -12, -6, 6, 12, 20, 30, 40, 50, 65, 80];
const PREVIEW: usize = OFFSETS.len() + 1;
const LAGS: [u8; 6] = [0, 3, 8, 16, 30, 50];
const FEEDBACK: usize = 2 * LAGS.len();
/// Ticks that the margin rows look behind.
const LATER: f32 = 4.0;
/// Of the derivative beside the value, ticks.
const DERIVATIVE: f32 = 30.0;
/// Natural frequency, rad a tick, of which these are.
const TURN: f32 = 0.0255;
/// Past values that the lags, and lags before [`LATER`], need.
const FREE: usize = 51;
const ANSWERED: usize = FREE + LATER as usize;

/// Standard deviations of the weights before anything was learned.
const PRIOR: f32 = 1.0;
/// Of the constant, and noise of a row of each part, in scales of the axis.
const CONSTANT_PRIOR: f32 = 0.3;
const PREVIEW_SIGMA: f32 = 0.015;
const FEEDBACK_SIGMA: f32 = 0.007;
/// Control weight, and weight of the margin rows.
const EFFORT: f32 = 0.001;
const MARGIN: f32 = 10.0;
/// A motion that is faster than what was learned from leaves more that no weights explain. Its root mean square over this time,
/// s, is noise too.
const NOISE_WINDOW: f32 = 2.0;
/// Error that does not matter, in scales of the axis.
const FLOOR: f32 = 0.02;
/// What is excited is forgotten with this time constant, s.
const MEMORY: f32 = 30.0;

/// A part acts with a share that grows with the time in motion that it has learned from, s: least squares that have seen a second
/// of a motion are surer of themselves than they may be. In motion is where a feature is larger than this, in scales of the axis.
const PREVIEW_TIME: f32 = 2.8;
const FEEDBACK_TIME: f32 = 5.0;
const MOTION: f32 = 0.01;

/// Ticks from one row of a kind to the next, and without rows after the start, when the filters know too little yet.
const EACH: u32 = 4;
const PREVIEW_AFTER: f32 = 60.0;
const FEEDBACK_AFTER: f32 = 150.0;

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
    /// The preview part alone.
    pub const PREVIEW: Self = Self { preview: true, feedback: false };
}

/// How the correction is bounded, in the unit of the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// By what errors are judged, about what a correction is at its largest in a calm motion: an error of a fiftieth of it does
    /// not matter.
    pub scale: f32,
    /// All of it.
    pub correction: f32,
    /// What the feedback part has of it.
    pub feedback: f32,
    /// Its change in a second.
    pub rate: f32,
}

/// What was measured: the value and its rate of change, unit of the axis and a second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Value.
    pub value: f32,
    /// Rate of change.
    pub rate: f32,
}

/// What was learned of one axis: weights of the preview part, whose last one is the constant, and of the feedback part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Learned {
    /// Preview part.
    pub preview: [f32; PREVIEW],
    /// Feedback part.
    pub feedback: [f32; FEEDBACK],
}

/// Learns both parts of one axis.
#[derive(Clone, Debug)]
pub struct Learner {
    response: Response,
    limits: Limits,
    rate_hz: f32,
    /// Age of a measurement, ticks.
    delay: f32,
    offsets: [i16; OFFSETS.len()],
    lags: [u8; LAGS.len()],
    /// Of offsets and lags, at most 1.
    scale: f32,
    preview: LeastSquares<PREVIEW, { above(PREVIEW) }>,
    feedback: LeastSquares<FEEDBACK, { above(FEEDBACK) }>,
    /// All of the correction, and the feedback part's.
    all: Answer,
    fed: Answer,
    /// What the loop would make of the desired trajectory, from [`AHEAD`] ticks ahead to [`BEHIND`] behind.
    ahead: Filter,
    filtered: Ring<{ (AHEAD + BEHIND) as usize + 1 }>,
    /// The error without the feedback part and its derivative, and what the loop makes of them.
    free: [Ring<FREE>; 2],
    answers: [Filter; 2],
    answered: [Ring<ANSWERED>; 2],
    judge: Judge,
    /// What is possible now.
    room: [f32; 2],
    /// Time in motion that was learned from, s.
    learned_s: f32,
    /// Mean square of what the preview part's rows surprise by.
    noise: f32,
    correction: f32,
    ticks: u32,
    forgotten: u16,
}

impl Learner {
    /// Nothing learned yet, of a loop with this response at this rate, Hz, whose measurements are `delay_s` old. `None` if a
    /// limit is not a positive number.
    pub fn new(response: Response, rate_hz: f32, delay_s: f32, limits: Limits) -> Option<Self> {
        let Limits { scale, correction, feedback, rate } = limits;
        if ![scale, correction, feedback, rate].iter().all(|limit| *limit > 0.0 && *limit < 1e12) {
            return None;
        }
        let mut preview = [PRIOR; PREVIEW];
        preview[PREVIEW - 1] = CONSTANT_PRIOR * limits.scale;
        let scale = clamp(TURN / response.turn(), 0.05, 1.0);
        // Away from 0: no offset is the present.
        let offset = |ticks: i16| (libm::ceilf(f32::from(ticks.abs()) * scale) as i16) * ticks.signum();
        Some(Self {
            response,
            limits,
            rate_hz,
            delay: clamp(delay_s * rate_hz, 0.0, (BEHIND - 2) as f32),
            offsets: OFFSETS.map(offset),
            lags: LAGS.map(|ticks| libm::ceilf(f32::from(ticks) * scale) as u8),
            scale,
            preview: LeastSquares::new(&preview),
            feedback: LeastSquares::new(&[PRIOR; FEEDBACK]),
            all: Answer::new(),
            fed: Answer::new(),
            ahead: Filter::default(),
            filtered: Ring::filled(0.0),
            free: [Ring::filled(0.0), Ring::filled(0.0)],
            answers: [Filter::default(); 2],
            answered: [Ring::filled(0.0), Ring::filled(0.0)],
            judge: Judge::default(),
            room: [-limits.correction, limits.correction],
            learned_s: 0.0,
            noise: 0.0,
            correction: 0.0,
            ticks: 0,
            forgotten: 0,
        })
    }

    /// The loop has rested where it is desired to be for long: histories begin anew, what was learned stays.
    pub fn start(&mut self, desired: f32) {
        (self.all, self.fed, self.ticks, self.correction) = (Answer::new(), Answer::new(), 0, 0.0);
        self.ahead = Filter::at_rest(&self.response, desired);
        self.filtered = Ring::filled(self.response.gain() * desired);
        self.free = [Ring::filled(0.0), Ring::filled(0.0)];
        self.answered = [Ring::filled(0.0), Ring::filled(0.0)];
        self.answers = [Filter::default(); 2];
        self.judge.start();
    }

    /// What a correction may be from now on, within the limits: from where to where. The limits if it is not said.
    pub fn bound(&mut self, low: f32, high: f32) {
        self.room = [low, high];
    }

    /// Forgets what was learned.
    pub fn forget(&mut self) {
        self.preview.reset();
        self.feedback.reset();
        self.noise = 0.0;
        self.learned_s = 0.0;
    }

    /// What was learned.
    pub fn learned(&self) -> Learned {
        Learned { preview: *self.preview.values(), feedback: *self.feedback.values() }
    }

    /// Share of the correction that acts, 0..1: less than 1 at the start, and where it does not help.
    pub fn share(&self) -> f32 {
        self.judge.share()
    }

    /// How often what was learned was forgotten because it did harm.
    pub fn forgotten(&self) -> u16 {
        self.forgotten
    }

    /// A tick: `desired` gives the trajectory at an offset of so many ticks, from -[`BEHIND`] to [`AHEAD`]; `measured` is `None`
    /// where a sample is missing or not to be trusted. Returns the correction of the reference.
    pub fn step(&mut self, desired: impl Fn(i32) -> f32, measured: Option<Measured>, learn: Parts, act: Parts) -> f32 {
        let delay = self.response.delay() as i32;
        // The whole window of what the loop makes of the desired trajectory, one tick further.
        let newest = self.ahead.step(&self.response, desired(AHEAD - 1 - delay));
        self.filtered.push(newest);
        let all = self.all.at(&self.response);
        let fed = self.fed.at(&self.response);
        for (answer, (ring, free)) in self.answers.iter_mut().zip(self.answered.iter_mut().zip(&self.free)) {
            ring.push(answer.step(&self.response, free.past(self.response.delay())));
        }
        match measured.filter(|measured| measured.value.is_finite() && measured.rate.is_finite()) {
            Some(measured) => {
                let [error, error_rate] = self.error(&desired, measured);
                self.free[0].push(error - fed);
                self.free[1].push(error_rate - self.fed.filter.change() * self.rate_hz);
                self.learn(learn, all - error);
                if self.judge.tell(error, error - all, FLOOR * self.limits.scale, self.rate_hz) {
                    self.forget();
                    self.forgotten = self.forgotten.saturating_add(1);
                }
            }
            // The disturbance is what it was.
            None => self.free.iter_mut().for_each(|ring| ring.push(ring.past(0))),
        }
        let share = self.judge.share();
        let Limits { correction: most, feedback: fed_most, rate, .. } = self.limits;
        let learned = |time: f32| clamp(self.learned_s / time, 0.0, 1.0);
        let preview = if act.preview { learned(PREVIEW_TIME) * self.preview.dot(&self.window(&desired, 1.0)) } else { 0.0 };
        let feedback = if act.feedback { learned(FEEDBACK_TIME) * self.feedback.dot(&self.past(&self.free, 0)) } else { 0.0 };
        let feedback = clamp(share * feedback, -fed_most, fed_most);
        let step = rate / self.rate_hz;
        let [low, high] = self.room;
        let asked = clamp(share * preview + feedback, clamp(low, -most, most), clamp(high, -most, most));
        self.correction = clamp(asked, self.correction - step, self.correction + step);
        self.all.inputs.push(self.correction);
        self.fed.inputs.push(feedback);
        self.ticks = self.ticks.saturating_add(1);
        self.correction
    }

    /// Error and its rate of change, against what was desired when it was measured.
    fn error(&self, desired: &impl Fn(i32) -> f32, measured: Measured) -> [f32; 2] {
        let past = |offset: i32| desired(offset.max(-BEHIND));
        let (whole, part) = (self.delay as i32, self.delay - self.delay as i32 as f32);
        let when = |value: &dyn Fn(i32) -> f32| (1.0 - part) * value(-whole) + part * value(-whole - 1);
        let slope = |offset: i32| 0.5 * self.rate_hz * (past(offset + 1) - past(offset - 1));
        [measured.value - when(&past), measured.rate - when(&slope)]
    }

    /// Learns from the row whose turn it is.
    fn learn(&mut self, learn: Parts, missing: f32) {
        let forgotten = EACH as f32 / (MEMORY * self.rate_hz);
        let sigma = FEEDBACK_SIGMA * self.limits.scale;
        let since = |ticks: f32| self.ticks as f32 > ticks * self.scale;
        match self.ticks % EACH {
            0 if learn.preview && since(PREVIEW_AFTER) => {
                let row = self.window(|offset| self.filtered.past((AHEAD - offset) as usize), self.response.gain());
                let surprise = missing - self.preview.dot(&row);
                let most = self.limits.correction * self.limits.correction;
                self.noise += (clamp(surprise * surprise, 0.0, most) - self.noise) * EACH as f32 / (NOISE_WINDOW * self.rate_hz);
                let noise = PREVIEW_SIGMA * self.limits.scale + sqrt(self.noise.max(0.0));
                self.preview.learn(&row, missing, noise, forgotten);
                let (_, features) = row.split_last().unwrap_or((&0.0, &[]));
                if features.iter().any(|feature| feature.abs() > MOTION * self.limits.scale) {
                    self.learned_s += EACH as f32 / self.rate_hz;
                }
            }
            1 if learn.feedback && since(FEEDBACK_AFTER) => {
                self.feedback.learn(&self.past(&self.answered, 0), -self.free[0].past(0), sigma, forgotten);
            }
            2 if learn.feedback && since(FEEDBACK_AFTER) => {
                let later = libm::ceilf(LATER * self.scale) as usize;
                let [now, before] = [0, later].map(|ticks| self.past(&self.answered, ticks));
                let change = core::array::from_fn(|index| now[index] - before[index]);
                self.feedback.learn(&change, 0.0, sigma / sqrt(MARGIN), forgotten);
            }
            3 if learn.feedback && since(FEEDBACK_AFTER) => {
                self.feedback.learn(&self.past(&self.free, 0), 0.0, sigma / sqrt(EFFORT), forgotten);
            }
            _ => {}
        }
    }

    /// Features of the preview part.
    fn window(&self, signal: impl Fn(i32) -> f32, one: f32) -> [f32; PREVIEW] {
        let present = signal(0);
        core::array::from_fn(|index| self.offsets.get(index).map_or(one, |offset| signal((*offset).into()) - present))
    }

    /// Features of the feedback part, of so many ticks before.
    fn past<const N: usize>(&self, rings: &[Ring<N>; 2], before: usize) -> [f32; FEEDBACK] {
        let derivative = DERIVATIVE * self.scale / self.rate_hz;
        let [value, rate] = rings;
        core::array::from_fn(|index| match self.lags.get(index) {
            Some(lag) => value.past(usize::from(*lag) + before),
            None => derivative * rate.past(self.lags.get(index - LAGS.len()).map_or(0, |lag| usize::from(*lag)) + before),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LIMITS: Limits = Limits { scale: 0.5, correction: 0.5, feedback: 0.3, rate: 20.0 };

    fn learner() -> Learner {
        let response = Response::second_order(1.0, 8.0, 0.7, 0.02, 100.0).unwrap();
        Learner::new(response, 100.0, 0.0, LIMITS).unwrap()
    }

    #[test]
    fn limits_are_positive_numbers() {
        let response = Response::second_order(1.0, 8.0, 0.7, 0.02, 100.0).unwrap();
        for odd in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(Learner::new(response, 100.0, 0.0, Limits { scale: odd, ..LIMITS }).is_none());
            assert!(Learner::new(response, 100.0, 0.0, Limits { correction: odd, ..LIMITS }).is_none());
            assert!(Learner::new(response, 100.0, 0.0, Limits { feedback: odd, ..LIMITS }).is_none());
            assert!(Learner::new(response, 100.0, 0.0, Limits { rate: odd, ..LIMITS }).is_none());
        }
    }

    /// Three axes and what belongs to them are in 10 KB.
    #[test]
    fn three_axes_are_small() {
        assert!(3 * size_of::<Learner>() <= 9 * 1024, "{}", size_of::<Learner>());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]

        #[test]
        fn a_correction_is_within_its_limits_whatever_comes_in(
            signals in prop::collection::vec((
                prop_oneof![4 => any::<[f32; 3]>(), 6 => prop::array::uniform3(-2f32..2.0)], prop::bool::weighted(0.9)
            ), 1..60)
        ) {
            let mut learner = learner();
            learner.start(0.0);
            let mut before = 0.0;
            for tick in 0..600 {
                let at = |tick: i32| signals[tick.rem_euclid(signals.len() as i32) as usize];
                let ([_, value, rate], known) = at(tick);
                let measured = known.then_some(Measured { value, rate });
                let correction = learner.step(|offset| at(tick + offset).0[0], measured, Parts::BOTH, Parts::BOTH);
                prop_assert!(correction.abs() <= LIMITS.correction, "{correction} at {tick}");
                prop_assert!((correction - before).abs() <= 1.001 * LIMITS.rate / 100.0, "{before}, {correction} at {tick}");
                before = correction;
            }
            let Learned { preview, feedback } = learner.learned();
            prop_assert!(preview.iter().chain(&feedback).all(|value| value.is_finite()));
        }
    }
}
