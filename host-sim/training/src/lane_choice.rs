//! What comes of the choice of a feedback lane: the lane, or why there is none.
//!
//! *in* designs and how they flew; *out* a choice or a refusal, and either in words; *never* a refusal without its reason;
//! *source* `lane`, which chooses.

use impromptu_model_export::{ExportError, description::LaneDescription};
use impromptu_sim::{flights::FlightsError, rollout::RolloutError};

use crate::feedback_design::DesignRefusal;

/// Why a model is written without a feedback lane.
#[derive(Debug, thiserror::Error)]
pub enum LaneRefusal {
    /// The identification or every design was refused.
    #[error("{axis}: {reason}")]
    Design {
        /// Axis that was refused.
        axis: &'static str,
        /// Why.
        reason: DesignRefusal,
    },
    /// No design passed the validation flights.
    #[error("of {designs} designs none passed the validation flights; the best one's worst flight was {worst:.1} % ({case})")]
    Flights {
        /// Designs that were flown.
        designs: usize,
        /// Reduction of the worst flight of the best design, per cent.
        worst: f64,
        /// The case in which that was.
        case: String,
    },
    /// Nothing flies that could judge the designs.
    #[error("it is chosen by simulated flights, and no vehicle was given; give --vehicle")]
    NoFlights,
    /// The logs allow none.
    #[error("{0}")]
    Logs(String),
    /// Flights could not be flown.
    #[error(transparent)]
    Rollout(#[from] FlightsError),
    /// A candidate could not be encoded.
    #[error(transparent)]
    Export(#[from] ExportError),
}

impl From<RolloutError> for LaneRefusal {
    fn from(error: RolloutError) -> Self {
        Self::Rollout(error.into())
    }
}

/// The lane that was chosen.
#[derive(Clone, Debug)]
pub struct LaneChoice {
    /// What is stored.
    pub lane: LaneDescription,
    /// The design in words.
    pub design: String,
    /// Score: weighted mean over the cases of 90 % of the (geometric) average and 10 % of the worst reduction, per cent.
    pub score: f64,
    /// Worst reduction over all validation flights, per cent.
    pub worst: f64,
}

/// What a model remarks of its feedback lane, or of why it has none.
pub fn in_words(lane: &Result<LaneChoice, LaneRefusal>) -> String {
    match lane {
        Ok(choice) => format!("feedback lane: {}", choice.design),
        Err(reason) => format!("no feedback lane: {reason}"),
    }
}
