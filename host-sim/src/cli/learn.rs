//! `host-sim learn`: what learning in flight would have left of the flights of a log.

mod report;

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use clap::Args;
use impromptu_experiment::{
    replay::{Flight, Replay},
    second_order::Known,
};
use impromptu_files::replacement::replace;
use impromptu_report::{render_study, write_page};
use impromptu_training::{
    channel::{AXES, largest_distance},
    largest_sound_error,
    observer::Observer as _,
    track::{Columns, tracks},
};

use super::{
    Invocation,
    log_reading::{LogReading, say},
    situation::{milliseconds, within},
};

/// Arguments of `learn`.
#[derive(Debug, Args)]
#[command(after_help = "\
Each log is a flight (or run) of the same loop without an add-on, in the order of the command line. The learner of the firmware
flies along: it is shown what was desired and measured, makes the correction that it would have made with what the flights before
had taught it, and then learns from this one. What would have been left is the recorded error and what the response makes of that
correction. It is a PREDICTION: nothing was flown, and a loop that answers otherwise than the response is left with another error;
how much if it is a fifth slower or a quarter faster is said. The first and last 80 ticks of a flight are not counted, for nobody
knows what was desired before and behind the log.

A log is a CSV file with a header, one row a tick at a uniform rate; lost rows are filled. Columns that are known:
  time_s, desired_x_m, measured_x_m, … y, z    as `collect` writes it and `train` reads it; with measured_vx_m_s if there is one
  t, px, sp_ctrltarget_x, … y, z               motion capture beside a Crazyflie; with vx if there is one
  time, ctrltarget.x, stateEstimate.x, … y, z  a Crazyflie's own log, the dots as it writes them
  time_s, reference (or desired), measured     any loop, in its own units; with rate if there is one
--columns names other columns, once for each axis; if two columns could be meant it is asked for (exit code 2). A rate of change
that the log does not have is the difference of the measured value, low-passed over a tick. Cut the log to the part in which the
loop is flown: no take-off, no landing.

The learner runs at the log's rate, or at a multiple or part of it, so that the response has settled in about 80 ticks; values
between rows are interpolated linearly, so that such a tick knows a share of the row to come. What of the response is not given is
found from the first two logs. One response stands for all axes; if it misses the logs by much, the prediction is worth little.

Written into --out: learn.html, a page with a figure in which the predicted error melts flight after flight; learn.learned, what
was learned of all of them, for a learner of the same axes (`model-export inspect learn.learned`).

Examples:
  host-sim learn --log host-sim/reproduction/data/nanobench/*.csv
  host-sim learn --log monday.csv tuesday.csv wednesday.csv
  host-sim learn --log flights/*.csv --axis x y --format json
  host-sim learn --log run*.csv --columns t,setpoint,angle,speed --frequency 8 --damping 0.7 --delay-ms 20")]
pub(super) struct Learn {
    /// Logs of one loop, in the order in which they were flown.
    #[arg(long, value_name = "FILE.csv", num_args = 1.., required = true)]
    log: Vec<PathBuf>,
    /// Columns of time in s, reference, measured value and, if there is one, its rate of change a second; once for each axis.
    #[arg(long, value_name = "TIME,REFERENCE,MEASURED[,RATE]", num_args = 1.., value_parser = named)]
    columns: Vec<Columns>,
    /// Axes of the logs; all if not given.
    #[arg(long, value_name = "AXIS", num_args = 1.., value_parser = AXES, conflicts_with = "columns")]
    axis: Vec<String>,
    /// Gain at rest of the response from the reference to the measured value [default: 1].
    #[arg(long, value_name = "N", value_parser = gain)]
    gain: Option<f64>,
    /// Its natural frequency, rad/s [default: found from the first two logs].
    #[arg(long, value_name = "RAD/S", value_parser = frequency)]
    frequency: Option<f64>,
    /// Its damping ratio [default: found from the first two logs].
    #[arg(long, value_name = "N", value_parser = damping)]
    damping: Option<f64>,
    /// Its delay, ms [default: found from the first two logs].
    #[arg(long, value_name = "N", value_parser = milliseconds)]
    delay_ms: Option<f64>,
    #[command(flatten)]
    reading: LogReading,
}

fn named(text: &str) -> Result<Columns, String> {
    let names: Vec<&str> = text.split(',').map(str::trim).collect();
    let of = |time: &str, reference: &str, measured: &str, rate: Option<&str>| Columns {
        time: time.into(),
        reference: reference.into(),
        measured: measured.into(),
        rate: rate.map(str::to_owned),
    };
    match names.as_slice() {
        [time, reference, measured] => Ok(of(time, reference, measured, None)),
        [time, reference, measured, rate] => Ok(of(time, reference, measured, Some(rate))),
        _ => Err("expected three or four names of columns with commas between them".into()),
    }
}

fn gain(text: &str) -> Result<f64, String> {
    within(text, 0.01, 100.0)
}

fn frequency(text: &str) -> Result<f64, String> {
    within(text, 0.01, 1e3)
}

fn damping(text: &str) -> Result<f64, String> {
    within(text, 0.05, 5.0)
}

impl Learn {
    pub(super) fn run(self, invocation: &Invocation) -> Result<()> {
        let folder = invocation.configuration.folder()?;
        let [page, state] = ["learn.html", "learn.learned"].map(|name| folder.join(name));
        for output in [&page, &state] {
            invocation.check_output(output, self.log.iter().map(PathBuf::as_path))?;
        }
        let flights = self.flights(invocation)?;
        invocation.console.stage("replaying");
        let known = Known {
            gain: self.gain,
            frequency: self.frequency,
            damping: self.damping,
            delay_s: self.delay_ms.map(|delay| delay / 1e3),
        };
        let replay = Replay::of(&flights, &known).context("--log")?;
        let learned = replay.learned.clone();
        let replayed = report::Replayed::new(replay, &flights);
        invocation.console.finish();
        let study = replayed.study(invocation.configuration.seed(), &invocation.command);
        write_page(&render_study(&study)?, &page)?;
        replace(&state, &learned).with_context(|| state.display().to_string())?;
        invocation.console.note(&format!("figure: {}", page.display()));
        invocation.console.note(&format!("learned: {}", state.display()));
        invocation.format.print(&replayed, || replayed.text())
    }

    /// The flights; those in which the loop broke down are left out, as `train` and `diagnose` do.
    fn flights(&self, invocation: &Invocation) -> Result<Vec<Flight>> {
        let read = |path: &PathBuf| {
            let tracks = tracks(path, &self.columns, &self.axis, &self.reading.reading()).context("--log")?;
            let name = name(path);
            say(invocation, &name, tracks.iter().flat_map(|track| &track.notes));
            Ok(Flight { name, tracks })
        };
        let mut flights = self.log.iter().map(read).collect::<Result<Vec<_>>>()?;
        let error = |flight: &Flight| {
            largest_distance(flight.tracks.iter().map(|track| (track.measured.as_slice(), track.reference.as_slice())))
        };
        let bound = largest_sound_error(&flights.iter().map(error).collect::<Vec<_>>());
        flights.retain(|flight| {
            let error = error(flight);
            let sound = error <= bound;
            if !sound {
                invocation.console.note(&format!(
                    "{}: up to {error:.3} from the reference, beside {bound:.3} in a usual log at most: the loop broke down; \
                     left out",
                    flight.name
                ));
            }
            sound
        });
        Ok(flights)
    }
}

/// A log's name without folder and ending.
fn name(path: &Path) -> String {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
