//! `host-sim train`: flight logs to a model.

pub(super) mod any_loop;
mod columns;
mod movement;
mod vehicle;

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, anyhow, bail};
use clap::Args;
use impromptu_files::name::plain;
use impromptu_firmware::learning::Kept;
use impromptu_flight::flight::Rates;
use impromptu_loops::complete::AxisFit;
use impromptu_sim::{controller::Controller, flight_log::FlightLog, flights::Loop};
use impromptu_training::{
    AxisGates, LearnError, LearnSettings, Learned, Pipeline, Purpose, Recipe, Trained, Validation, check_gates,
    coverage::{Coverage, coverage},
    derived, dithered_logs,
    files::model_files,
    in_words,
    learn::few_rows,
    learned_in_flight, minutes,
    observer::Observer as _,
    smoothing,
    supervised::Progress,
    write_model_files,
};
use serde::Serialize;

use movement::check_movement;
use vehicle::compared;

use super::{
    Invocation,
    configuration::checked,
    learned_file::kept,
    log_reading::LogReading,
    output::table,
    situation::{closed_loop, controller, flown_by, gains_conflict, milliseconds},
    trajectory::find,
};

/// Arguments of `train`.
#[derive(Debug, Args)]
#[command(after_help = columns::HELP)]
pub(super) struct Train {
    /// Flight logs of the baseline; two at least, every fourth one decides when to stop.
    #[arg(long, value_name = "FILE.csv", required_unless_present = "learned", num_args = 1..)]
    log: Vec<PathBuf>,
    /// Loop of the logs: `quadrotor`, or a description (`host-sim describe` drafts one). Both lanes, limits and monitor come from
    /// the logs alone.
    #[arg(long = "loop", value_name = "NAME|FILE.toml")]
    #[arg(conflicts_with_all = ["vehicle", "learned", "dithered", "smoothing_ms", "recipe"])]
    described: Option<String>,
    /// With --loop: axes that are trained; the others get what is desired [default: all].
    #[arg(long, value_name = "AXIS", num_args = 1.., requires = "described")]
    axis: Vec<String>,
    #[command(flatten)]
    reading: LogReading,
    /// Instead of logs, what was learned in flight without a model (`fly --keep`, or sent by a vehicle): its preview part becomes
    /// the network, the prior of what is learned next.
    #[arg(long, value_name = "FILE.learned", requires = "vehicle")]
    #[arg(conflicts_with_all = ["log", "delay_ms", "smoothing_ms", "force"])]
    learned: Option<PathBuf>,
    /// Logs with an independent dither on the position reference, for the feedback lane; those of --log if not given.
    #[arg(long, value_name = "FILE.csv", num_args = 1..)]
    dithered: Vec<PathBuf>,
    /// Age of the logged measurements, ms; the condition's if there is a vehicle [default: 24].
    #[arg(long, value_name = "N", value_parser = milliseconds)]
    delay_ms: Option<f64>,
    /// Zero-phase smoothing of the logs, ms; 0 for logs without noise [default: the recipe's, 60].
    #[arg(long, value_name = "N", value_parser = milliseconds)]
    smoothing_ms: Option<f64>,
    /// Vehicle (name or TOML file) for the validation flights on which the feedback lane is chosen, in the place of models from
    /// the logs; refused if it answers the logs' references otherwise than the logs show.
    #[arg(long, value_name = "NAME|FILE.toml")]
    vehicle: Option<String>,
    /// Gains of its position loop.
    #[arg(long, value_name = "NAME", default_value = "stock", requires = "vehicle")]
    gains: String,
    /// Loop that flies it: se3, pid, mellinger or mellinger_feed_forward.
    #[arg(long, value_name = "NAME", default_value = "se3", requires = "vehicle", value_parser = controller)]
    controller: Controller,
    /// Condition of the validation flights.
    #[arg(long, value_name = "NAME|FILE.toml", default_value = "lab", requires = "vehicle")]
    condition: String,
    /// Trajectories that shall be flown (name or CSV file): says what of them lies outside of what was trained on.
    #[arg(long, value_name = "NAME|FILE.csv", num_args = 1.., conflicts_with = "described")]
    test: Vec<String>,
    /// Name of the model and of its files.
    #[arg(long, default_value = "model", value_parser = file_name)]
    name: String,
    /// Train although a gate of `diagnose` failed or the rows are too few; the model's remarks say so.
    #[arg(long)]
    force: bool,
    /// Recipe as TOML, in the place of the configuration's `[recipe]`.
    #[arg(long, value_name = "FILE.toml")]
    recipe: Option<PathBuf>,
}

