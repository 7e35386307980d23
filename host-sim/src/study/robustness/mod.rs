//! Robustness: what is left of the gain when vehicle, loop and air are not those of the training, and what it costs to keep it.
//!
//! *in* settings; *out* a [`Study`]; *never* a model or a lane that was chosen on the flights that are shown here; *source* Zhou 2017
//! section V (a vehicle and its model) and the pilot study, "at test time only".

mod cases;
mod comparison;
pub mod draws;
pub mod effort;
pub mod gaussian;
pub mod hover;
pub mod ledger;
mod mismatch;
mod report;
pub mod spread;
#[cfg(test)]
mod tests;

use std::path::PathBuf;

use anyhow::Context as _;
use impromptu_firmware::model::Model;
use rayon::prelude::*;

pub use cases::{CASES, Case, DEVIATIONS, PARAMETERS, Parameter, WINDS, wind};
pub use comparison::Comparison;
pub use mismatch::Mismatch;

use self::{
    draws::{DrawSettings, Ranges, fly_draws},
    ledger::{Header, Shard},
};
use super::Study;
use crate::{
    experiment::{Loop, Purpose, Recipe, build, demo::Observer, derived},
    trajectory::{Trajectory, strokes},
};

/// What the study covers.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Seed of everything random.
    pub seed: u64,
    /// The loops; a model is built for each.
    pub loops: Vec<Loop>,
    /// Test strokes.
    pub strokes: usize,
    /// Vehicles drawn for each loop.
    pub draws: u32,
    /// Strokes that each of them flies.
    pub draw_strokes: usize,
    /// Ranges of the draws.
    pub ranges: Ranges,
    /// Recipe of the models.
    pub recipe: Recipe,
    /// Folder for the draws.
    pub out: PathBuf,
}

/// Runs the whole study.
///
/// # Errors
/// If a model cannot be built or flown, or the draws in the folder are those of another run.
pub fn run(settings: &Settings, command: &str, observer: &dyn Observer) -> anyhow::Result<Study> {
    let parts: Vec<Study> = settings
        .loops
        .par_iter()
        .map(|plant| study_loop(settings, plant, observer).with_context(|| name(plant)))
        .collect::<anyhow::Result<_>>()?;
    let mut study = Study::new("Robustness of the add-on", command, settings.seed);
    report::explain(&mut study, settings);
    for part in parts {
        study.findings.extend(part.findings);
        study.figures.extend(part.figures);
        study.notes.extend(part.notes);
    }
    Ok(study)
}

/// Vehicle, gains and condition of a loop in words.
pub fn name(plant: &Loop) -> String {
    format!("{} {} {}", plant.vehicle.name, plant.gains, plant.condition.name)
}

/// The same as the beginning of names in the JSON document and of files.
fn slug(plant: &Loop) -> String {
    draws::slug(&name(plant))
}

fn study_loop(settings: &Settings, plant: &Loop, observer: &dyn Observer) -> anyhow::Result<Study> {
    let mut study = Study::new("", "", settings.seed);
    let name = name(plant);
    observer.stage(&format!("{name}: building the model"));
    let built = build(&settings.recipe, plant, settings.seed, &mut |_| {})?;
    let model = Model::from_bytes(&built.models.int8)?;
    let seed = derived(settings.seed, Purpose::Test);
    let trajectories = strokes(seed, settings.strokes, 1.0, plant.rate_hz())?;
    observer.stage(&format!("{name}: cases and deviations"));
    report::tell_cases(&mut study, plant, &fly_cases(plant, &model, &trajectories, seed)?);
    report::draw_deviations(&mut study, plant, &fly_deviations(plant, &model, &trajectories, seed)?);
    observer.stage(&format!("{name}: {} vehicles drawn", settings.draws));
    let path = settings.out.join(format!("draws-{}.jsonl", slug(plant)));
    let draws = DrawSettings::new(plant, &model, settings.seed, settings.draws, settings.draw_strokes, settings.ranges.clone());
    let content = fly_draws(&Header { settings: draws, shard: Shard::WHOLE }, plant, &model, &path, &|_, _| {})?;
    spread::tell(&mut study, &slug(plant), &content);
    observer.stage(&format!("{name}: effort of the feedback lane"));
    let designs = effort::sweep(&settings.recipe, plant, &built, &trajectories, settings.seed, seed)?;
    let baseline = plant.errors(&trajectories, None, 1.0, seed)?;
    report::draw_effort(&mut study, plant, &designs, &baseline)?;
    Ok(study)
}

/// The nominal loop, the named cases and 20 ms more delay, flown.
///
/// # Errors
/// If the model does not fit the flight stack.
pub fn fly_cases(
    plant: &Loop,
    model: &Model<'_>,
    trajectories: &[Trajectory],
    seed: u64,
) -> anyhow::Result<Vec<(&'static str, Comparison)>> {
    let late = Mismatch { delay_s: 0.02, ..Mismatch::NONE };
    let cases = [("nominal", Mismatch::NONE)].into_iter();
    let cases = cases.chain(CASES.iter().map(|case| (case.name, case.mismatch))).chain([("delay_plus_20_ms", late)]);
    cases.map(|(name, mismatch)| Ok((name, Comparison::fly(&mismatch.applied(plant), model, trajectories, seed)?))).collect()
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
pub fn fly_deviations(plant: &Loop, model: &Model<'_>, trajectories: &[Trajectory], seed: u64) -> anyhow::Result<Deviations> {
    let fly = |mismatch: Mismatch| Ok(Comparison::fly(&mismatch.applied(plant), model, trajectories, seed)?);
    let parameter = |parameter: &Parameter| {
        DEVIATIONS.iter().map(|deviation| fly((parameter.at)(1.0 + deviation / 100.0))).collect::<anyhow::Result<Vec<_>>>()
    };
    Ok(Deviations {
        parameters: PARAMETERS.iter().map(parameter).collect::<anyhow::Result<_>>()?,
        winds: WINDS.iter().map(|speed| fly(wind(*speed))).collect::<anyhow::Result<_>>()?,
    })
}
