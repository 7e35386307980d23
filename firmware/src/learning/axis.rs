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
//! Offsets and lags are those of a loop that answers a slow correction 50 ticks late (half a second at 100 Hz); of a faster
//! one they are shorter in proportion. What is learned is one row a tick: preview, feedback, margin, effort; in the fifth the
//! preview part is doubted.

mod memory;
mod rows;

use super::{
    judge::Judge,
    least_squares::{LeastSquares, above},
    response::{Answer, Filter, Response},
    ring::Ring,
    swing::Swing,
    values::{FEEDBACK, LAGS, Learned, Limits, Measured, OFFSETS, PREVIEW, Parts, lags, offsets, scale},
};
use crate::math::clamp;

/// Ticks that the learner looks behind and ahead.
pub const BEHIND: i32 = 31;
/// See [`BEHIND`].
pub const AHEAD: i32 = 80;

/// Ticks of a second, and the lag in ticks of the loop to whose seconds times are stated.
const PACE: f32 = 100.0;
const PACE_LAG: f32 = 50.0;
/// Ticks that the margin rows look behind.
const LATER: f32 = 4.0;
/// Time constant of the derivative of a loop that does not measure one, in rad of its natural frequency.
pub const SMOOTHING: f32 = 0.2;
/// Past values that the lags, and lags before [`LATER`], need.
const FREE: usize = 51;
const ANSWERED: usize = FREE + LATER as usize;

/// Standard deviations of the weights before anything was learned.
const PRIOR: f32 = 1.0;
/// Of the constant, in scales of the axis.
const CONSTANT_PRIOR: f32 = 0.3;
/// Error that does not matter, in scales of the axis.
const FLOOR: f32 = 0.02;
/// A swing that does not matter, in scales of the axis.
const SWUNG: f32 = 0.01;
/// A sample whose error jumps by more, in scales of the axis, is an outlier; after so many it is none.
const JUMP: f32 = 0.2;
const OUTLIERS: u32 = 5;
/// The feedback part acts on what it knew last for this time, s.
const HELD: f32 = 0.3;
/// A part acts with a share that grows with the time in motion that it has learned from, s: least squares that have seen a second
/// of a motion are surer of themselves than they may be.
const PREVIEW_TIME: f32 = 2.8;
const FEEDBACK_TIME: f32 = 5.0;
/// How many times the variance of what it asks for the preview part doubts: a motion unlike those that it has learned from.
const DOUBT: f32 = 6.0;
/// Where the desired motion bends by more within a tick, in scales of the axis, and by more than it moved in any of the ticks
/// before, it jumps. No machine follows a jump, and no map of what is ahead should make it set out before: until the window has
/// none, the constant is all of the preview part.
const BEND: f32 = 0.1;
const BEFORE: i32 = 7;

/// Ticks from one row of a kind to the next.
const EACH: u32 = 5;

