//! Rows 5, 11 and 31, and real logs: what the paper names without showing it, or leaves to later work.
//!
//! *in* a study, a seed, perhaps a folder of logs; *out* its numbers and figures; *never* a mean without the worst beside it; *source*
//! [`impromptu_lti::extensions`].

mod logs;
mod nonlinear;
mod preview;
mod regions;

use std::path::Path;

use impromptu_lti::{extensions::mean_and_worst, levenberg_marquardt::Settings};

use super::Study;

/// Rows of the paper's promises that are answered here.
pub const ROWS: &[u8] = &[5, 11, 31];

/// Networks small enough for plants of two states, and enough steps for them.
const TRAINING: fn(usize, usize) -> Settings = |units, iterations| Settings { units, iterations, ..Settings::default() };
/// Random trajectories in each trial.
const OTHERS: u64 = 8;

/// Mean and worst of errors, each with what it adds to a number's name and what it is called.
fn summary(
    errors: impl IntoIterator<Item = f64>,
    mean: &'static str,
    worst: &'static str,
) -> [(&'static str, &'static str, f64); 2] {
    let values = mean_and_worst(errors);
    [("", mean, values.0), ("_worst", worst, values.1)]
}

/// Adds all of it; flights come from `logs` (CSV), or from the copies in the program.
///
/// # Errors
/// If logs cannot be read or are too few.
pub fn add(study: &mut Study, seed: u64, logs: Option<&Path>) -> anyhow::Result<()> {
    nonlinear::add(study, &TRAINING(20, 150), OTHERS, seed);
    regions::add(study, &TRAINING(12, 100), OTHERS, seed);
    preview::add(study, 6, seed)?;
    logs::add(study, logs)
}

#[cfg(test)]
mod tests;
