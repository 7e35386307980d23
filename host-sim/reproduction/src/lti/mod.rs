//! Insight 1, the two feature sets and Lemma 1 on the paper's linear systems.
//!
//! *in* settings and a seed; *out* rows 3, 4, 6 to 10 and 12 to 19 as numbers and figures; *never* a choice made on the test trajectory;
//! *source* Zhou 2017, sections III and V.

mod difference;
mod exact;
mod features;
mod learned;
mod panel;
mod step_test;
mod systems;

use crate::siso::learning;
use serde::{Deserialize, Serialize};

use impromptu_report::study::Study;

/// Rows of the paper's promises that are answered here.
pub const ROWS: &[u8] = &[3, 4, 6, 7, 8, 9, 10, 12, 13, 14, 16, 17, 18, 19];

/// How the study is run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Learning of every network.
    pub learning: learning::Settings,
}

/// Runs the study.
///
/// # Errors
/// If the firmware refuses a network.
pub fn run(settings: &Settings) -> anyhow::Result<Study> {
    let mut study = Study::new("The add-on on linear systems", "host-sim study lti", settings.learning.seed);
    exact::add(&mut study);
    step_test::add(&mut study, settings.learning.seed)?;
    let state_space = learned::add(&mut study, &settings.learning)?;
    features::add(&mut study, &state_space);
    difference::add(&mut study, &settings.learning)?;
    Ok(study)
}

#[cfg(test)]
pub(crate) mod tests;
