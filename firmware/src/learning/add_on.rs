//! The add-on of a loop that has no model: measures how each axis answers, learns, and holds what it has learned.
//!
//! *in* the desired trajectory and what is measured, tick by tick; *out* the correction of each axis's reference; *never* more
//! than its limits, a jump, or anything while the loop does not move the machine; *source* ours.
//!
//! | phase | learns | corrects | |
//! |---|---|---|---|
//! | off | no | no | |
//! | commissioning | no | steps of the stated size | waits for rest; then learning, or the phase before and a [`Problem`] |
//! | learning | yes | yes | |
//! | holding | no | yes | |

mod commissioning;

use super::{
    axis::{AHEAD, BEHIND, Learner},
    commission::Unfit,
    kept::{Kept, NotKept},
    response::Response,
    state::{AxisSettings, Phase, Problem, Progress},
    values::{Learned, Measured, Parts},
    work::{Axis, Work},
};

/// Learns the corrections of a loop with so many axes.
#[derive(Clone, Debug)]
pub struct LearningAddOn<const AXES: usize> {
    axes: [Axis; AXES],
    rate_hz: f32,
    age_s: f32,
    phase: Phase,
    /// Before commissioning.
    before: Phase,
    parts: [Parts; 2],
    /// Number of the first axis.
    first: u8,
    last: Option<i32>,
    /// Ticks that commissioning has waited, and the last of them at rest.
    waited: u32,
    calm: u32,
    /// Where the trajectory rests while responses are measured.
    rest: Option<[f32; AXES]>,
    /// Whether the problem is one. Not an option, which would not be all zeros.
    failed: bool,
    problem: Problem,
}

impl<const AXES: usize> LearningAddOn<AXES> {
    /// Of a loop that nobody has told of yet: it is off, and [configured](Self::configure) where it lies, since it is large. All
    /// zeros, so that a static with it takes no flash.
    pub const fn empty() -> Self {
        Self {
            axes: [const { Axis::NONE }; AXES],
            rate_hz: 0.0,
            age_s: 0.0,
            phase: Phase::Off,
            before: Phase::Off,
            parts: [Parts::NONE; 2],
            first: 0,
            last: None,
            waited: 0,
            calm: 0,
            rest: None,
            failed: false,
            // All zeros, which the first variant is not.
            problem: Problem::Unfit { axis: 0, why: Unfit::Missing },
        }
    }

    /// Nothing learned yet, and off. The learner runs at `rate_hz`; measurements are `age_s` old when they arrive. `None` if
    /// there is no axis, or a limit, a probe, the rate or the age is none that a loop has.
    pub fn new(axes: &[AxisSettings; AXES], rate_hz: f32, age_s: f32) -> Option<Self> {
        let mut new = Self::empty();
        new.configure(axes, rate_hz, age_s).then_some(new)
    }

    /// [`LearningAddOn::new`] in place: what was learned is lost; the first axis's number stays. `false`, and nothing changes,
    /// where that gives `None`.
    pub fn configure(&mut self, axes: &[AxisSettings; AXES], rate_hz: f32, age_s: f32) -> bool {
        let sane = (1.0..=1e5).contains(&rate_hz) && (0.0..=1.0).contains(&age_s) && AXES > 0 && AXES < 256;
        let known = |axis: &AxisSettings| {
            axis.limits.are_sane() && axis.probe.is_sane(rate_hz) && axis.probe.size <= axis.limits.correction
        };
        if !(sane && axes.iter().all(known)) {
            return false;
        }
        (self.rate_hz, self.age_s) = (rate_hz, age_s);
        for (axis, settings) in self.axes.iter_mut().zip(axes) {
            (axis.settings, axis.found) = (*settings, None);
            axis.begin(settings.response, rate_hz, age_s);
        }
        (self.phase, self.last, self.rest, self.failed) = (Phase::Off, None, None, false);
        self.parts = [Parts::BOTH; 2];
        true
    }

    /// Which parts learn, and which act, in the phases in which they do; both from the start.
    pub fn switch(&mut self, learn: Parts, act: Parts) {
        self.parts = [learn, act];
    }

