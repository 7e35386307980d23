//! The twelve ways of flying that are compared, with one name for each in JSON, in tables and in words.

use serde::{Deserialize, Serialize};

/// What stood between the desired trajectory and the baseline loop in a flight.
///
/// The serialised names (`baseline`, `feedforward`, …, `full_int8`) are part of the JSON document's interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The loop alone: the reference is the desired trajectory.
    Baseline,
    /// Differential-flatness acceleration feed-forward through the reference, `p_r = p_d + a_d / k_p`; nothing is learned.
    Feedforward,
    /// Feedback lane alone.
    Feedback,
    /// Flatness feed-forward plus the feedback lane.
    FeedforwardFeedback,
    /// Ridge regression on the network's features in the network's place, no feedback lane.
    Ridge,
    /// Network lane alone, weights in f32.
    NetF32,
    /// Network lane alone, weights in int8.
    NetInt8,
    /// Ridge regression plus the feedback lane.
    FullRidge,
    /// Both lanes, network in f32.
    FullF32,
    /// Both lanes, network in int8: what is flashed.
    FullInt8,
    /// Both parts that are learned in flight, with nothing before them.
    Learned,
    /// The parts that are learned in flight on top of a model with the lanes that it has.
    FullLearned,
}

/// Which group of methods a colour stands for in the plots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// The loop alone.
    Baseline,
    /// What needs no learning.
    Comparison,
    /// A linear map on the network's features.
    Ridge,
    /// The network lane alone.
    Network,
    /// Both lanes.
    BothLanes,
    /// Learned in flight.
    Learned,
}

impl Method {
    /// Every method, in the order of the table's columns.
    pub const ALL: [Self; 12] = [
        Self::Baseline,
        Self::Feedforward,
        Self::Feedback,
        Self::FeedforwardFeedback,
        Self::Ridge,
        Self::NetF32,
        Self::NetInt8,
        Self::FullRidge,
        Self::FullF32,
        Self::FullInt8,
        Self::Learned,
        Self::FullLearned,
    ];

    /// The name in JSON and CSV.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Baseline => "baseline",
            Self::Feedforward => "feedforward",
            Self::Feedback => "feedback",
            Self::FeedforwardFeedback => "feedforward_feedback",
            Self::Ridge => "ridge",
            Self::NetF32 => "net_f32",
            Self::NetInt8 => "net_int8",
            Self::FullRidge => "full_ridge",
            Self::FullF32 => "full_f32",
            Self::FullInt8 => "full_int8",
            Self::Learned => "learned",
            Self::FullLearned => "full_learned",
        }
    }

    /// A column heading of two short lines; the second one may be empty.
    #[must_use]
    pub const fn heading(self) -> [&'static str; 2] {
        match self {
            Self::Baseline => ["baseline", ""],
            Self::Feedforward => ["flatness", ""],
            Self::Feedback => ["feedback", "lane"],
            Self::FeedforwardFeedback => ["flatness", "+ lane"],
            Self::Ridge => ["ridge", ""],
            Self::NetF32 => ["net f32", ""],
            Self::NetInt8 => ["net int8", ""],
            Self::FullRidge => ["ridge", "+ lane"],
            Self::FullF32 => ["net f32", "+ lane"],
            Self::FullInt8 => ["net int8", "+ lane"],
            Self::Learned => ["learned", "in flight"],
            Self::FullLearned => ["model", "+ learned"],
        }
    }

    /// The heading on one line, for labels in plots.
    #[must_use]
    pub fn label(self) -> String {
        self.heading().join(" ").trim_end().to_owned()
    }

    /// What the method is, for a reader who has not read the paper.
    #[must_use]
    pub const fn in_words(self) -> &'static str {
        match self {
            Self::Baseline => "The control loop alone, given the desired trajectory as its reference.",
            Self::Feedforward => {
                "The desired acceleration divided by the position gain is added to the position reference; nothing is learned."
            }
            Self::Feedback => {
                "Only the feedback lane: a stored linear map from the last measured tracking errors to a small correction."
            }
            Self::FeedforwardFeedback => {
                "The flatness feed-forward and the feedback lane together: the strongest rival that needs no network."
            }
            Self::Ridge => {
                "A linear map from the same preview window that the network sees, fitted by ridge regression; no feedback lane."
            }
            Self::NetF32 => "The network lane alone, with 32-bit floating-point weights: the add-on of the paper.",
            Self::NetInt8 => "The network lane alone, quantised to 8-bit weights as the microcontroller runs it.",
            Self::FullRidge => "Ridge regression in the network's place, plus the feedback lane.",
            Self::FullF32 => "Both lanes, with the network in 32-bit floating point: shows what quantisation costs.",
            Self::FullInt8 => "Both lanes, with the network in 8-bit weights: exactly what is flashed.",
            Self::Learned => "Nothing was trained: the loop learned while it flew, for as long as is said, and goes on.",
            Self::FullLearned => "A model with its lanes, and what the loop learned on top of it while it flew.",
        }
    }

    /// Its group.
    #[must_use]
    pub const fn family(self) -> Family {
        match self {
            Self::Baseline => Family::Baseline,
            Self::Ridge | Self::FullRidge => Family::Ridge,
            Self::NetF32 | Self::NetInt8 => Family::Network,
            Self::FullF32 | Self::FullInt8 => Family::BothLanes,
            Self::Learned | Self::FullLearned => Family::Learned,
            Self::Feedforward | Self::Feedback | Self::FeedforwardFeedback => Family::Comparison,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn serialised_names_are_the_documented_ones() {
        let names: Vec<String> =
            Method::ALL.iter().map(|method| serde_json::to_value(method).unwrap().as_str().unwrap().to_owned()).collect();
        assert_eq!(
            names.join(" "),
            "baseline feedforward feedback feedforward_feedback ridge net_f32 net_int8 full_ridge full_f32 full_int8 \
             learned full_learned"
        );
        assert!(Method::ALL.iter().zip(&names).all(|(method, name)| method.name() == name));
    }
}