fn file_name(text: &str) -> Result<String, String> {
    let name = plain(text).map_err(|error| error.to_string())?;
    if name.len() <= 64 { Ok(name.to_owned()) } else { Err("expected a file name without folders, at most 64 bytes long".into()) }
}

/// What is printed as JSON.
#[derive(Debug, Serialize)]
struct Summary {
    name: String,
    seed: u64,
    logs: usize,
    rows: usize,
    bytes: usize,
    /// Design of the feedback lane, or `null`.
    feedback_lane: Option<String>,
    /// Why there is no feedback lane, or `null`.
    refusal: Option<String>,
    /// Gates of each axis.
    gates: Vec<AxisGates>,
    /// What --force overrode, or `null`.
    overridden: Option<String>,
    /// Flight that was learned from, minutes.
    minutes: f64,
    /// Of each axis what its lanes will do, where the feedback lane was chosen on the logs.
    axes: Vec<AxisFit>,
    /// What of the trajectories that shall be flown lies outside of what was trained on.
    coverage: Vec<Coverage>,
    files: Vec<PathBuf>,
}

/// Gates that the logs went through.
struct Passed {
    axes: Vec<AxisGates>,
    overridden: Option<String>,
}

/// What was made, and what was said of the logs before.
struct Made {
    learned: Learned,
    trained: Trained,
    gates: Vec<AxisGates>,
    overridden: Option<String>,
    /// Of each axis what its lane will do, where it was chosen on the logs.
    fits: Vec<AxisFit>,
    /// Flight that was learned from, minutes.
    minutes: f64,
}

fn read(paths: &[PathBuf], rate_hz: f64) -> Result<Vec<FlightLog>> {
    Ok(paths.iter().map(|path| FlightLog::read(path, rate_hz)).collect::<Result<_, _>>()?)
}

/// The logs' loop: what of it is known.
struct Origin {
    /// The simulated loop of the validation flights.
    closed_loop: Option<Loop>,
    /// The loop whose signals and rates the model has.
    template: Loop,
    delay_s: f64,
    smoothing_s: f64,
}

impl Train {
    pub(super) fn run(self, invocation: &Invocation) -> Result<()> {
        let seed = invocation.configuration.seed();
        if let Some(described) = &self.described {
            return any_loop::run(&self, described, invocation);
        }
        let recipe: Recipe = match &self.recipe {
            Some(path) => checked(path).context("--recipe")?,
            None => invocation.configuration.recipe().clone(),
        };
        let origin = self.origin(&recipe)?;
        let tests = self.test.iter().map(|name| find(name).context("--test")).collect::<Result<Vec<_>>>()?;
        invocation.console.note(&format!("seed {seed}"));
        let folder = invocation.configuration.folder()?;
        self.check_outputs(invocation, &folder)?;
        let Made { learned, trained, gates, overridden, fits, minutes } = match &self.learned {
            Some(path) => self.of_flight(path, invocation, &recipe, &origin, seed)?,
            None => self.of_logs(invocation, &recipe, origin, seed)?,
        };
        let Trained { lane, description, model } = trained;
        invocation.console.note(&in_words(&lane));
        let rate_hz = f64::from(description.timing.reference_rate_hz);
        let coverage = tests.into_iter().map(|motion| Ok(coverage(&description, &motion.sampled(rate_hz)?)));
        let coverage = coverage.collect::<Result<Vec<Coverage>>>()?;
        let (design, refusal) = match lane {
            Ok(choice) => (Some(choice.design), None),
            Err(reason) => (None, Some(reason.to_string())),
        };
        let files = write_model_files(&folder, &self.name, &learned, &description, &model)?;
        let trained = Summary {
            name: self.name,
            seed,
            logs: self.log.len(),
            rows: learned.rows.count,
            bytes: model.len(),
            feedback_lane: design,
            refusal,
            gates,
            overridden,
            minutes,
            axes: fits,
            coverage,
            files,
        };
        invocation.format.print(&trained, || text(&trained))
    }

