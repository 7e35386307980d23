//! A vehicle that learns: what it is told, and what it has learned.
//!
//! *in* orders; *out* progress, and what was learned, piece by piece; *never* an order that is taken for done before the vehicle
//! says so.

use impromptu_flight::link::{
    Command,
    message::{LearnOrder, LearningReport},
};

use crate::{
    board::{ATTEMPTS, Board},
    error::PilError,
    line::Line,
};

/// An order to the learner, and a question for what it has learned.
const ORDER: &str = "an order to learn";
const LEARNED: &str = "a question for what was learned";

impl<L: Line> Board<L> {
    /// How far the learner is, as it last told, if there is one.
    pub fn learning(&self) -> Option<&LearningReport> {
        self.learning.as_ref()
    }

    /// Tells the learner what to do, and waits until it is done.
    ///
    /// # Errors
    /// If the firmware refuses.
    pub fn learn(&mut self, order: LearnOrder) -> Result<(), PilError> {
        self.tell(ORDER, &Command::Learn(order));
        self.talk_until(|board| board.awaited.is_empty());
        self.refused()?;
        if self.awaited.is_empty() { Ok(()) } else { Err(PilError::Silence(ORDER)) }
    }

    /// What was learned, as [`impromptu_firmware::learning::Kept`] reads it.
    ///
    /// # Errors
    /// If the firmware refuses, as in flight, or does not answer.
    pub fn learned(&mut self) -> Result<Vec<u8>, PilError> {
        self.learned = (Vec::new(), usize::MAX);
        for _ in 0..ATTEMPTS {
            let known = self.learned.0.len();
            if known >= self.learned.1 {
                return Ok(std::mem::take(&mut self.learned.0));
            }
            self.tell(LEARNED, &Command::Learned { offset: known as u32 });
            self.talk(|board| board.learned.0.len() > known || !board.refusals.is_empty());
            self.awaited.retain(|(_, name)| *name != LEARNED);
            self.refused()?;
        }
        Err(PilError::Silence(LEARNED))
    }
}