    /// States which axes of a machine these are, from `first` on: the steps of each differ, so that add-ons of several axes
    /// can be commissioned at once. From 0 on from the start.
    pub fn number(&mut self, first: u8) {
        self.first = first;
    }

    /// Measures the responses as soon as the trajectory rests, then learns from nothing.
    pub fn commission(&mut self) {
        if self.phase != Phase::Commissioning {
            (self.before, self.phase) = (self.phase, Phase::Commissioning);
            (self.waited, self.calm, self.rest, self.failed) = (0, 0, None, false);
        }
    }

    /// Learns and corrects.
    ///
    /// # Errors
    /// The first axis whose response is not known; then nothing changes.
    pub fn learn(&mut self) -> Result<(), Problem> {
        self.go(Phase::Learning)
    }

    /// Corrects by what it has learned, and learns no more.
    ///
    /// # Errors
    /// The first axis whose response is not known; then nothing changes.
    pub fn hold(&mut self) -> Result<(), Problem> {
        self.go(Phase::Holding)
    }

    fn go(&mut self, phase: Phase) -> Result<(), Problem> {
        self.end_commissioning();
        match self.axes.iter().position(|axis| axis.learner().is_none()) {
            Some(axis) => Err(Problem::Unknown { axis: axis as u8 }),
            None => {
                (self.phase, self.failed) = (phase, false);
                Ok(())
            }
        }
    }

    /// Neither learns nor corrects; the correction goes back to nothing by its rate limit. What was learned stays.
    pub fn stop(&mut self) {
        self.end_commissioning();
        self.phase = Phase::Off;
    }

    /// Forgets what was learned, not how the loop answers.
    pub fn forget(&mut self) {
        self.axes.iter_mut().filter_map(Axis::learner_mut).for_each(Learner::forget);
    }

    /// Another motion, from rest: what was learned stays.
    pub fn restart(&mut self) {
        self.axes.iter_mut().filter_map(Axis::learner_mut).for_each(Learner::release);
        self.last = None;
    }

    /// What a correction of an axis may be from now on, within its limits.
    pub fn bound(&mut self, axis: usize, low: f32, high: f32) {
        if let Some(learner) = self.axes.get_mut(axis).and_then(Axis::learner_mut) {
            learner.bound(low, high);
        }
    }

    /// States, before a tick, what another feedback corrected of an axis in the last one, as the feedback lane of a model
    /// ([`crate::adapter::Adapter::fed_back`]). Responses are to be measured without it.
    pub fn tell_other(&mut self, axis: usize, correction: f32) {
        if let Some(learner) = self.axes.get_mut(axis).and_then(Axis::learner_mut) {
            learner.tell_other(correction);
        }
    }

    /// Rate of the learner, Hz.
    pub fn rate_hz(&self) -> f32 {
        self.rate_hz
    }

    /// What was learned of an axis.
    pub fn learned(&self, axis: usize) -> Option<Learned> {
        self.axes.get(axis)?.learner().map(Learner::learned)
    }

    /// How an axis answers, if it is known.
    pub fn response(&self, axis: usize) -> Option<Response> {
        self.axes.get(axis)?.learner().map(|learner| *learner.response())
    }

    /// What it does.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// How far it is.
    pub fn progress(&self) -> Progress {
        let learners = || self.axes.iter().filter_map(Axis::learner);
        let known = learners().count() == AXES;
        let least = |of: fn(&Learner) -> f32| if known { learners().map(of).fold(f32::MAX, f32::min) } else { 0.0 };
        let measured = self.axes.iter().map(|axis| match &axis.work {
            Work::Measuring(commission) => commission.progress(),
            Work::Learning(_) => 1.0,
            Work::Nothing => f32::from(u8::from(axis.found.is_some())),
        });
        Progress {
            phase: self.phase,
            commissioned: if self.phase == Phase::Commissioning && self.rest.is_none() {
                0.0
            } else {
                measured.fold(1.0, f32::min)
            },
            learned_s: least(Learner::learned_s),
            share: least(Learner::share),
            forgotten: learners().fold(0, |sum: u16, learner| sum.saturating_add(learner.forgotten())),
            problem: self.failed.then_some(self.problem),
        }
    }

