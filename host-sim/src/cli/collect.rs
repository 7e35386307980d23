//! `host-sim collect`: flights of the baseline as CSV logs.

mod next;

use std::path::PathBuf;

use anyhow::{Context as _, Result, bail};
use clap::{Args, ValueEnum};
use impromptu_sim::{flight_log::FlightLog, rollout::Dither};
use impromptu_training::{
    FlightSet, Purpose, Recipe, Signal,
    files::write_log,
    observer::Observer as _,
    rehearsal::{Rehearsed, lost, rehearse},
};
use serde::Serialize;

use super::{
    Invocation,
    log_reading::LogReading,
    output::table,
    situation::{Situation, within},
};

/// Flights of each kind unless told otherwise: the recipe's hundreds would be half a gigabyte of text.
const FLIGHTS: u32 = 20;

/// Arguments of `collect`.
#[derive(Debug, Args)]
#[command(after_help = "\
Writes a CSV file for each flight into --out, with the columns that `train --help` lists. Without --signal the recipe decides what
is flown ([recipe] of --config). With --dither, random steps on the position reference excite the loop independently: what
the feedback lane is identified from. All flights are rehearsed smaller first, and flown as large as the loop was seen to follow.

Examples:
  host-sim collect --condition lab --flights 4 --out logs
  host-sim collect --condition lab --out logs
  host-sim collect --condition lab --dither 0.01 --out dithered
  host-sim collect --next --log logs/*.csv --out next
  host-sim collect --vehicle hummingbird --gains soft --signal multisine spline --flights 4 --seconds 90 --out logs")]
pub(super) struct Collect {
    #[command(flatten)]
    situation: Situation,
    /// Forms of the flights; the recipe's if not given.
    #[arg(long, value_enum, value_name = "SIGNAL", num_args = 1..)]
    signal: Vec<SignalName>,
    /// Flights of each kind; the recipe's number if not given, but at most 20.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=9_999))]
    flights: Option<u32>,
    /// Length of multisine and spline flights, s; the recipe's if not given. Strokes are as long as they are.
    #[arg(long, value_name = "S", value_parser = seconds)]
    seconds: Option<f64>,
    /// Random steps on the position reference, this high, m (0.01 is usual).
    #[arg(long, value_name = "M", value_parser = metres)]
    dither: Option<f64>,
    /// Flies nothing: says what the logs of --log lack, whether another flight pays, and writes the one that tells most, no
    /// larger, faster or harder than they were, into --out.
    #[arg(long, requires = "log")]
    #[arg(conflicts_with_all = ["vehicle", "gains", "controller", "condition", "signal", "flights", "seconds", "dither"])]
    next: bool,
    /// With --next: logs so far.
    #[arg(long, value_name = "FILE.csv", num_args = 1.., requires = "next")]
    log: Vec<PathBuf>,
    /// With --next: loop of the logs, `quadrotor` or a description (`host-sim describe` drafts one).
    #[arg(long = "loop", value_name = "NAME|FILE.toml", default_value = "quadrotor", requires = "next")]
    described: String,
    #[command(flatten)]
    reading: LogReading,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum SignalName {
    /// Twelve tones an axis.
    Multisine,
    /// A spline through random points.
    Spline,
    /// Strokes like those of the test, of other seeds.
    Strokes,
}

impl SignalName {
    fn signal(self) -> Signal {
        match self {
            Self::Multisine => Signal::Multisine,
            Self::Spline => Signal::Spline,
            Self::Strokes => Signal::Strokes,
        }
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    within(text, 6.0, 3590.0)
}

fn metres(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|value| *value > 0.0 && *value <= 1.0).ok_or_else(|| "expected a number above 0, up to 1".into())
}

/// What is printed as JSON.
#[derive(Debug, Serialize)]
struct Collected {
    seed: u64,
    /// Length of all logs, minutes.
    minutes: f64,
    logs: Vec<Log>,
    /// Trajectories in which the vehicle was lost: there is no log of them.
    lost: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Log {
    file: String,
    trajectory: String,
    seconds: f64,
}

impl Collect {
    /// Why the arguments do not go together, if they do not.
    pub(super) fn conflict(&self) -> Option<String> {
        self.situation.conflict()
    }

    pub(super) fn run(self, invocation: &Invocation) -> Result<()> {
        if self.next {
            return next::run(&self.log, &self.described, self.reading, invocation);
        }
        let closed_loop = self.situation.closed_loop()?;
        let recipe = invocation.configuration.recipe();
        let training_flights = self.training_flights(recipe);
        if training_flights.is_empty() {
            bail!("the recipe names no training flights; give --signal");
        }
        let folder = invocation.configuration.folder()?;
        let seed = invocation.configuration.seed();
        invocation.console.note(&format!("seed {seed}"));
        let dither = self.dither.map(|amplitude| Dither { amplitude, hold_s: recipe.lane.dither_hold_s });
        let purpose = if dither.is_some() { Purpose::Identification } else { Purpose::Training };
        let mut first = invocation.configuration.seed_of(purpose);
        let mut logs = Vec::new();
        let mut lost_flights = Vec::new();
        for (index, asked) in (1..).zip(&training_flights) {
            let kind = name(asked.signal);
            let Rehearsed { flights, share, largest_error, lost: in_rehearsal } =
                rehearse(&closed_loop, asked, dither, first).with_context(|| format!("{index}-{kind}"))?;
            if share < 1.0 {
                invocation.console.note(&format!(
                    "{index}-{kind}: flown at {:.2} m/s instead of {:.2}: beyond it the loop's error grows faster than what it \
                     is asked ({in_rehearsal} of its rehearsals were lost)",
                    flights.max_speed, asked.max_speed
                ));
            }
            let flown = closed_loop.collect(&flights.motions(first), dither, first)?;
            for (flight, log) in (1..).zip(&flown) {
                if lost(log, largest_error) {
                    invocation
                        .console
                        .note(&format!("{index}-{kind}-{flight:04}: the vehicle was lost; no log of it is written"));
                    lost_flights.push(log.name.clone());
                    continue;
                }
                let dithered = if dither.is_some() { "-dithered" } else { "" };
                let file = folder.join(format!("{index}-{kind}{dithered}-{flight:04}.csv"));
                invocation.check_output(&file, self.situation.files())?;
                write_log(log, &file)?;
                logs.push(entry(log, file.display().to_string()));
            }
            first = first.wrapping_add(u64::from(asked.flights));
            invocation.console.steps(index, training_flights.len() as u64);
        }
        invocation.console.finish();
        let minutes = logs.iter().map(|log| log.seconds).sum::<f64>() / 60.0;
        let collected = Collected { seed, minutes, logs, lost: lost_flights };
        invocation.format.print(&collected, || text(&collected))
    }

    /// What is flown: the recipe's flights, or those asked for with the recipe's figures where it has any.
    fn training_flights(&self, recipe: &Recipe) -> Vec<FlightSet> {
        let dithered = recipe.lane.dithered_flights;
        let usual = if self.dither.is_some() { vec![dithered] } else { recipe.training_flights.clone() };
        let chosen: Vec<FlightSet> = match self.signal.as_slice() {
            [] => usual,
            names => names
                .iter()
                .flat_map(|name| {
                    let signal = name.signal();
                    let found: Vec<FlightSet> = usual.iter().copied().filter(|usual| usual.signal == signal).collect();
                    if found.is_empty() { vec![FlightSet { signal, ..dithered }] } else { found }
                })
                .collect(),
        };
        chosen
            .into_iter()
            .map(|flight_set| FlightSet {
                flights: self.flights.unwrap_or(flight_set.flights.min(FLIGHTS)),
                seconds: self.seconds.unwrap_or(flight_set.seconds),
                ..flight_set
            })
            .collect()
    }
}

fn name(signal: Signal) -> &'static str {
    match signal {
        Signal::Multisine => "multisine",
        Signal::Spline => "spline",
        Signal::Strokes => "strokes",
    }
}

fn entry(log: &FlightLog, file: String) -> Log {
    Log { file, trajectory: log.name.clone(), seconds: log.rows.len() as f64 / log.rate_hz }
}

fn text(collected: &Collected) -> String {
    let rows = collected.logs.iter().map(|log| [log.file.clone(), log.trajectory.clone(), format!("{:.1}", log.seconds)]);
    let sum = ["together".to_owned(), format!("{:.1} min", collected.minutes), String::new()];
    table(["log", "trajectory", "seconds"], 2, rows.chain([sum]))
}
