//! What a vehicle learns with, if its board gives it that.
//!
//! *in* orders of the link, and each control tick; *out* offsets of the position reference, progress, what was learned; *never* a
//! byte or an instruction of a vehicle that learns nothing; *source* [`crate::learning`].

use impromptu_firmware::learning::{NotKept, Phase, Problem};

use super::Autopilot;
use crate::{
    flight::{Flight, Settings},
    learning::{FlightLearning, Guess, KEPT, POSITION_AGE_S},
    link::{
        Reason,
        message::{LearnOrder, LearningReport},
    },
    types::{State, Tick},
};

/// What an autopilot learns with: [`NoLearner`] or a [`FlightLearner`]. What a method does not do, a vehicle cannot.
pub trait Learns {
    /// It flies with these settings from now on.
    fn configure(&mut self, settings: &Settings) {
        let _ = settings;
    }

    /// A position came.
    fn hear(&mut self) {}

    /// The flight has ended.
    fn land(&mut self) {}

    /// Does what it is told, but for [`LearnOrder::Keep`], which is the board's affair.
    ///
    /// # Errors
    /// If it cannot.
    fn order(&mut self, order: LearnOrder) -> Result<(), Reason> {
        let _ = order;
        Err(Reason::NoLearner)
    }

    /// Before a control tick, with the state that the flight stack will get.
    fn step(&mut self, flight: &mut Flight<'_>, tick: Tick, state: &State) {
        let _ = (flight, tick, state);
    }

    /// Goes on with what was kept beside the model with this check sum.
    ///
    /// # Errors
    /// If it is not of this loop and model, or nothing; then nothing changes.
    fn recall(&mut self, model: Option<u32>, bytes: &[u8]) -> Result<(), NotKept> {
        let _ = (model, bytes);
        Err(NotKept::Other)
    }

    /// Whether what was learned can be kept now.
    ///
    /// # Errors
    /// If there is nothing.
    fn keeps(&self) -> Result<(), Reason> {
        Err(Reason::NoLearner)
    }

    /// Writes what was learned beside the model with this check sum.
    fn keep<'b>(&self, model: Option<u32>, bytes: &'b mut [u8; KEPT]) -> Option<&'b [u8]> {
        let _ = (model, bytes);
        None
    }

    /// How far it is.
    fn report(&self) -> Option<LearningReport> {
        None
    }
}

/// Of a vehicle that learns nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoLearner;

impl Learns for NoLearner {}

/// Learns beside the flight stack of an autopilot.
#[derive(Clone, Debug)]
pub struct FlightLearner {
    learning: FlightLearning,
    /// Whether a position came since the last tick that learned.
    heard: bool,
    recalled: bool,
}

impl FlightLearner {
    /// It is off until it is told; positions are [`POSITION_AGE_S`] old when they arrive. 8 KB of zeros, so a static with it
    /// takes no flash.
    pub const fn new() -> Self {
        Self { learning: FlightLearning::empty(), heard: false, recalled: false }
    }

    fn known(&self) -> Result<&FlightLearning, Reason> {
        if self.learning.is_configured() { Ok(&self.learning) } else { Err(Reason::NoLearner) }
    }
}

impl Default for FlightLearner {
    fn default() -> Self {
        Self::new()
    }
}

impl Learns for FlightLearner {
    fn configure(&mut self, settings: &Settings) {
        let guesses = Guess::of(settings, POSITION_AGE_S);
        self.learning.configure(guesses.as_ref(), settings.rates.reference_hz(), POSITION_AGE_S);
    }

    fn hear(&mut self) {
        self.heard = true;
    }

    fn land(&mut self) {
        self.learning.restart();
    }

    fn order(&mut self, order: LearnOrder) -> Result<(), Reason> {
        self.known()?;
        let add_on = self.learning.add_on();
        let done = match order {
            LearnOrder::Commission => {
                add_on.commission();
                Ok(())
            }
            LearnOrder::Learn => add_on.learn(),
            LearnOrder::Hold => add_on.hold(),
            LearnOrder::Stop => {
                add_on.stop();
                Ok(())
            }
            LearnOrder::Forget => {
                add_on.forget();
                self.recalled = false;
                Ok(())
            }
            LearnOrder::Keep => return Err(Reason::Storage),
        };
        done.map_err(Reason::Learner)
    }

    fn step(&mut self, flight: &mut Flight<'_>, tick: Tick, state: &State) {
        if self.learning.is_due(flight, tick) {
            let heard = core::mem::take(&mut self.heard);
            self.learning.step(flight, tick, heard.then_some(state));
        }
    }

    fn recall(&mut self, model: Option<u32>, bytes: &[u8]) -> Result<(), NotKept> {
        self.known().map_err(|_| NotKept::Other)?;
        self.learning.recall(model, bytes)?;
        self.recalled = true;
        Ok(())
    }

    fn keeps(&self) -> Result<(), Reason> {
        match self.known()?.progress().phase {
            Phase::Commissioning => Err(Reason::Learner(Problem::Unknown { axis: 0 })),
            _ => Ok(()),
        }
    }

    fn keep<'b>(&self, model: Option<u32>, bytes: &'b mut [u8; KEPT]) -> Option<&'b [u8]> {
        self.known().ok()?.keep(model, bytes)
    }

    fn report(&self) -> Option<LearningReport> {
        Some(LearningReport::new(&self.learning.progress(), self.recalled, self.learning.offset().into()))
    }
}

impl<L: Learns> Autopilot<'_, L> {
    /// Goes on with what was kept of this vehicle and the model that flies.
    ///
    /// # Errors
    /// If nothing was kept there, it is damaged, of another loop or model, or nothing learns here; then nothing changes.
    pub fn recall(&mut self, bytes: &[u8]) -> Result<(), NotKept> {
        self.learner.recall(self.checksum(), bytes)
    }

    /// Writes what was learned; `None` if nothing learns here, or the loop is being measured.
    pub fn keep<'b>(&self, bytes: &'b mut [u8; KEPT]) -> Option<&'b [u8]> {
        self.learner.keep(self.checksum(), bytes)
    }

    fn checksum(&self) -> Option<u32> {
        self.model.map(impromptu_firmware::Model::checksum)
    }

    /// How far the learner is, if there is one.
    pub fn learning(&self) -> Option<LearningReport> {
        self.learner.report()
    }

    /// Whether what was learned can be kept now.
    ///
    /// # Errors
    /// If it is armed, since learning goes on, if nothing learns here, or if the loop is being measured.
    pub fn keeps(&self) -> Result<(), Reason> {
        if self.armed {
            return Err(Reason::Armed);
        }
        self.learner.keeps()
    }

    pub(super) fn tells_learned(&self, offset: u32) -> Result<(), Reason> {
        self.keeps()?;
        if offset as usize > KEPT { Err(Reason::Offset { expected: 0 }) } else { Ok(()) }
    }
}