/// Learns both parts of one axis.
#[derive(Clone, Debug)]
pub struct Learner {
    response: Response,
    limits: Limits,
    rate_hz: f32,
    /// Ticks of a second of the loop's own: those of a loop with a lag of half a second, to which the times are stated.
    pace: f32,
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
    /// What another feedback corrects, and whether there is one.
    other: Answer,
    helped: bool,
    /// What the loop would make of the desired trajectory, from [`AHEAD`] ticks ahead to [`BEHIND`] behind.
    ahead: Filter,
    filtered: Ring<{ (AHEAD + BEHIND) as usize + 1 }>,
    /// The error without the feedback part and its derivative, and what the loop makes of them.
    free: [Ring<FREE>; 2],
    answers: [Filter; 2],
    answered: [Ring<ANSWERED>; 2],
    /// The last error and its derivative, where none is measured.
    derived: [f32; 2],
    judge: Judge,
    /// Of the feedback part.
    swing: Swing,
    /// Ticks without a measurement, and the last error.
    missing: u32,
    last: f32,
    /// Ticks for which the desired motion has a jump within the window.
    jumped: u32,
    /// What is possible now.
    room: [f32; 2],
    /// Share of what the preview part asks for that is not doubted.
    trust: f32,
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
        if !limits.are_sane() {
            return None;
        }
        let mut preview = [PRIOR; PREVIEW];
        preview[PREVIEW - 1] = CONSTANT_PRIOR * limits.scale;
        let scale = scale(&response);
        Some(Self {
            response,
            limits,
            rate_hz,
            pace: clamp(response.lag() * PACE / PACE_LAG, 0.04 * rate_hz, 4.0 * rate_hz),
            delay: clamp(delay_s * rate_hz, 0.0, (BEHIND - 2) as f32),
            offsets: offsets(&response),
            lags: lags(&response),
            scale,
            preview: LeastSquares::new(&preview),
            feedback: LeastSquares::new(&[PRIOR; FEEDBACK]),
            all: Answer::new(),
            fed: Answer::new(),
            other: Answer::new(),
            helped: false,
            ahead: Filter::default(),
            filtered: Ring::filled(0.0),
            free: [Ring::filled(0.0), Ring::filled(0.0)],
            answers: [Filter::default(); 2],
            answered: [Ring::filled(0.0), Ring::filled(0.0)],
            derived: [0.0; 2],
            judge: Judge::default(),
            swing: Swing::new(),
            missing: 0,
            last: 0.0,
            jumped: 0,
            room: [-limits.correction, limits.correction],
            trust: 0.0,
            learned_s: 0.0,
            noise: 0.0,
            correction: 0.0,
            ticks: 0,
            forgotten: 0,
        })
    }

    /// The loop has rested where it is desired to be for long, with the correction of the last tick: histories begin anew,
    /// what was learned stays.
    pub fn start(&mut self, desired: f32) {
        (self.all, self.fed, self.ticks) = (Answer::at_rest(&self.response, self.correction), Answer::new(), 0);
        (self.other, self.helped) = (Answer::new(), false);
        self.ahead = Filter::at_rest(&self.response, desired);
        self.filtered = Ring::filled(self.response.gain() * desired);
        self.free = [Ring::filled(0.0), Ring::filled(0.0)];
        self.answered = [Ring::filled(0.0), Ring::filled(0.0)];
        self.answers = [Filter::default(); 2];
        self.derived = [0.0; 2];
        self.judge.start();
        self.swing.start();
        (self.missing, self.last) = (OUTLIERS, 0.0);
    }

    /// The reference is the desired one again, whatever the correction was: as of a machine that is not moved.
    pub fn release(&mut self) {
        self.correction = 0.0;
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

    /// Time in motion that was learned from, s.
    pub fn learned_s(&self) -> f32 {
        self.learned_s
    }

    /// The response that it goes by.
    pub fn response(&self) -> &Response {
        &self.response
    }

    /// The correction of the last tick.
    pub fn correction(&self) -> f32 {
        self.correction
    }

    /// Share of the correction that acts, 0..1: less than 1 at the start, and where it does not help.
    pub fn share(&self) -> f32 {
        self.judge.share()
    }

    /// How often what was learned was forgotten because it did harm.
    pub fn forgotten(&self) -> u16 {
        self.forgotten
    }

    /// States what another feedback corrected in the last tick, as the feedback lane of a model: it is no part of how the loop
    /// answers, and without it the preview part would take what it resists for what is still missing.
    pub fn tell_other(&mut self, correction: f32) {
        if self.helped || correction != 0.0 {
            self.helped = true;
            self.other.inputs.push(correction);
        }
    }

    /// A tick: `desired` gives the trajectory at an offset of so many ticks, from -[`BEHIND`] to [`AHEAD`]; `measured` is `None`
    /// where a sample is missing or not to be trusted. Returns the correction of the reference.
    pub fn step(&mut self, desired: impl Fn(i32) -> f32, measured: Option<Measured>, learn: Parts, act: Parts) -> f32 {
        let delay = self.response.delay() as i32;
        // The whole window of what the loop makes of the desired trajectory, one tick further.
        let newest = self.ahead.step(&self.response, desired(AHEAD - 1 - delay));
        self.look(&desired);
        self.filtered.push(newest);
        let all = self.all.at(&self.response);
        let fed = self.fed.at(&self.response);
        let other = if self.helped { self.other.at(&self.response) } else { 0.0 };
        for (answer, (ring, free)) in self.answers.iter_mut().zip(self.answered.iter_mut().zip(&self.free)) {
            ring.push(answer.step(&self.response, free.past(self.response.delay())));
        }
        // The slope of a jump is none of a motion.
        let moves = !self.jumps(-3 - self.delay as i32, 2);
        let errors = measured.filter(|measured| moves && measured.is_finite()).map(|measured| self.error(&desired, measured));
        match errors.filter(|[error, _]| self.is_near(*error)) {
            Some([error, error_rate]) => {
                self.missing = 0;
                self.last = error;
                self.free[0].push(error - fed);
                self.free[1].push(error_rate - self.fed.filter.change() * self.rate_hz);
                self.learn(learn, all + other - error);
                self.swing.tell(error, fed, SWUNG * self.limits.scale, self.pace);
                if self.judge.tell(error, error - all, FLOOR * self.limits.scale, self.pace) {
                    self.forget();
                    self.forgotten = self.forgotten.saturating_add(1);
                }
            }
            // The disturbance is what it was, for some time.
            None => {
                self.missing = self.missing.saturating_add(1);
                self.free.iter_mut().for_each(|ring| ring.push(ring.past(0)));
            }
        }
        let share = self.judge.share();
        let Limits { correction: most, feedback: fed_most, rate, .. } = self.limits;
        let learned = |time: f32| clamp(self.learned_s * self.rate_hz / (time * self.pace), 0.0, 1.0);
        let preview = if act.preview {
            let mut features = self.window(&desired, 1.0);
            let [first, .., last] = self.offsets;
            if self.jumps(i32::from(first), i32::from(last)) {
                features.iter_mut().take(OFFSETS.len()).for_each(|feature| *feature = 0.0);
            }
            let asked = self.preview.dot(&features);
            if self.ticks % EACH == EACH - 1 {
                let square = asked * asked;
                self.trust = square / (square + DOUBT * self.preview.variance(&features)).max(f32::MIN_POSITIVE);
            }
            learned(PREVIEW_TIME) * self.trust * asked
        } else {
            0.0
        };
        let known = self.missing as f32 <= HELD * self.rate_hz;
        let feedback = if act.feedback && known {
            self.swing.share() * learned(FEEDBACK_TIME) * self.feedback.dot(&self.past(&self.free, 0))
        } else {
            0.0
        };
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

    /// Looks for a jump at the end of the window.
    fn look(&mut self, desired: &impl Fn(i32) -> f32) {
        let end = |before: i32| desired(AHEAD - 1 - before);
        let bend = (end(0) - 2.0 * end(1) + end(2)).abs();
        let fastest = || (1..=BEFORE).fold(0.0f32, |most, before| most.max((end(before) - end(before + 1)).abs()));
        // Written so that NaN is a jump.
        let smooth = bend <= BEND * self.limits.scale || bend <= fastest();
        self.jumped = if smooth { self.jumped.saturating_sub(1) } else { (AHEAD + BEHIND) as u32 };
    }

    /// Whether the last jump of what is desired is this many ticks ahead, or behind.
    fn jumps(&self, from: i32, to: i32) -> bool {
        self.jumped > 0 && (from..=to).contains(&(self.jumped as i32 - BEHIND - 1))
    }

    /// Whether an error may follow the last one: one that jumps is an outlier, until it stays.
    fn is_near(&self, error: f32) -> bool {
        (error - self.last).abs() <= JUMP * self.limits.scale || self.missing >= OUTLIERS
    }
}

#[cfg(test)]
mod tests;
