//! `host-sim evaluate`: models over unseen strokes, lane by lane.

use std::path::PathBuf;

use anyhow::{Context as _, Result};
use clap::Args;
use impromptu_experiment::evaluation::{learned, per_flight};
use impromptu_firmware::{adapter::Lanes, model::Model};
use impromptu_report::{Method, PerFlight, Row, summarise};
use impromptu_sim::{
    flights::Loop,
    trajectory::{Trajectory, strokes},
};
use impromptu_training::{Purpose, observer::Observer as _};
use serde::Serialize;

use super::{
    Invocation,
    model_file::{ModelFile, method},
    output::{number, table},
    situation::{Situation, learning, milliseconds, speed},
};

/// Arguments of `evaluate`.
#[derive(Debug, Args)]
#[command(after_help = "\
A row for each model and each of: the baseline, the network alone, the feedback lane alone, both lanes. With --learn also what
the loop learns in flight from nothing, and on top of each model with both lanes. Reductions are those of the RMS position error
against the baseline's flight of the same stroke: mean and worst over the strokes.

Examples:
  host-sim evaluate --learn 10 --controller pid --strokes 5
  host-sim evaluate --model models/model.impromptu
  host-sim evaluate --model a.impromptu --model b.impromptu --condition rough --speed 1,1.7 --format json
  host-sim evaluate --model models/model.impromptu --extra-delay-ms 20 --seed 5")]
pub(super) struct Evaluate {
    /// Model files.
    #[arg(long, value_name = "FILE", required_unless_present = "learn", num_args = 1..)]
    model: Vec<PathBuf>,
    /// Learns in flight: from SECONDS of motion of other strokes before each flight, and in it.
    #[arg(long, value_name = "SECONDS", value_parser = learning)]
    learn: Option<u32>,
    #[command(flatten)]
    situation: Situation,
    /// Factors on the speed of the strokes.
    #[arg(long, value_name = "FACTOR", default_value = "1", value_delimiter = ',', value_parser = speed)]
    speed: Vec<f64>,
    /// Number of strokes.
    #[arg(long, value_name = "N", default_value = "30", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    strokes: u32,
    /// Further delay of the whole position loop, ms.
    #[arg(long, value_name = "N", default_value = "0", value_parser = milliseconds)]
    extra_delay_ms: f64,
}

/// A row of the table.
#[derive(Debug, Serialize)]
struct ModelRow {
    model: String,
    #[serde(flatten)]
    row: Row,
}

/// What is printed as JSON.
#[derive(Debug, Serialize)]
struct Evaluation {
    seed: u64,
    strokes: u32,
    table: Vec<ModelRow>,
}

impl Evaluate {
    /// Why the arguments do not go together, if they do not.
    pub(super) fn conflict(&self) -> Option<String> {
        self.situation.conflict()
    }

    pub(super) fn run(self, invocation: &Invocation) -> Result<()> {
        let closed_loop = self.situation.closed_loop()?.delayed(self.extra_delay_ms / 1e3);
        let seed = invocation.configuration.seed();
        let files = self.model.iter().map(|path| ModelFile::read(path)).collect::<Result<Vec<_>>>()?;
        for file in &files {
            // Before the first flight: a refused file should not cost minutes.
            if let Some(text) = file.mismatch(&file.model()?, &self.situation) {
                invocation.console.note(&text);
            }
        }
        invocation.console.note(&format!("seed {seed}"));
        let test_seed = invocation.configuration.seed_of(Purpose::Test);
        let mut rows = Vec::new();
        let mut done = 0;
        let of = (self.speed.len() * (files.len() + usize::from(self.learn.is_some()))) as u64;
        for &speed in &self.speed {
            let trajectories = strokes(test_seed, self.strokes as usize, speed, closed_loop.rate_hz())?;
            let baseline = closed_loop.errors(&trajectories, None, 1.0, test_seed)?;
            let flights = Flights {
                closed_loop: &closed_loop,
                trajectories: &trajectories,
                baseline: &baseline,
                speed,
                test_seed,
                seed,
                learn: self.learn,
            };
            let mut add = |model: String, flights: &[PerFlight]| {
                rows.extend(summarise(flights).into_iter().map(|row| ModelRow { model: model.clone(), row }));
                done += 1;
                invocation.console.steps(done, of);
            };
            if self.learn.is_some() {
                add("none".into(), &flights.of_none()?);
            }
            for file in &files {
                add(file.name(), &flights.of(file).with_context(|| file.name())?);
            }
        }
        invocation.console.finish();
        let evaluation = Evaluation { seed, strokes: self.strokes, table: rows };
        invocation.format.print(&evaluation, || text(&evaluation))
    }
}

/// The strokes and how the baseline flew them.
struct Flights<'a> {
    closed_loop: &'a Loop,
    trajectories: &'a [Trajectory],
    baseline: &'a [f64],
    speed: f64,
    test_seed: u64,
    seed: u64,
    learn: Option<u32>,
}

impl Flights<'_> {
    /// Every flight of the baseline and of a model: network, feedback lane, both.
    fn of(&self, file: &ModelFile) -> Result<Vec<PerFlight>> {
        let model = file.model()?;
        let mut flights = self.scored(Method::Baseline, self.baseline);
        for (network, feedback) in [(true, false), (false, true), (true, true)] {
            if (network && model.network().is_none()) || (feedback && model.feedback().is_none()) {
                continue;
            }
            let lanes = Lanes { network, feedback };
            let errors = self.closed_loop.errors(self.trajectories, Some((&model, lanes)), 1.0, self.test_seed)?;
            flights.extend(self.scored(method(&model, lanes), &errors));
        }
        flights.extend(self.learned(Some((&model, Lanes::BOTH)), Method::FullLearned)?);
        Ok(flights)
    }

    /// Every flight of the baseline, and of what is learned from nothing.
    fn of_none(&self) -> Result<Vec<PerFlight>> {
        let mut flights = self.scored(Method::Baseline, self.baseline);
        flights.extend(self.learned(None, Method::Learned)?);
        Ok(flights)
    }

    fn learned(&self, model: Option<(&Model<'_>, Lanes)>, method: Method) -> Result<Vec<PerFlight>> {
        let Some(seconds) = self.learn else { return Ok(Vec::new()) };
        let errors = learned(self.closed_loop, model, self.trajectories, self.speed, self.test_seed, seconds)?;
        Ok(self.scored(method, &errors))
    }

    fn scored(&self, method: Method, errors: &[f64]) -> Vec<PerFlight> {
        per_flight(self.closed_loop, self.trajectories, self.speed, method, errors, self.baseline, self.seed)
    }
}

fn text(evaluation: &Evaluation) -> String {
    let rows = evaluation.table.iter().map(|ModelRow { model, row }| {
        let reduction = |value| if row.method == Method::Baseline { String::new() } else { number(value, 1) };
        [
            model.clone(),
            format!("{} {} {}", row.vehicle, row.gains, row.condition),
            row.method.name().to_owned(),
            format!("{}x", row.speed),
            number(row.rms_cm_mean, 3),
            reduction(row.reduction_mean),
            reduction(row.reduction_worst),
        ]
    });
    let header = ["model", "flown", "method", "speed", "RMS error, cm", "mean, %", "worst, %"];
    let table = table(header, 3, rows);
    format!("{} unseen strokes, seed {}: reduction of the RMS position error\n{table}", evaluation.strokes, evaluation.seed)
}
