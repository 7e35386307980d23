//! The named cases, and each parameter at each deviation, flown.

use impromptu_firmware::model::Model;
use impromptu_sim::{flights::Loop, trajectory::Trajectory};

use super::{
    cases::{CASES, DEVIATIONS, PARAMETERS, Parameter, WINDS, wind},
    comparison::Comparison,
    mismatch::Mismatch,
};

/// The nominal loop, the named cases and 20 ms more delay, flown.
///
/// # Errors
/// If the model does not fit the flight stack.
pub fn fly_cases(
    closed_loop: &Loop,
    model: &Model<'_>,
    trajectories: &[Trajectory],
    seed: u64,
) -> anyhow::Result<Vec<(&'static str, Comparison)>> {
    let late = Mismatch { delay_s: 0.02, ..Mismatch::NONE };
    let cases = [("nominal", Mismatch::NONE)].into_iter();
    let cases = cases.chain(CASES.iter().map(|case| (case.name, case.mismatch))).chain([("delay_plus_20_ms", late)]);
    cases
        .map(|(name, mismatch)| Ok((name, Comparison::fly(&mismatch.applied(closed_loop), model, trajectories, seed)?)))
        .collect()
}

/// Flights at the deviations of each parameter, and in each wind.
pub struct Deviations {
    /// For each of [`PARAMETERS`], at each of [`DEVIATIONS`].
    pub parameters: Vec<Vec<Comparison>>,
    /// In each of [`WINDS`].
    pub winds: Vec<Comparison>,
}

/// Flies every parameter at every deviation, and every wind.
///
/// # Errors
/// If the model does not fit the flight stack.
pub fn fly_deviations(
    closed_loop: &Loop,
    model: &Model<'_>,
    trajectories: &[Trajectory],
    seed: u64,
) -> anyhow::Result<Deviations> {
    let fly = |mismatch: Mismatch| Ok(Comparison::fly(&mismatch.applied(closed_loop), model, trajectories, seed)?);
    let parameter = |parameter: &Parameter| {
        DEVIATIONS.iter().map(|deviation| fly((parameter.at)(1.0 + deviation / 100.0))).collect::<anyhow::Result<Vec<_>>>()
    };
    Ok(Deviations {
        parameters: PARAMETERS.iter().map(parameter).collect::<anyhow::Result<_>>()?,
        winds: WINDS.iter().map(|speed| fly(wind(*speed))).collect::<anyhow::Result<_>>()?,
    })
}