    /// Writes what was learned to the start of `bytes`, [`Kept::length`] of them, for a loop with this
    /// [identity](super::identity). `None` if a response is not known yet, or it does not fit.
    pub fn keep<'b>(&self, identity: u32, bytes: &'b mut [u8]) -> Option<&'b [u8]> {
        if self.axes.iter().any(|axis| axis.learner().is_none()) {
            return None;
        }
        Kept::write(bytes, identity, self.rate_hz, AXES, self.axes.iter().filter_map(Axis::learner).map(Learner::kept))
    }

    /// Goes on with what was kept: with its responses, and what was learned, in the phase in which it is.
    ///
    /// # Errors
    /// If nothing was kept there, or it is damaged or of another loop; then nothing changes.
    pub fn recall(&mut self, identity: u32, bytes: &[u8]) -> Result<(), NotKept> {
        let kept = Kept::read(bytes)?;
        if usize::from(kept.count()) != AXES {
            return Err(NotKept::Axes { found: kept.count() });
        }
        if kept.identity != identity || kept.rate_hz != self.rate_hz {
            return Err(NotKept::Other);
        }
        if self.phase == Phase::Commissioning {
            return Err(NotKept::Busy);
        }
        let moved = self.corrects();
        for (axis, kept) in self.axes.iter_mut().zip(kept.axes()) {
            // A correction on its way must not jump: then only what was learned is another one.
            if !moved || axis.learner().is_none() {
                axis.begin(Some(kept.response), self.rate_hz, self.age_s);
            }
            if let Some(learner) = axis.learner_mut() {
                learner.recall(&kept);
            }
        }
        if !moved {
            self.last = None;
        }
        Ok(())
    }

    /// The correction of the last tick.
    pub fn correction(&self) -> [f32; AXES] {
        core::array::from_fn(|axis| self.axes.get(axis).and_then(Axis::learner).map_or(0.0, Learner::correction))
    }

    /// Whether it is off, and nothing is left of a correction.
    pub fn is_idle(&self) -> bool {
        self.phase == Phase::Off && !self.corrects()
    }

    fn corrects(&self) -> bool {
        self.correction().iter().any(|correction| *correction != 0.0)
    }

    /// A tick: `desired` gives the trajectory at a tick, from 31 before to 80 after this one ([`BEHIND`], [`AHEAD`]);
    /// `measured` is `None` where a sample is missing or not to be trusted; `moving` says whether the loop moves the machine.
    /// Returns the correction of each reference. After a gap, and where the machine is not moved, it begins anew at rest.
    pub fn step(
        &mut self,
        tick: i32,
        desired: impl Fn(i32) -> [f32; AXES],
        measured: &[Option<Measured>; AXES],
        moving: bool,
    ) -> [f32; AXES] {
        if self.is_idle() {
            // It costs nothing, and when it is told to learn it begins as after a gap.
            self.last = None;
            return [0.0; AXES];
        }
        let goes_on = self.last.is_some_and(|last| last.wrapping_add(1) == tick) && moving;
        self.last = Some(tick);
        let around = |offset: i32| desired(tick.wrapping_add(offset));
        if self.phase == Phase::Commissioning
            && let Some(offsets) = self.measure(&around, measured, goes_on, moving)
        {
            return offsets;
        }
        let [learn, act] = match self.phase {
            _ if !moving => [Parts::NONE; 2],
            Phase::Learning => self.parts,
            Phase::Holding => [Parts::NONE, self.parts[1]],
            Phase::Off | Phase::Commissioning => [Parts::NONE; 2],
        };
        let mut corrections = [0.0; AXES];
        let places = corrections.iter_mut().zip(measured).enumerate();
        for (axis, (index, (correction, measured))) in self.axes.iter_mut().zip(places) {
            let Some(learner) = axis.learner_mut() else { continue };
            let desired = |offset: i32| around(offset.clamp(-BEHIND - 1, AHEAD)).get(index).copied().unwrap_or(0.0);
            if !moving {
                learner.release();
            }
            if !goes_on {
                learner.start(desired(0));
            }
            *correction = learner.step(desired, *measured, learn, act);
        }
        corrections
    }
}

#[cfg(test)]
mod tests;
