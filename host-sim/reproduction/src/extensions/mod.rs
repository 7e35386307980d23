//! Rows 5, 11 and 31, and real logs: what the paper names without showing it, or leaves to later work.
//!
//! *in* a study, a seed, perhaps a folder of logs; *out* its numbers and figures; *never* a mean without the worst beside it; *source*
//! [`crate::siso::extensions`].

mod logs;
mod nonlinear;
mod preview;
mod regions;
mod summary;

use std::path::Path;

use crate::siso::levenberg_marquardt::Settings;

use impromptu_report::study::Study;

/// Rows of the paper's promises that are answered here.
pub const ROWS: &[u8] = &[5, 11, 31];

/// Networks small enough for plants of two states, and enough steps for them.
const TRAINING: fn(usize, usize) -> Settings = |units, iterations| Settings { units, iterations, ..Settings::default() };
/// Random trajectories in each trial.
const OTHERS: u64 = 8;

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
pub(crate) mod tests;
