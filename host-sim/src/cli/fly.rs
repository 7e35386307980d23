//! `host-sim fly`: one trajectory, with and without the add-on.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use anyhow::{Context as _, Result, bail};
use clap::{Args, ValueEnum};
use impromptu_experiment::evaluation::per_flight;
use impromptu_files::text::line;
use impromptu_firmware::{
    adapter::Lanes,
    guard::{Trip, Trips},
    learning::Parts,
};
use impromptu_flight::learning::KEPT;
use impromptu_pil::LinkKind;
use impromptu_report::{Method, PerFlight};
use impromptu_sim::{
    controller::Controller,
    flights::{Guessed, Response},
    learned::{LearningLoop, taught, teaching},
    rollout::{FlightPlan, FlightRecord},
    trajectory::strokes,
};
use impromptu_training::{Purpose, files::write_log};
use serde::Serialize;

use super::{
    Invocation,
    learned_file::{keep, kept},
    model_file::{ModelFile, method},
    output::{number, table},
    processor::{Flights, Learn},
    situation::{Situation, learning, milliseconds, speed},
    trajectory,
};

/// Arguments of `fly`.
#[derive(Debug, Args)]
#[command(after_help = "\
Prints the RMS position error of the baseline and of the add-on in cm, and the reduction in %. Without --model the baseline
flies alone. The log has the columns that `train --help` lists, and the true position.

Examples:
  host-sim fly --trajectory figure8
  host-sim fly --model models/model.impromptu --trajectory letters:HI --speed 1.7 --log hi.csv
  host-sim fly --model models/model.impromptu --trajectory own.csv --condition rough --extra-delay-ms 20 --lanes network
  host-sim fly --trajectory figure8 --controller pid
  host-sim fly --trajectory figure8 --learn 60 --controller pid --keep pid.learned
  host-sim fly --trajectory star --learn --controller pid --recall pid.learned
  host-sim fly --pil --model models/model.impromptu
  host-sim fly --pil --learn --strokes 10 --keep own.learned")]
pub(super) struct Fly {
    /// Model file; without it the baseline flies alone.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Name (see `trajectory --list`) or CSV file of the trajectory; not needed with --pil, which flies unseen strokes.
    #[arg(long, value_name = "NAME|FILE.csv", required_unless_present = "pil")]
    trajectory: Option<String>,
    #[command(flatten)]
    situation: Situation,
    /// Factor on the speed.
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = speed)]
    speed: f64,
    /// Further delay of the whole position loop, ms.
    #[arg(long, value_name = "N", default_value = "0", value_parser = milliseconds)]
    extra_delay_ms: f64,
    /// Lanes of the model that are on.
    #[arg(long, value_enum, default_value_t, requires = "model")]
    lanes: LaneChoice,
    /// Learns in flight, from nothing or on top of the model: from SECONDS of motion of other strokes, and on the way. With --pil
    /// and no SECONDS: on the microcontroller, from each stroke for the next ones.
    #[arg(long, value_name = "SECONDS", num_args = 0..=1, default_missing_value = "0")]
    #[arg(value_parser = learning)]
    learn: Option<u32>,
    /// With --learn: file for what was learned, of the loop and beside the model that were flown.
    #[arg(long, value_name = "OUT", requires = "learn")]
    keep: Option<PathBuf>,
    /// With --learn and no SECONDS: goes on with what --keep wrote, responses included.
    #[arg(long, value_name = "FILE", requires = "learn")]
    recall: Option<PathBuf>,
    /// Flies through the firmware on the emulated microcontroller, which it builds.
    #[arg(long)]
    pil: bool,
    /// With --pil: how the firmware is reached.
    #[arg(long, value_enum, default_value_t, requires = "pil")]
    link: LinkKind,
    /// With --pil and without --trajectory: number of strokes.
    #[arg(long, value_name = "N", default_value = "30", requires = "pil")]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=10_000))]
    strokes: u32,
    /// CSV file for the log of the last flight: the one that learns, the model's, or the baseline's.
    #[arg(long, value_name = "OUT.csv", conflicts_with = "pil")]
    log: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum LaneChoice {
    /// Network and feedback.
    #[default]
    Both,
    /// The network alone: the add-on of the paper.
    Network,
    /// The feedback lane alone.
    Feedback,
    /// None: the baseline, to the bit.
    None,
}

