//! The diagnosis before a training, axis by axis.
//!
//! *in* flight logs; *out* what each axis shows; *never* a failure of an axis on which nothing was asked, nor another verdict
//! than that of `diagnose`; *source* Zhou 2017, Lemma 1: gain of one for difference learning. That the inverse is stable (Insight
//! 1b) is not needed: what is trained is a window over the desired output, which stays bounded.

use impromptu_diagnosis::{Diagnosis, DiagnosisError, Gate, Gates, Settings, Verdict, diagnose, properties::Interval};
use impromptu_sim::flight_log::FlightLog;
use serde::Serialize;

use crate::{breakdown::sound, channel::of_logs};

/// What an axis shows.
#[derive(Clone, Debug, Serialize)]
pub struct AxisGates {
    /// Name of the axis.
    pub axis: &'static str,
    /// Diagnosis; `None` if the axis is not asked to move, or if there is too little to judge by.
    pub diagnosis: Option<Box<Diagnosis>>,
    /// Why there is none, if the axis is asked to move.
    pub trouble: Option<Trouble>,
}

/// Why an axis could not be judged.
#[derive(Clone, Debug, Serialize)]
pub struct Trouble {
    /// In words.
    pub why: String,
    /// Whether nothing good can be learned from such logs, rather than too little be seen.
    pub fatal: bool,
}

/// An axis that is asked to move by less, m, is not judged.
const LEAST_EXTENT: f64 = 0.2;
/// Draws for the intervals of a gate.
const DRAWS: usize = 100;

/// The gates of every axis; logs in which the loop broke down do not count. `measurement_delay_s` is the age of what was
/// measured.
pub fn check_gates(logs: &[FlightLog], measurement_delay_s: f64, seed: u64) -> Vec<AxisGates> {
    let (logs, _) = sound(logs);
    let settings = Settings { draws: DRAWS, seed, ..Settings::default() };
    let axis = |(index, axis)| {
        if extent(&logs, index) < LEAST_EXTENT {
            return AxisGates { axis, diagnosis: None, trouble: None };
        }
        let found = of_logs(logs.iter().copied(), index, measurement_delay_s).map_err(DiagnosisError::from);
        match found.and_then(|record| diagnose(&record, &settings)) {
            Ok(diagnosis) => AxisGates { axis, diagnosis: Some(Box::new(diagnosis)), trouble: None },
            Err(error) => {
                let fatal = !matches!(error, DiagnosisError::Short { .. } | DiagnosisError::Record(_));
                AxisGates { axis, diagnosis: None, trouble: Some(Trouble { why: error.to_string(), fatal }) }
            }
        }
    };
    ["x", "y", "z"].into_iter().enumerate().map(axis).collect()
}

/// How far the desired position moves, m.
fn extent(logs: &[&FlightLog], axis: usize) -> f64 {
    let values = || logs.iter().flat_map(|log| log.rows.iter().map(move |row| row.desired.position[axis]));
    values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
}

impl AxisGates {
    /// Why features relative to now would do harm, or nothing.
    pub fn failures(&self) -> Vec<String> {
        let diagnosis = self.diagnosis.iter().flat_map(|found| {
            let gain = match &found.gates.unit_gain {
                Gate::Failed(why) => Some(why.clone()),
                Gate::Passed | Gate::Undecided(_) => None,
            };
            gain.into_iter().chain((found.verdict == Verdict::WillNot).then(|| found.verdict_text()))
        });
        let trouble = self.trouble.iter().filter(|trouble| trouble.fatal).map(|trouble| trouble.why.clone());
        diagnosis.chain(trouble).map(|why| self.named(&why)).collect()
    }

    /// What could not be decided.
    pub fn warnings(&self) -> Vec<String> {
        let diagnosis = self.diagnosis.iter().flat_map(|found| {
            let Gates { unit_gain, stable_inverse, excitation } = &found.gates;
            let gates = [unit_gain, stable_inverse, excitation].into_iter().filter_map(|gate| match gate {
                Gate::Undecided(why) => Some(why.clone()),
                Gate::Failed(why) if gate == stable_inverse => {
                    Some(format!("{why}; a window over the desired output stays bounded"))
                }
                Gate::Passed | Gate::Failed(_) => None,
            });
            gates.chain((found.verdict == Verdict::CannotTell).then(|| found.verdict_text())).collect::<Vec<_>>()
        });
        let trouble = self.trouble.iter().filter(|trouble| !trouble.fatal).map(|trouble| trouble.why.clone());
        diagnosis.chain(trouble).map(|why| self.named(&why)).collect()
    }

    /// What is predicted of an axis on which something will help.
    pub fn prediction(&self) -> Option<String> {
        let found = self.diagnosis.as_ref().filter(|found| !matches!(found.verdict, Verdict::WillNot | Verdict::CannotTell))?;
        let Interval { low, value, high } = found.prediction.reduction_percent;
        let words = found.verdict.words();
        Some(self.named(&format!(
            "{words}; a linear window would reduce the measured RMS error by {value:.0} % ({low:.0} … {high:.0} %)"
        )))
    }

    fn named(&self, why: &str) -> String {
        format!("axis {}: {why}", self.axis)
    }
}
