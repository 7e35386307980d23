//! Robustness: what is left of the gain when vehicle, loop and air are not those of the training, and what it costs to keep it.
//!
//! *in* settings; *out* a [`Study`]; *never* a model or a lane that was chosen on the flights that are shown here; *source* Zhou
//! 2017 section V (a vehicle and its model) and the pilot study, "at test time only".

mod cases;
mod comparison;
pub mod control_weight;
mod deviations;
pub mod draw;
pub mod draws;
mod faults;
pub mod gaussian;
mod guard_table;
pub mod handover;
pub mod hover;
pub mod ledger;
mod mismatch;
mod report;
mod settings;
pub mod spread;
#[cfg(test)]
pub(crate) mod tests;

use anyhow::Context as _;
use impromptu_firmware::model::Model;
use impromptu_report::study::Study;
use impromptu_sim::{flights::Loop, trajectory::strokes};
use impromptu_training::{Purpose, build, derived, observer::Observer};
use rayon::prelude::*;

pub use cases::{CASES, Case, DEVIATIONS, PARAMETERS, Parameter, WINDS, wind};
pub use comparison::Comparison;
pub use deviations::{Deviations, fly_cases, fly_deviations};
pub use draw::name;
pub use faults::{Change, Fault, Flown, LaneTick};
pub use mismatch::Mismatch;
pub use settings::Settings;

use self::{
    draw::{DrawSettings, slug_of},
    draws::fly_draws,
    ledger::{Header, Shard},
};

/// Runs the whole study.
///
/// # Errors
/// If a model cannot be built or flown, or the draws in the folder are those of another run.
pub fn run(settings: &Settings, command: &str, observer: &dyn Observer) -> anyhow::Result<Study> {
    let parts: Vec<Study> = settings
        .loops
        .par_iter()
        .map(|closed_loop| study_loop(settings, closed_loop, observer).with_context(|| name(closed_loop)))
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

fn study_loop(settings: &Settings, closed_loop: &Loop, observer: &dyn Observer) -> anyhow::Result<Study> {
    let mut study = Study::new("", "", settings.seed);
    let name = name(closed_loop);
    observer.stage(&format!("{name}: building the model"));
    let built = build(&settings.recipe, closed_loop, settings.seed, &mut |_| {})?;
    let model = Model::from_bytes(&built.models.int8)?;
    let seed = derived(settings.seed, Purpose::Test);
    let trajectories = strokes(seed, settings.strokes, 1.0, closed_loop.rate_hz())?;
    observer.stage(&format!("{name}: cases and deviations"));
    report::tell_cases(&mut study, closed_loop, &fly_cases(closed_loop, &model, &trajectories, seed)?);
    report::draw_deviations(&mut study, closed_loop, &fly_deviations(closed_loop, &model, &trajectories, seed)?);
    observer.stage(&format!("{name}: {} vehicles drawn", settings.draws));
    let path = settings.out.join(format!("draws-{}.jsonl", slug_of(closed_loop)));
    let draws =
        DrawSettings::new(closed_loop, &model, settings.seed, settings.draws, settings.draw_strokes, settings.ranges.clone());
    let content = fly_draws(&Header { settings: draws, shard: Shard::WHOLE }, closed_loop, &model, &path, &|_, _| {})?;
    spread::tell(&mut study, &slug_of(closed_loop), &content);
    observer.stage(&format!("{name}: trips of the guard"));
    guard_table::tell(&mut study, closed_loop, &handover::fly_kinds(closed_loop, &model, settings.guard_flights, seed)?);
    observer.stage(&format!("{name}: control weight of the feedback lane"));
    let designs = control_weight::sweep(&settings.recipe, closed_loop, &built, &trajectories, settings.seed, seed)?;
    let baseline = closed_loop.errors(&trajectories, None, 1.0, seed)?;
    report::draw_control_weight(&mut study, closed_loop, &designs, &baseline)?;
    Ok(study)
}
