//! From properties to gates, and from gates to a verdict.
//!
//! *in* properties, coverage, prediction; *out* [`Gates`], [`Verdict`]; *never* more than the log shows: what it leaves open is
//! said to be open, with what to log next; *source* Zhou 2017, Insight 1b (stable inverse), Lemma 1 (unit gain), Section III
//! (excitation). What differs: an unstable inverse is not the end, since a window over the desired output stays bounded.

use nalgebra::Complex;
use serde::Serialize;

use crate::{
    digits::digits,
    excitation::Coverage,
    prediction::Prediction,
    properties::{Interval, Place, Properties, Zero, frequency_hz},
    transfer_function::TransferFunction,
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

/// Whether an add-on on the references will help.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// It will, and difference learning is allowed.
    WillHelp,
    /// It will, if inputs and outputs are absolute.
    WillHelpWithoutDifferenceLearning,
    /// A window over the desired output will; an inverse that feeds itself back is unstable, or not shown to be stable.
    WillHelpByWindow,
    /// It will not: there is too little to gain.
    WillNot,
    /// The log leaves both open.
    CannotTell,
}

/// A gain this near to one is one.
pub const GAIN_TOLERANCE: f64 = 0.03;
/// Least share of the loop's band that has to be excited.
const LEAST_COVERAGE: f64 = 0.5;
/// A reduction below this, %, is none.
pub const LEAST_REDUCTION: f64 = 5.0;
/// Share of draws that may have been lost.
const MOST_LOST: f64 = 0.5;
/// Share of draws that decides where a zero lies.
const SURE: f64 = 0.95;
/// Where a model explains less than this share of what was measured, the rest may hide a zero that it lacks.
const LEAST_EXPLAINED: f64 = 0.9;

impl Gates {
    /// The gates of a channel that was identified at this sub-rate; the models are draws of those
    /// that could be the true one, and rivals that no test rules out.
    pub fn of(properties: &Properties, coverage: &Coverage, models: [&[TransferFunction]; 2], sub_rate_hz: f64) -> Self {
        Self {
            unit_gain: unit_gain(properties),
            stable_inverse: stable_inverse(properties, coverage, models, sub_rate_hz),
            excitation: excitation(properties, coverage, 0.5 * sub_rate_hz),
        }
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
    /// The verdict of gates and of a prediction for the features that the gates allow. Where most draws were `lost`, the
    /// intervals know nothing.
    pub fn of(gates: &Gates, prediction: &Prediction, lost: f64) -> Self {
        let Interval { low, high, .. } = prediction.undisturbed_percent;
        if high < LEAST_REDUCTION {
            Self::WillNot
        } else if low < LEAST_REDUCTION || lost > MOST_LOST {
            Self::CannotTell
        } else if gates.stable_inverse != Gate::Passed {
            Self::WillHelpByWindow
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
            Self::WillHelpByWindow => "will help by a window over the desired output",
            Self::WillNot => "will not help",
            Self::CannotTell => "cannot tell",
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
/// The same where a zero is not sure: nothing says then that the first coefficient is one at all.
const NEAR: f64 = 3.0;

/// What the record shows tells of zeros up to so many times its highest frequency.
const SMOOTH: f64 = 1.4;
/// A smooth trajectory asks nothing of the inverse at so many times the bandwidth.
const JUDGED: f64 = 10.0;

/// Frequencies, Hz, up to which a zero is judged: wherever it lies, and if it surely lies outside. The first is what the record
/// shows (at faster ones neither the log nor a smooth trajectory asks anything of the inverse), but the loop's own band at least;
/// the second is ten times that band.
fn judged_hz(properties: &Properties, coverage: &Coverage) -> [f64; 2] {
    let band = properties.bandwidth_hz.value.min(coverage.trusted_hz);
    let reach = (JUDGED * band).min(coverage.trusted_hz);
    [(SMOOTH * coverage.highest_hz).clamp(band, reach), reach]
}

/// Zeros that are judged, those that are not [`FAR`] out.
pub fn judged_zeros<'a>(properties: &'a Properties, coverage: &Coverage) -> impl Iterator<Item = &'a Zero> + use<'a> {
    let [shown, reach] = judged_hz(properties, coverage);
    let judged = move |zero: &&Zero| zero.frequency_hz <= if zero.place == Place::Outside { reach } else { shown };
    properties.zeros.iter().filter(judged).filter(|zero| zero.magnitude.value < FAR)
}

fn stable_inverse(
    properties: &Properties,
    coverage: &Coverage,
    [draws, rivals]: [&[TransferFunction]; 2],
    sub_rate_hz: f64,
) -> Gate {
    let [shown, reach] = judged_hz(properties, coverage);
    let outside = |model: &TransferFunction, highest: f64, far: f64| {
        let unstable =
            |zero: &Complex<f64>| (1.0..far).contains(&zero.norm()) && frequency_hz(*zero, 1.0 / sub_rate_hz) <= highest;
        model.zeros().iter().any(unstable)
    };
    let share = |highest: f64, far: f64| {
        draws.iter().filter(|model| outside(model, highest, far)).count() as f64 / draws.len().max(1) as f64
    };
    let [of_shown, of_all] = [share(shown, NEAR), share(reach, FAR)];
    let zeros: Vec<String> =
        judged_zeros(properties, coverage).filter(|zero| zero.place != Place::Inside).map(Zero::words).collect();
    let seen = !zeros.is_empty();
    let zeros = if zeros.is_empty() { String::new() } else { format!(", z = {}", zeros.join(", ")) };
    if seen && of_all >= SURE && rivals.iter().all(|rival| outside(rival, reach, FAR)) {
        Gate::Failed(format!(
            "zero outside of the unit circle{zeros}: the inverse is unstable, its reference grows without bound"
        ))
    } else if of_shown > 1.0 - SURE || of_all >= SURE || rivals.iter().any(|rival| outside(rival, shown, NEAR)) {
        let who = match (100.0 * of_shown).round() {
            0.0 => "a model that explains the log as well has one there".to_owned(),
            percent => format!("{percent} % of the models that could be true have one there"),
        };
        Gate::Undecided(format!("a zero may lie outside of the unit circle{zeros} ({who}): a longer or quieter log decides"))
    } else if properties.explained < LEAST_EXPLAINED {
        Gate::Undecided(format!(
            "disturbances make up {:.0} % of what was measured and may hide a zero outside of the unit circle: a longer log, or \
             one of larger amplitude, decides",
            100.0 * (1.0 - properties.explained)
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
        Gate::Undecided(format!(
            "the reference shows only {percent:.0} % of the loop's band (0 … {} Hz) above the noise, and nothing above {} Hz: \
             for faster motions, log steps, or many tones up to there",
            digits(bandwidth_hz),
            digits(coverage.highest_hz)
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
