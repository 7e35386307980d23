//! What is said of learning.
//!
//! *in/out* plain values; *never* a number that the receiver refuses; *source* [`impromptu_firmware::learning`].

use impromptu_firmware::{
    learning::{Phase, Problem, Progress},
    math::finite_or_zero,
};
use serde::{Deserialize, Serialize};

/// What a vehicle that learns is told. New ones come last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum LearnOrder {
    /// Measure how the loop answers, as soon as it hovers, then learn from nothing. Meanwhile no lane of a model acts.
    Commission,
    /// Learn and correct.
    Learn,
    /// Correct by what was learned, and learn no more.
    Hold,
    /// Neither; what was learned stays.
    Stop,
    /// Forget what was learned, not how the loop answers.
    Forget,
    /// Put what was learned into the flash, whence it comes back when the power does. Not while armed.
    Keep,
}

/// How far a vehicle that learns is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LearningReport {
    /// What it does.
    pub phase: Phase,
    /// Whether it goes on with what was kept in the flash before the start.
    pub recalled: bool,
    /// Of commissioning, 0..=1.
    pub commissioned: f32,
    /// Seconds in motion learned from, of the axis with the least.
    pub learned_s: f32,
    /// Share of the correction that acts, 0..=1, of the axis with the least.
    pub share: f32,
    /// How often what was learned was forgotten because it did harm.
    pub forgotten: u16,
    /// The offset of the position reference now, m, world ENU.
    pub correction: [f32; 3],
    /// What went wrong last.
    pub problem: Option<Problem>,
}

impl LearningReport {
    /// Of a learner.
    pub fn new(progress: &Progress, recalled: bool, correction: [f32; 3]) -> Self {
        let Progress { phase, commissioned, learned_s, share, forgotten, problem } = *progress;
        let [commissioned, learned_s, share] = [commissioned, learned_s, share].map(finite_or_zero);
        let correction = correction.map(finite_or_zero);
        Self { phase, recalled, commissioned, learned_s, share, forgotten, correction, problem }
    }
}

/// A piece of what was learned, as [`impromptu_firmware::learning::Kept`] writes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LearnedPiece<'a> {
    /// Length of the whole.
    pub length: u32,
    /// Where the piece belongs, bytes from the start.
    pub offset: u32,
    /// At most [`crate::link::CHUNK`] bytes.
    pub bytes: &'a [u8],
}
