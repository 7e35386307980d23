//! How a learning add-on measures its loop.
//!
//! *in* ticks of a loop that is told to rest; *out* steps of its references, then learners of what was found; *never* steps while
//! the machine moves or is not moved, or a phase that nothing ends; *source* ours.

use super::LearningAddOn;
use crate::learning::{
    axis::{AHEAD, BEHIND},
    state::{Phase, Problem},
    values::Measured,
    work::Work,
};

/// How long commissioning waits for rest, s.
const PATIENCE: f32 = 30.0;
/// Before the steps begin it rests for this share of their time, so that the loop has settled.
const SETTLED: f32 = 0.4;
/// At rest the desired trajectory moves by at most this share of the probe's size.
const REST: f32 = 0.05;

impl<const AXES: usize> LearningAddOn<AXES> {
    /// A tick of commissioning: the steps; `None` as long as it waits for rest and for corrections to end.
    pub(super) fn measure(
        &mut self,
        around: &impl Fn(i32) -> [f32; AXES],
        measured: &[Option<Measured>; AXES],
        goes_on: bool,
        moving: bool,
    ) -> Option<[f32; AXES]> {
        if !moving {
            self.refuse(Problem::Grounded);
            return None;
        }
        let near = |a: &[f32; AXES], b: &[f32; AXES]| {
            let distances = a.iter().zip(b).map(|(a, b)| (a - b).abs());
            // Written so that NaN is no rest.
            self.axes.iter().zip(distances).all(|(axis, distance)| distance <= REST * axis.settings.probe.size)
        };
        let now = around(0);
        let Some(rest) = &self.rest else {
            let calm = [-BEHIND, AHEAD].iter().all(|offset| near(&now, &around(*offset)));
            self.waited = self.waited.saturating_add(1);
            self.calm = if calm && !self.corrects() && goes_on { self.calm.saturating_add(1) } else { 0 };
            let longest = self.axes.iter().fold(0.0f32, |longest, axis| longest.max(axis.settings.probe.seconds));
            if self.calm as f32 > SETTLED * longest * self.rate_hz {
                self.rest = Some(now);
                for (index, axis) in self.axes.iter_mut().enumerate() {
                    axis.measure(usize::from(self.first) + index, self.rate_hz);
                }
                return Some([0.0; AXES]);
            }
            if self.waited as f32 > PATIENCE * self.rate_hz {
                self.refuse(Problem::Moving);
            }
            return None;
        };
        let stepping = self.axes.iter().any(|axis| matches!(&axis.work, Work::Measuring(commission) if commission.steps()));
        let still = near(&now, rest);
        if stepping && !(goes_on && still) {
            self.refuse(if goes_on { Problem::Moving } else { Problem::Gap });
            return None;
        }
        let mut offsets = [0.0; AXES];
        let mut unfit = None;
        let places = offsets.iter_mut().zip(measured).zip(now).enumerate();
        for (axis, (index, ((offset, measured), now))) in self.axes.iter_mut().zip(places) {
            let Work::Measuring(commission) = &mut axis.work else { continue };
            let (asked, outcome) = commission.step(measured.map(|measured| measured.value - now));
            *offset = asked;
            match outcome {
                Some(Ok(response)) => (axis.found, axis.work) = (Some(response), Work::Nothing),
                Some(Err(why)) => unfit = unfit.or(Some(Problem::Unfit { axis: index as u8, why })),
                None => {}
            }
        }
        if let Some(problem) = unfit {
            self.refuse(problem);
        } else if self.axes.iter().all(|axis| axis.found.is_some()) {
            for axis in &mut self.axes {
                axis.settings.response = axis.found;
            }
            self.end_commissioning();
            self.phase = Phase::Learning;
        }
        Some(offsets)
    }

    fn refuse(&mut self, problem: Problem) {
        self.end_commissioning();
        (self.failed, self.problem) = (true, problem);
    }

    /// The phase before, with the responses that were known; what was learned is lost where the steps had begun.
    pub(super) fn end_commissioning(&mut self) {
        if self.phase != Phase::Commissioning {
            return;
        }
        if self.rest.take().is_some() {
            let (rate_hz, age_s) = (self.rate_hz, self.age_s);
            for axis in &mut self.axes {
                axis.found = None;
                axis.begin(axis.settings.response, rate_hz, age_s);
            }
            self.last = None;
        }
        let known = self.axes.iter().all(|axis| axis.learner().is_some());
        self.phase = if known { self.before } else { Phase::Off };
    }
}