impl LaneChoice {
    fn lanes(self) -> Lanes {
        Lanes { network: matches!(self, Self::Both | Self::Network), feedback: matches!(self, Self::Both | Self::Feedback) }
    }
}

/// What is printed as JSON.
#[derive(Debug, Serialize)]
struct Flown {
    model: Option<String>,
    extra_delay_ms: f64,
    flights: Vec<PerFlight>,
    /// Trips of the guard in the add-on's flight, if there were any.
    #[serde(skip_serializing_if = "Option::is_none")]
    trips: Option<Tripped>,
    log: Option<PathBuf>,
}

/// How often the guard took a lane off.
#[derive(Debug, Serialize)]
struct Tripped {
    by_reason: BTreeMap<&'static str, u16>,
    network: u16,
    feedback: u16,
}

impl Tripped {
    fn of(trips: &Trips) -> Option<Self> {
        let reasons = Trip::ALL.into_iter().map(|trip| (trip.name(), trips.of(trip))).filter(|(_, count)| *count > 0);
        let by_reason: BTreeMap<_, _> = reasons.collect();
        let [network, feedback] = trips.by_lane();
        (!by_reason.is_empty()).then_some(Self { by_reason, network, feedback })
    }

    fn text(&self) -> String {
        let reasons: Vec<_> = self.by_reason.iter().map(|(name, count)| format!("{name} {count}")).collect();
        format!("guard: network off {} times, feedback off {} times ({})\n", self.network, self.feedback, reasons.join(", "))
    }
}

impl Fly {
    /// Why the arguments do not go together, if they do not.
    pub(super) fn conflict(&self) -> Option<String> {
        let controller = self.situation.controller;
        if self.recall.is_some() && self.learn.is_some_and(|seconds| seconds > 0) {
            return Some("--recall: it goes on with what was kept; leave out the SECONDS of --learn".into());
        }
        if self.pil && self.learn.is_some_and(|seconds| seconds > 0) {
            return Some("--pil: it learns from each stroke for the next ones; leave out the SECONDS of --learn".into());
        }
        let elsewhere = self.pil && controller != Controller::Se3;
        let reason = || format!("--pil: the firmware flies its own loop, se3; leave out --controller {}", controller.name());
        elsewhere.then(reason).or_else(|| self.situation.conflict())
    }

