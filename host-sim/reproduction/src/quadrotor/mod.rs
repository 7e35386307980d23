//! The quadrotor study: Insights 2 and 3 on the predecessor's loop and on a Crazyflie.
//!
//! *in* [`QuadrotorSettings`]; *out* a [`Study`]; *never* a choice made on the test trajectories; *source* Zhou 2017, section V; Li et al., ICRA 2017.

pub mod addon;
mod bias;
mod crazyflie;
mod ground;
pub mod half_height;
pub mod inputs;
mod origins;
pub mod predecessor;
mod rates;
pub mod references;
mod settings;
mod signals;
pub mod sizes;
mod strokes;
mod table;

use impromptu_report::study::Study;

pub use settings::QuadrotorSettings;

use crazyflie::Crazyflie;
use ground::Ground;

/// Rows of the paper's promises that are answered here.
pub const ROWS: &[u8] = &[1, 2, 15, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30];

/// Runs the study. `stage` is told what is done next.
///
/// # Errors
/// If anything cannot be flown, trained or encoded.
pub fn run(settings: &QuadrotorSettings, command: &str, stage: &dyn Fn(&str)) -> anyhow::Result<Study> {
    let mut study = Study::new("The quadrotor study", command, settings.seed);
    stage("training flights of the predecessor's loop");
    let ground = Ground::new(settings)?;
    stage("Table I and Fig. 3");
    let networks = table::run(&ground, &mut study)?;
    stage("reference points");
    origins::run(&ground, &networks.twelve, &mut study)?;
    stage("training signals");
    signals::run(&ground, &mut study)?;
    stage("Fig. 4");
    bias::run(&ground, &mut study)?;
    stage("training flights of the Crazyflie");
    let crazyflie = Crazyflie::new(settings)?;
    signals::crazyflie(&ground, &crazyflie, &mut study)?;
    stage("sub-rates and previews");
    rates::run(&ground, &crazyflie, &mut study)?;
    stage("network sizes");
    sizes::run(&crazyflie, &mut study)?;
    stage("strokes on the predecessor's loop");
    strokes::predecessor(&ground, &networks, &mut study)?;
    stage("strokes on the Crazyflie");
    strokes::crazyflie(&ground, &crazyflie, &mut study)?;
    Ok(study)
}

#[cfg(test)]
pub(crate) mod tests;
