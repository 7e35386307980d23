//! What learns the corrections of an axis, and the trajectory ahead of it.
//!
//! *in* desired and measured numbers; *out* the correction; *never* other bits than those of a [`LearningAddOn`] of one axis;
//! *source* [`impromptu_firmware::learning`].

use impromptu_firmware::{
    learning::{
        AHEAD, AxisSettings, BEHIND, LearningAddOn, Limits, Measured, NotKept, Phase, Probe, Problem, Progress, Response, Unfit,
    },
    preview::{EndRule, Preview},
};

use crate::{
    status::Status,
    values::{LearnerProblem, LearnerReport, LearnerSettings},
};

/// Samples of the trajectory: those that are looked at, and room to push some at once.
const SAMPLES: usize = 128;
const _: () = assert!((AHEAD + BEHIND) as usize + 2 < SAMPLES);

/// An axis.
#[derive(Debug)]
pub struct Learning {
    pub(crate) add_on: LearningAddOn<1>,
    preview: Preview<1, SAMPLES>,
    /// The last reference tick.
    last: Option<i32>,
    identity: u32,
}

impl Learning {
    /// Of no loop yet.
    pub const EMPTY: Self =
        Self { add_on: LearningAddOn::empty(), preview: Preview::new([EndRule::Hold], 0), last: None, identity: 0 };

    /// Takes these settings, in place, since it is large.
    ///
    /// # Errors
    /// If a number is none that a loop has.
    pub fn configure(&mut self, settings: &LearnerSettings, first_tick: i32) -> Result<(), Status> {
        let LearnerSettings { rate_hz, age_s, gain, frequency, damping, delay_s, .. } = *settings;
        let response = match gain == 0.0 {
            true => None,
            false => Some(Response::second_order(gain, frequency, damping, delay_s, rate_hz).ok_or(Status::Settings)?),
        };
        let limits =
            Limits { scale: settings.scale, correction: settings.correction, feedback: settings.feedback, rate: settings.rate };
        let probe = Probe { size: settings.probe_size, seconds: settings.probe_s };
        if !self.add_on.configure(&[AxisSettings { response, limits, probe }], rate_hz, age_s) {
            return Err(Status::Settings);
        }
        self.add_on.number(settings.axis as u8);
        self.preview.clear(first_tick);
        self.identity = settings.identity;
        Ok(())
    }

    /// Appends what is desired at the next tick.
    ///
    /// # Errors
    /// If it is not a number, or as many samples as are kept lie ahead.
    pub fn push(&mut self, desired: f32) -> Result<(), Status> {
        if !desired.is_finite() {
            return Err(Status::NotFinite);
        }
        if self.preview.is_ahead_full(self.last, BEHIND + 1) {
            return Err(Status::Full);
        }
        self.preview.push([desired]);
        Ok(())
    }

    /// Forgets what is desired, for another trajectory whose next sample is that of this tick.
    pub fn clear(&mut self, first_tick: i32) {
        self.preview.clear(first_tick);
    }

    /// Forgets what is desired at this tick and later.
    pub fn truncate(&mut self, from: i32) {
        self.preview.truncate(from);
    }

    /// A tick: the correction, and what was missing.
    pub fn step(&mut self, tick: i32, measured: f32, rate: f32, moving: bool) -> (f32, Result<(), Status>) {
        self.last = Some(tick);
        let rate = Some(rate).filter(|rate| rate.is_finite());
        let measured = Some(Measured { value: measured, rate }).filter(|measured| measured.value.is_finite());
        let Self { add_on, preview, .. } = self;
        let [correction] = add_on.step(tick, |tick| preview.sample(tick), &[measured], moving && !preview.is_empty());
        let missing = if preview.is_empty() { Err(Status::NoTrajectory) } else { measured.map(|_| ()).ok_or(Status::BadSample) };
        (correction, missing)
    }

    /// Writes what was learned: how many bytes.
    ///
    /// # Errors
    /// If nothing is known yet, or it does not fit.
    pub fn keep(&self, bytes: &mut [u8]) -> Result<usize, Status> {
        self.add_on.keep(self.identity, bytes).map(<[u8]>::len).ok_or(Status::NotKept)
    }

    /// Goes on with what was kept.
    ///
    /// # Errors
    /// If there is nothing, or it is of another loop.
    pub fn recall(&mut self, bytes: &[u8]) -> Result<(), Status> {
        Ok(self.add_on.recall(self.identity, bytes)?)
    }

    /// How far it is.
    pub fn report(&self) -> LearnerReport {
        let Progress { phase, commissioned, learned_s, share, forgotten, problem } = self.add_on.progress();
        let [correction] = self.add_on.correction();
        let [gain, frequency, lag] = match self.add_on.response(0) {
            Some(response) => {
                let rate = self.add_on.rate_hz();
                [response.gain(), response.turn() * rate, response.lag() / rate]
            }
            None => [0.0; 3],
        };
        LearnerReport {
            phase: match phase {
                Phase::Off => 0,
                Phase::Commissioning => 1,
                Phase::Learning => 2,
                Phase::Holding => 3,
            },
            problem: problem.map_or(LearnerProblem::None, Into::into) as u32,
            commissioned,
            learned_s,
            share,
            forgotten: forgotten.into(),
            correction,
            gain,
            frequency,
            lag_s: lag,
            reach: self.last.map_or(0, |last| self.preview.reach(last)),
        }
    }
}

impl From<Problem> for LearnerProblem {
    fn from(problem: Problem) -> Self {
        match problem {
            Problem::Unknown { .. } => Self::Unknown,
            Problem::Grounded => Self::Grounded,
            Problem::Moving => Self::Moving,
            Problem::Gap => Self::Gap,
            Problem::Unfit { why, .. } => match why {
                Unfit::Missing => Self::Missing,
                Unfit::Noisy => Self::Noisy,
                Unfit::Gain => Self::Gain,
                Unfit::Opposite => Self::Opposite,
                _ => Self::Speed,
            },
            _ => Self::Other,
        }
    }
}

impl From<Problem> for Status {
    fn from(problem: Problem) -> Self {
        match problem {
            Problem::Unknown { .. } => Self::Unknown,
            _ => Self::Refused,
        }
    }
}

impl From<NotKept> for Status {
    fn from(reason: NotKept) -> Self {
        match reason {
            NotKept::Axes { .. } | NotKept::Other => Self::Other,
            NotKept::Busy => Self::Busy,
            _ => Self::NotKept,
        }
    }
}