    pub(super) fn run(self, invocation: &Invocation) -> Result<()> {
        if let Some(log) = &self.log {
            let inputs = self.model.as_deref().into_iter().chain(self.trajectory.as_deref().map(Path::new));
            invocation.check_output(log, inputs.chain(self.situation.files()))?;
        }
        if let Some(keep) = &self.keep {
            let inputs = self.model.as_deref().into_iter().chain(self.log.as_deref());
            invocation.check_output(keep, inputs.chain(self.situation.files()))?;
        }
        let closed_loop = self.situation.closed_loop()?.delayed(self.extra_delay_ms / 1e3);
        let trajectory = match &self.trajectory {
            Some(name) => Some(trajectory::find(name)?.scaled(self.speed).sampled(closed_loop.rate_hz())?),
            None => None,
        };
        let file = self.model.as_deref().map(ModelFile::read).transpose()?;
        let model = file.as_ref().map(ModelFile::model).transpose()?;
        if let (Some(model), Some(file)) = (&model, &file)
            && let Some(text) = file.mismatch(model, &self.situation)
        {
            invocation.console.note(&text);
        }
        if let (Some(model), Some(file)) = (&model, &file)
            && self.lanes.lanes().feedback
            && model.feedback().is_none()
        {
            if self.lanes == LaneChoice::Feedback {
                bail!("{}: has no feedback lane; give --lanes network", file.name());
            }
            invocation.console.note(&format!("{}: has no feedback lane, its network flies alone", file.name()));
        }
        if self.pil {
            let strokes = || {
                strokes(invocation.configuration.seed_of(Purpose::Test), self.strokes as usize, self.speed, closed_loop.rate_hz())
            };
            let trajectories = trajectory.map_or_else(strokes, |trajectory| Ok(vec![trajectory]))?;
            let flights = Flights {
                closed_loop: &closed_loop,
                trajectories: &trajectories,
                speed: self.speed,
                file: file.as_ref(),
                lanes: self.lanes.lanes(),
                link: self.link,
                learn: self.learn.map(|_| Learn { keep: self.keep.as_deref(), recall: self.recall.as_deref() }),
            };
            return flights.run(invocation);
        }
        let Some(trajectory) = trajectory else { bail!("--trajectory is missing") };
        let seed = invocation.configuration.seed();
        let flight_seed = invocation.configuration.seed_of(Purpose::Test);
        invocation.console.note(&format!("seed {seed}"));
        let baseline = FlightPlan { log: model.is_none() && self.learn.is_none(), ..FlightPlan::new(&trajectory, flight_seed) };
        let mut methods = vec![Method::Baseline];
        let mut plans = vec![baseline];
        if let Some(model) = &model {
            let lanes = self.lanes.lanes();
            plans.push(FlightPlan { log: true, ..FlightPlan::new(&trajectory, flight_seed).with(model, lanes) });
            methods.push(method(model, lanes));
        }
        let mut records =
            closed_loop.fly(&plans).with_context(|| file.as_ref().map_or_else(|| trajectory.name.clone(), ModelFile::name))?;
        if let Some(seconds) = self.learn {
            let model = model.as_ref().map(|model| (model, self.lanes.lanes()));
            let learned = LearningLoop {
                closed_loop: &closed_loop,
                model,
                parts: Parts::BOTH,
                response: Response::Commissioned,
                seed: flight_seed,
            };
            let checksum = model.map(|(model, _)| model.checksum());
            let mut learning = match &self.recall {
                Some(path) => {
                    let mut learning = closed_loop.learning(&Guessed::RIGHT)?;
                    learning.recall(checksum, &kept(path)?).with_context(|| path.display().to_string())?;
                    learning
                }
                None => taught(&learned, seconds, &teaching(flight_seed, seconds, self.speed, closed_loop.rate_hz())?)?.0,
            };
            let plan = FlightPlan { model, log: true, ..FlightPlan::new(&trajectory, flight_seed) };
            records.push(closed_loop.fly_learning(&plan, &mut learning)?);
            if let Some(path) = &self.keep {
                let mut bytes = [0; KEPT];
                let kept = learning.keep(checksum, &mut bytes).context("--keep: no response is known")?;
                keep(path, kept, invocation)?;
            }
            methods.push(if model.is_some() { Method::FullLearned } else { Method::Learned });
        }
        if let Some(path) = &self.log {
            write_last(&records, path)?;
            invocation.console.note(&format!("log: {}", path.display()));
        }
        let baseline = records[0].rms;
        let trajectory = std::slice::from_ref(&trajectory);
        let flights = records.iter().zip(methods).flat_map(|(record, method)| {
            per_flight(&closed_loop, trajectory, self.speed, method, &[record.rms], &[baseline], seed)
        });
        let flown = Flown {
            model: file.as_ref().map(ModelFile::name),
            extra_delay_ms: self.extra_delay_ms,
            flights: flights.collect(),
            trips: records.last().and_then(|record| Tripped::of(&record.trips)),
            log: self.log,
        };
        invocation.format.print(&flown, || text(&flown))
    }
}

fn write_last(records: &[FlightRecord], path: &Path) -> Result<()> {
    let Some(log) = records.last().and_then(|record| record.log.as_ref()) else { return Ok(()) };
    let finite = |row: &impromptu_sim::flight_log::LogRow| {
        row.measured_position.iter().chain(&row.true_position.unwrap_or_default()).all(|x| x.is_finite())
    };
    if !log.rows.iter().all(finite) {
        bail!("{}: not written, the flight left the numbers; fly slower or with other gains", path.display());
    }
    Ok(write_log(log, path)?)
}

fn text(flown: &Flown) -> String {
    let rows = flown.flights.iter().map(|flight| {
        [
            flight.method.name().to_owned(),
            number(flight.rms_cm, 3),
            if flight.method == Method::Baseline { String::new() } else { number(flight.reduction, 1) },
        ]
    });
    let head = flown.flights.first().map_or_else(String::new, |flight| {
        let text =
            format!("{} at {}x speed: {} {} {}", flight.trajectory, flight.speed, flight.vehicle, flight.gains, flight.condition);
        line(&text).into_owned() + "\n"
    });
    head + &table(["method", "RMS error, cm", "reduction, %"], 1, rows)
        + &flown.trips.as_ref().map_or_else(String::new, Tripped::text)
}