    /// From logs, which pass the gates first.
    fn of_logs(&self, invocation: &Invocation, recipe: &Recipe, mut origin: Origin, seed: u64) -> Result<Made> {
        let rate_hz = f64::from(Rates::default().reference_hz());
        let (logs, dithered) = (read(&self.log, rate_hz)?, read(&self.dithered, rate_hz)?);
        check_movement(&logs)?;
        if self.vehicle.is_none() && self.delay_ms.is_none() {
            origin.delay_s = any_loop::age_of_flights(&logs, invocation);
        }
        let mut gates = self.pass_gates(invocation, &logs, origin.delay_s, seed)?;
        if let Some(closed_loop) = &origin.closed_loop {
            let differs =
                compared(self.vehicle.as_deref().unwrap_or_default(), self.force, invocation, closed_loop, &[&logs, &dithered])?;
            gates.overridden =
                Vec::from_iter(gates.overridden.into_iter().chain(differs)).into_iter().reduce(|a, b| a + "; " + &b);
        }
        invocation.console.stage(&format!("training on {} logs", logs.len()));
        let pipeline = origin.pipeline(recipe, seed, self.force)?;
        let learned = pipeline.learn(&logs, &mut watched(invocation, recipe)).map_err(|error| match error {
            few @ LearnError::FewRows { .. } => anyhow!("--log: {few}; --force trains all the same, and the model says so"),
            other => anyhow::Error::new(other).context("--log"),
        })?;
        invocation.console.finish();
        for log in &learned.broken {
            let error = log.largest_error;
            invocation.console.note(&format!("{}: left out, its loop broke down (largest error {error:.2} m)", log.name));
        }
        invocation.console.stage("designing the feedback lane");
        let overridden = self.overridden(invocation, recipe, &learned, gates.overridden, rate_hz);
        let identification = if dithered.is_empty() { &logs } else { &dithered };
        let others = self.dithered.iter().zip(&dithered).filter(|(path, _)| !self.log.contains(path)).map(|(_, log)| log);
        let minutes = minutes(&logs) + others.map(|log| minutes(std::slice::from_ref(log))).sum::<f64>();
        let remark =
            Vec::from_iter([Some(format!("{minutes:.1} min of flight")), overridden.clone()].into_iter().flatten()).join("; ");
        let (trained, fits) = match origin.closed_loop {
            Some(_) => (pipeline.complete(&learned, identification, &self.name, Some(&remark))?, Vec::new()),
            None => any_loop::beside(&pipeline, &learned, identification, &self.name, Some(&remark))?,
        };
        Ok(Made { learned, trained, gates: gates.axes, overridden, fits, minutes })
    }

    /// From what was learned in flight, beside the simulated loop.
    fn of_flight(&self, path: &Path, invocation: &Invocation, recipe: &Recipe, origin: &Origin, seed: u64) -> Result<Made> {
        let closed_loop = &origin.template;
        let kept = kept(path)?;
        let motions = Validation::strokes(recipe, closed_loop, &recipe.validation_speeds, seed)?.trajectories;
        let (recipe, learned) = learned_in_flight(recipe, &kept, closed_loop.rate_hz(), &motions)
            .with_context(|| format!("--learned {}", path.display()))?;
        invocation.console.stage("designing the feedback lane");
        let mut differs = None;
        let dithered = match self.dithered.as_slice() {
            [] => dithered_logs(&recipe.lane, closed_loop, derived(seed, Purpose::Identification))?,
            paths => {
                let logs = read(paths, closed_loop.rate_hz())?;
                differs = compared(self.vehicle.as_deref().unwrap_or_default(), self.force, invocation, closed_loop, &[&logs])?;
                logs
            }
        };
        let remark = "network: the preview part of what was learned in flight";
        let trained = origin.pipeline(&recipe, seed, false)?.complete(&learned, &dithered, &self.name, Some(remark))?;
        let learned_s = |kept: Kept<'_>| kept.axes().fold(0.0f32, |most, axis| most.max(axis.learned_s));
        let seconds = Kept::read(&kept).map_or(0.0, learned_s);
        let minutes = f64::from(seconds) / 60.0;
        Ok(Made { learned, trained, gates: Vec::new(), overridden: differs, fits: Vec::new(), minutes })
    }

    /// Why the arguments do not go together, if they do not.
    pub(super) fn conflict(&self) -> Option<String> {
        gains_conflict(&self.gains, self.controller)
    }

    /// Every file that is written must be writable, and none of those that are read.
    fn check_outputs(&self, invocation: &Invocation, folder: &Path) -> Result<()> {
        let named = [self.vehicle.as_deref(), Some(&self.condition)].into_iter().flatten().map(Path::new);
        let read = || self.log.iter().chain(&self.dithered).chain(&self.learned).chain(&self.recipe).map(PathBuf::as_path);
        for output in model_files(folder, &self.name)? {
            invocation.check_output(&output, read().chain(named.clone()))?;
        }
        Ok(())
    }

