//! From properties to gates, and from gates to a verdict.
//!
//! *in* properties, coverage, prediction; *out* [`Gates`], [`Verdict`]; *never* "will help" while a gate failed; *source* Zhou
//! 2017, Insight 1b (stable inverse), Lemma 1 (unit gain), Section III (excitation).

use serde::Serialize;

use crate::{
    digits::digits,
    excitation::Coverage,
    prediction::Prediction,
    properties::{Place, Properties, Zero},
};

/// Outcome of one gate.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "outcome", content = "why", rename_all = "snake_case")]
pub enum Gate {
    /// Shown.
    Passed,
    /// The record does not decide; why.
    Undecided(String),
    /// Shown to be violated; why.
    Failed(String),
}

/// What has to hold before anything is learned.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Gates {
    /// Steady-state gain of one: what difference learning needs.
    pub unit_gain: Gate,
    /// Zeros inside the unit circle: what an inverse needs.
    pub stable_inverse: Gate,
    /// A reference that shows the loop's band.
    pub excitation: Gate,
}

/// Whether an add-on that learns the loop's inverse will help.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// It will, and difference learning is allowed.
    WillHelp,
    /// It will, if inputs and outputs are absolute.
    WillHelpWithoutDifferenceLearning,
    /// It will not.
    WillNot,
}

/// A gain this near to one is one.
pub const GAIN_TOLERANCE: f64 = 0.03;
/// Least share of the loop's band that has to be excited.
const LEAST_COVERAGE: f64 = 0.5;
/// A predicted reduction below this, %, is none; one whose interval reaches below is stated as undecided.
pub const LEAST_REDUCTION: f64 = 5.0;

impl Gates {
    /// The gates of a channel that was identified at twice `half_rate_hz`.
    pub fn of(properties: &Properties, coverage: &Coverage, half_rate_hz: f64) -> Self {
        Self {
            unit_gain: unit_gain(properties),
            stable_inverse: stable_inverse(properties, coverage),
            excitation: excitation(properties, coverage, half_rate_hz),
        }
    }

    /// What failed, if difference learning is wanted or not.
    pub fn failures(&self, difference_learning: bool) -> Vec<&str> {
        let gain = difference_learning.then_some(&self.unit_gain);
        let failed = |gate: &&Gate| matches!(gate, Gate::Failed(_));
        gain.into_iter().chain([&self.stable_inverse, &self.excitation]).filter(failed).filter_map(Gate::why).collect()
    }
}

impl Gate {
    /// Why it did not pass.
    pub fn why(&self) -> Option<&str> {
        match self {
            Self::Passed => None,
            Self::Undecided(why) | Self::Failed(why) => Some(why),
        }
    }
}

impl Verdict {
    /// The verdict of gates and of a prediction for the features that the gates allow.
    pub fn of(gates: &Gates, prediction: &Prediction) -> Self {
        let failed = |gate: &Gate| matches!(gate, Gate::Failed(_));
        if failed(&gates.stable_inverse) || failed(&gates.excitation) || prediction.reduction_percent.value < LEAST_REDUCTION {
            Self::WillNot
        } else if gates.unit_gain == Gate::Passed {
            Self::WillHelp
        } else {
            Self::WillHelpWithoutDifferenceLearning
        }
    }

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::WillHelp => "will help",
            Self::WillHelpWithoutDifferenceLearning => "will help without difference learning",
            Self::WillNot => "will not help",
        }
    }
}

fn unit_gain(properties: &Properties) -> Gate {
    let gain = properties.gain;
    let near = (gain.value - 1.0).abs() <= GAIN_TOLERANCE;
    let holds = gain.low <= 1.0 + GAIN_TOLERANCE && gain.high >= 1.0 - GAIN_TOLERANCE;
    let range = format!("{:.3} ({:.3} … {:.3})", gain.value, gain.low, gain.high);
    if near && gain.high - gain.low <= 0.2 {
        Gate::Passed
    } else if holds {
        Gate::Undecided(format!("steady-state gain {range}: the log does not show that it is 1; add slow tones or longer steps"))
    } else {
        Gate::Failed(format!(
            "steady-state gain {range} is not 1: difference learning leaves a bias that grows with the reference; use absolute \
             features"
        ))
    }
}

/// A zero further out than this is a dead time that is a tick longer, up to a tenth of the first coefficient: preview undoes it.
pub const FAR: f64 = 10.0;

/// A smooth trajectory asks nothing of the inverse at so many times the bandwidth.
const JUDGED: f64 = 10.0;

/// Zeros that are judged: at frequencies that the record shows (at faster ones neither the log nor a smooth trajectory asks
/// anything of the inverse), up to ten times the bandwidth, and not [`FAR`] out.
pub fn judged_zeros<'a>(properties: &'a Properties, coverage: &Coverage) -> impl Iterator<Item = &'a Zero> + use<'a> {
    let highest = (1.02 * coverage.highest_hz).min(JUDGED * properties.bandwidth_hz.value);
    properties.zeros.iter().filter(move |zero| zero.frequency_hz <= highest && zero.magnitude.value < FAR)
}

fn stable_inverse(properties: &Properties, coverage: &Coverage) -> Gate {
    let list = |place: Place| {
        let zeros = judged_zeros(properties, coverage).filter(|zero| zero.place == place);
        zeros.map(Zero::words).collect::<Vec<_>>().join(", ")
    };
    let (outside, undecided) = (list(Place::Outside), list(Place::Undecided));
    if !outside.is_empty() {
        Gate::Failed(format!(
            "zero outside of the unit circle, z = {outside}: the inverse is unstable, its reference grows without bound"
        ))
    } else if !undecided.is_empty() {
        Gate::Undecided(format!(
            "zero z = {undecided} may lie on either side of the unit circle; a longer or quieter log decides"
        ))
    } else {
        Gate::Passed
    }
}

/// Whether a bandwidth is where the search for it ended, at half the sub-rate.
pub(crate) fn is_beyond(bandwidth_hz: f64, half_rate_hz: f64) -> bool {
    bandwidth_hz >= 0.98 * half_rate_hz
}

fn excitation(properties: &Properties, coverage: &Coverage, half_rate_hz: f64) -> Gate {
    let (percent, bandwidth_hz) = (100.0 * coverage.share, properties.bandwidth_hz.value);
    if coverage.share >= LEAST_COVERAGE {
        Gate::Passed
    } else if is_beyond(bandwidth_hz, half_rate_hz) {
        Gate::Undecided(format!(
            "the loop's band ends above {} Hz, the highest that this sub-rate shows, and the reference shows {} Hz of it: a \
             higher --sub-rate or less noise decides",
            digits(half_rate_hz),
            digits(coverage.highest_hz)
        ))
    } else {
        Gate::Failed(format!(
            "the reference shows only {percent:.0} % of the loop's band (0 … {} Hz) above the noise: fly steps, or many \
             tones up to there",
            digits(bandwidth_hz)
        ))
    }
}

impl Zero {
    /// The zero with its magnitude's interval.
    pub fn words(&self) -> String {
        let place = if self.im > 1e-9 { format!("{:.4} ± {:.4}j", self.re, self.im) } else { format!("{:.4}", self.re) };
        let magnitude = self.magnitude;
        format!("{place} (|z| {:.4} … {:.4}, {:.2} Hz)", magnitude.low, magnitude.high, self.frequency_hz)
    }
}
