//! What works on an axis of a learning add-on: nothing, the measurement of its response, or its learner.
//!
//! *in* settings and a response; *out* the one that works; *never* two at once: they share their memory; *source* ours.

use super::{axis::Learner, commission::Commission, response::Response, state::AxisSettings};

/// What works on an axis.
#[derive(Clone, Debug)]
// There is no heap, and the larger one is what an axis needs most of the time.
#[allow(clippy::large_enum_variant)]
// Nothing is 0, so that a static without learners is all zeros.
#[repr(u8)]
pub(super) enum Work {
    Nothing,
    Measuring(Commission),
    Learning(Learner),
}

#[derive(Clone, Debug)]
pub(super) struct Axis {
    pub(super) settings: AxisSettings,
    pub(super) work: Work,
    /// Measured before the others are.
    pub(super) found: Option<Response>,
}

impl Axis {
    /// Of which nothing is known.
    pub(super) const NONE: Self = Self { settings: AxisSettings::NONE, work: Work::Nothing, found: None };

    pub(super) fn learner(&self) -> Option<&Learner> {
        if let Work::Learning(learner) = &self.work { Some(learner) } else { None }
    }

    pub(super) fn learner_mut(&mut self) -> Option<&mut Learner> {
        if let Work::Learning(learner) = &mut self.work { Some(learner) } else { None }
    }

    /// Measures its response.
    // As `begin`.
    #[inline(never)]
    pub(super) fn measure(&mut self, number: usize, rate_hz: f32) {
        self.found = None;
        self.work = Commission::new(number, self.settings.probe, rate_hz, self.settings.response.as_ref())
            .map_or(Work::Nothing, Work::Measuring);
    }

    /// A learner of this response that has learned nothing.
    // Apart, as it is large, and on the stack before it is where it belongs: in no other tick than this one.
    #[inline(never)]
    pub(super) fn begin(&mut self, response: Option<Response>, rate_hz: f32, age_s: f32) {
        let learner = response.and_then(|response| Learner::new(response, rate_hz, age_s, self.settings.limits));
        self.work = learner.map_or(Work::Nothing, Work::Learning);
    }
}