    /// What --force overrode, rows that are too few among it.
    fn overridden(
        &self,
        invocation: &Invocation,
        recipe: &Recipe,
        learned: &Learned,
        gates: Option<String>,
        rate_hz: f64,
    ) -> Option<String> {
        let few = few_rows(recipe, learned.rows.count, learned.held_out, rate_hz);
        let few = few.map(|few| format!("rows overridden by --force: {few}"));
        if let Some(few) = &few {
            invocation.console.note(&format!("warning: {few}"));
        }
        let all: Vec<String> = gates.into_iter().chain(few).collect();
        (!all.is_empty()).then(|| all.join("; "))
    }

    /// The gates of `diagnose`: the recipe's features are relative to now, so the gain has to be one as well.
    fn pass_gates(&self, invocation: &Invocation, logs: &[FlightLog], delay_s: f64, seed: u64) -> Result<Passed> {
        let axes = check_gates(logs, delay_s, seed);
        let failures: Vec<String> = axes.iter().flat_map(AxisGates::failures).collect();
        for prediction in axes.iter().filter_map(AxisGates::prediction) {
            invocation.console.note(&prediction);
        }
        for warning in axes.iter().flat_map(AxisGates::warnings) {
            invocation.console.note(&format!("warning: {warning}"));
        }
        let overridden = (!failures.is_empty()).then(|| format!("gates overridden by --force: {}", failures.join("; ")));
        if let Some(overridden) = &overridden {
            if !self.force {
                bail!("--log: {}; `host-sim diagnose` says more, --force trains all the same", failures.join("; "));
            }
            invocation.console.note(&format!("warning: {overridden}"));
        }
        Ok(Passed { axes, overridden })
    }

    fn origin(&self, recipe: &Recipe) -> Result<Origin> {
        let simulated = |vehicle| flown_by(closed_loop(vehicle, &self.gains, &self.condition)?, self.controller);
        let known = self.vehicle.as_deref().map(simulated).transpose()?;
        let delay_s = match (self.delay_ms, &known) {
            (Some(delay), _) => delay / 1e3,
            (None, Some(closed_loop)) => closed_loop.condition.measurement_delay_s,
            (None, None) => 0.024,
        };
        let smoothing_s = match (self.smoothing_ms, &known) {
            (Some(smoothing), _) => smoothing / 1e3,
            (None, Some(closed_loop)) => smoothing(recipe, closed_loop),
            (None, None) => recipe.smoothing_s,
        };
        let template = match &known {
            Some(closed_loop) => closed_loop.clone(),
            None => closed_loop("crazyflie", "stock", "lab")?,
        };
        Ok(Origin { closed_loop: known, template, delay_s, smoothing_s })
    }
}

impl Origin {
    /// The training of these logs: judged in flight if there is a simulated loop.
    fn pipeline(&self, recipe: &Recipe, seed: u64, keep_few: bool) -> Result<Pipeline<'_>> {
        let validation = self
            .closed_loop
            .as_ref()
            .map(|closed_loop| Validation::strokes(recipe, closed_loop, &recipe.validation_speeds, seed));
        Ok(Pipeline {
            settings: LearnSettings {
                measurement_delay_s: self.delay_s,
                smoothing_s: self.smoothing_s,
                keep_few,
                ..LearnSettings::new(recipe, seed)
            },
            template: &self.template,
            known: self.closed_loop.is_some(),
            validation: validation.transpose()?,
        })
    }
}

/// Passes epochs on; all trainings are one count.
fn watched<'a>(invocation: &'a Invocation, recipe: &Recipe) -> impl FnMut(Progress) + use<'a> {
    let of = (recipe.network.epochs * recipe.weight_decays.len() + recipe.fine_tuning.epochs) as u64;
    let mut done = 0;
    move |progress: Progress| {
        done += u64::from(progress.epoch > 0);
        invocation.console.steps(done, of);
    }
}

fn text(trained: &Summary) -> String {
    let lane = match (&trained.feedback_lane, &trained.refusal) {
        (Some(design), _) => design.clone(),
        (None, reason) => format!("none: {}", reason.as_deref().unwrap_or_default()),
    };
    let source = match trained.logs {
        0 => "what was learned in flight".to_owned(),
        logs => format!("{:.1} min of flight: {} rows of {logs} logs", trained.minutes, trained.rows),
    };
    let mut rows = vec![
        ["model".to_owned(), format!("{}, {} bytes, seed {}", trained.name, trained.bytes, trained.seed)],
        ["trained on".to_owned(), source],
        ["feedback lane".to_owned(), lane],
    ];
    rows.extend(trained.axes.iter().flat_map(any_loop::fit_rows));
    rows.extend(trained.coverage.iter().map(|coverage| ["test".to_owned(), coverage.words()]));
    rows.extend(trained.files.iter().map(|file| ["file".to_owned(), file.display().to_string()]));
    table(["", "result"], 2, rows)
}
