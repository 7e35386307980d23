//! The gates of a diagnosis before a training, axis by axis.
//!
//! *in* flight logs; *out* what each axis shows; *never* a failure of an axis on which nothing was asked; *source* Zhou 2017,
//! Insight 1b, Lemma 1: stable inverse, gain of one for difference learning.

use impromptu_diagnosis::{DiagnosisError, Gate, Gates, Settings, assess};
use impromptu_sim::flight_log::FlightLog;
use serde::Serialize;

use crate::{breakdown::sound, channel::of_logs};

/// What an axis shows.
#[derive(Clone, Debug, Serialize)]
pub struct AxisGates {
    /// Name of the axis.
    pub axis: &'static str,
    /// Outcomes; `None` if the axis is not asked to move, or if there is too little to judge by.
    pub gates: Option<Gates>,
    /// Why there are no outcomes, if the axis is asked to move.
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
            return AxisGates { axis, gates: None, trouble: None };
        }
        let found = of_logs(logs.iter().copied(), index, measurement_delay_s).map_err(DiagnosisError::from);
        match found.and_then(|record| assess(&record, &settings)) {
            Ok(assessment) => AxisGates { axis, gates: Some(assessment.gates), trouble: None },
            Err(error) => {
                let fatal = !matches!(error, DiagnosisError::Short { .. } | DiagnosisError::Record(_));
                AxisGates { axis, gates: None, trouble: Some(Trouble { why: error.to_string(), fatal }) }
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
    /// What failed, for features relative to now.
    pub fn failures(&self) -> Vec<String> {
        let gates = self.gates.iter().flat_map(|gates| gates.failures(true)).map(str::to_owned);
        let trouble = self.trouble.iter().filter(|trouble| trouble.fatal).map(|trouble| trouble.why.clone());
        gates.chain(trouble).map(|why| self.named(&why)).collect()
    }

    /// What could not be decided.
    pub fn warnings(&self) -> Vec<String> {
        let gates = self.gates.iter().flat_map(|gates| [&gates.unit_gain, &gates.stable_inverse, &gates.excitation]);
        let undecided = gates.filter(|gate| matches!(gate, Gate::Undecided(_))).filter_map(Gate::why).map(str::to_owned);
        let trouble = self.trouble.iter().filter(|trouble| !trouble.fatal).map(|trouble| trouble.why.clone());
        undecided.chain(trouble).map(|why| self.named(&why)).collect()
    }

    fn named(&self, why: &str) -> String {
        format!("axis {}: {why}", self.axis)
    }
}
