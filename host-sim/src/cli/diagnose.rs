//! `host-sim diagnose`: whether an add-on will help a loop, and by how much.

#[cfg(test)]
mod tests;

use std::path::PathBuf;

use anyhow::{Context as _, Result, bail};
use clap::{Args, ValueEnum};
use impromptu_diagnosis::{Diagnosis, DiagnosisError, Record, Settings, diagnose};
use impromptu_files::text::line;
use impromptu_sim::{
    flight_log::FlightLog,
    flights::Loop,
    rollout::FlightPlan,
    trajectory::{Sample, Trajectory},
};
use impromptu_training::{
    FlightSet, Purpose, Recipe,
    channel::{AXES, Channel, largest_distance, of_logs, read},
    largest_sound_error,
    observer::Observer as _,
};
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;

use super::{
    Invocation,
    log_reading::{LogReading, say},
    situation::{closed_loop, hertz, milliseconds},
};

/// Arguments of `diagnose`.
#[derive(Debug, Args)]
#[command(after_help = "\
A log is a CSV file with a header, one row a tick at a uniform rate, of the baseline without an add-on:
  time_s, reference (or desired), measured     any loop, in its own units; --columns names other columns
  time_s, desired_x_m, measured_x_m, … y, z    a flight log as `collect` writes it and `train` reads it; other columns are ignored
Log steps of random height, or five tones and more, over the band that will be flown, for some hundred times the loop's response.
measured is what the loop was told; if that is old, say how old with --delay-ms. Time on the ground before take-off and after
landing is left out where it shows; cut it if it does not, and failures with it.

Relative degree, gain, zeros and bandwidth are those of the reference to the measured value at the sub-rate. Intervals hold 95 \
% of the
linear models that could be the true one; at the lower end of the predicted reduction, what the log leaves unexplained is the \
loop's doing and
comes again, 1.8 times as large. The prediction is about a linear window over the desired output, trained on such a log and \
flown along signals
of the log's kind: measured errors, so with the noise in them.

Examples:
  host-sim diagnose --vehicle crazyflie --gains stock --condition lab --axis x z
  host-sim diagnose --log monday.csv tuesday.csv --delay-ms 24
  host-sim diagnose --log motor.csv --columns t,setpoint,angle --sub-rate 50")]
pub(super) struct Diagnose {
    /// Logs of one loop.
    #[arg(long, value_name = "FILE.csv", num_args = 1.., required_unless_present = "vehicle", conflicts_with = "vehicle")]
    log: Vec<PathBuf>,
    /// Columns of time in s, reference and measured value.
    #[arg(long, value_name = "TIME,REFERENCE,MEASURED", requires = "log", value_parser = three)]
    columns: Option<Columns>,
    /// Vehicle (name or TOML file) that is tested in the simulator, in the place of logs.
    #[arg(long, value_name = "NAME|FILE.toml")]
    vehicle: Option<String>,
    /// Gains of its position loop.
    #[arg(long, value_name = "NAME", default_value = "stock", requires = "vehicle")]
    gains: String,
    /// Condition of the test.
    #[arg(long, value_name = "NAME|FILE.toml", default_value = "lab", requires = "vehicle")]
    condition: String,
    /// What is flown in the test.
    #[arg(long, value_enum, default_value_t, requires = "vehicle")]
    test: Test,
    /// Axes of a vehicle or of flight logs; all if not given.
    #[arg(long, value_name = "AXIS", num_args = 1.., value_parser = AXES)]
    axis: Vec<String>,
    /// Age of the logged measurements, ms; the condition's if there is a vehicle [default: 0].
    #[arg(long, value_name = "N", value_parser = milliseconds)]
    delay_ms: Option<f64>,
    /// Rate of the add-on, Hz: that of which the relative degree is meant; chosen from the band of the log if not given.
    #[arg(long, value_name = "HZ", value_parser = hertz)]
    sub_rate: Option<f64>,
    #[command(flatten)]
    reading: LogReading,
}

/// Names of three columns.
#[derive(Clone, Debug)]
struct Columns([String; 3]);

fn three(text: &str) -> Result<Columns, String> {
    let names: Vec<String> = text.split(',').map(|name| name.trim().to_owned()).collect();
    names.try_into().map(Columns).map_err(|_| "expected three names of columns with commas between them".into())
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Test {
    /// Two flights of twelve tones an axis, position and velocity reference both.
    #[default]
    Multisine,
    /// Two flights of steps of the position reference, the velocity reference at 0.
    Steps,
}

/// Length of a test flight, s.
const SECONDS: f64 = 90.0;

/// What is printed as JSON.
#[derive(Debug, Serialize)]
struct Diagnosed {
    seed: u64,
    source: String,
    channels: Vec<Found>,
    /// Channels of which nothing can be said, and why.
    refused: Vec<Refused>,
}

#[derive(Debug, Serialize)]
struct Found {
    name: String,
    unit: &'static str,
    verdict: String,
    diagnosis: Diagnosis,
}

#[derive(Debug, Serialize)]
struct Refused {
    name: String,
    why: String,
}

impl Diagnose {
    pub(super) fn run(self, invocation: &Invocation) -> Result<()> {
        let seed = invocation.configuration.seed();
        let settings = Settings { sub_rate_hz: self.sub_rate, seed, ..Settings::default() };
        invocation.console.stage("diagnosing");
        let (source, channels) = match &self.vehicle {
            Some(vehicle) => {
                let closed_loop = closed_loop(vehicle, &self.gains, &self.condition)?;
                let source = format!(
                    "{} {} {}, {}",
                    closed_loop.vehicle.name,
                    closed_loop.gains,
                    closed_loop.condition.name,
                    self.test.words()
                );
                let logs = self.test.fly(
                    &closed_loop,
                    invocation.configuration.recipe(),
                    invocation.configuration.seed_of(Purpose::Identification),
                )?;
                let age_s = self.delay_ms.map_or(closed_loop.condition.measurement_delay_s, |delay| delay / 1e3);
                let axis = |(index, axis): (usize, &&str)| {
                    Ok(Channel { name: (*axis).to_owned(), unit: "m", record: of_logs(&logs, index, age_s)?, notes: Vec::new() })
                };
                (source, AXES.iter().enumerate().map(axis).collect::<Result<Vec<_>, DiagnosisError>>()?)
            }
            None => {
                let (kept, channels) = self.channels(invocation)?;
                (format!("{kept} log(s)"), channels)
            }
        };
        let wanted = |channel: &Channel| self.axis.is_empty() || self.axis.contains(&channel.name);
        let mut diagnosed = Diagnosed { seed, source, channels: Vec::new(), refused: Vec::new() };
        for Channel { name, unit, record, .. } in channels.into_iter().filter(wanted) {
            match diagnose(&record, &settings) {
                Ok(diagnosis) => {
                    diagnosed.channels.push(Found { name, unit, verdict: diagnosis.verdict_text(), diagnosis });
                }
                Err(error) => diagnosed.refused.push(Refused { name, why: error.to_string() }),
            }
        }
        invocation.console.finish();
        if diagnosed.channels.is_empty() {
            let why: Vec<String> = diagnosed.refused.iter().map(|Refused { name, why }| format!("{name}: {why}")).collect();
            bail!(if why.is_empty() { "--axis: the logs have no such axis".into() } else { why.join("; ") });
        }
        invocation.format.print(&diagnosed, || text(&diagnosed))
    }

    /// How many logs are used, and their channels, those of one name joined. Flights in which the loop broke down are left out,
    /// as `train` does; of other loops nobody knows the scale of their errors, so that such a log is only named.
    fn channels(&self, invocation: &Invocation) -> Result<(usize, Vec<Channel>)> {
        let age_s = self.delay_ms.unwrap_or(0.0) / 1e3;
        let columns = self.columns.as_ref().map(|columns| &columns.0);
        let of_file = |path: &PathBuf| {
            Ok((path.display().to_string(), read(path, columns, age_s, &self.reading.reading()).context("--log")?))
        };
        let files = self.log.iter().map(of_file).collect::<Result<Vec<_>>>()?;
        for (path, channels) in &files {
            say(invocation, path, channels.iter().flat_map(|channel| &channel.notes));
        }
        let errors: Vec<f64> = files.iter().map(|(_, channels)| largest_error(channels)).collect();
        let bound = largest_sound_error(&errors);
        let (mut kept, mut joined): (usize, Vec<Channel>) = (0, Vec::new());
        for ((path, channels), error) in files.into_iter().zip(errors) {
            if error > bound {
                let away = format!("{path}: up to {error:.3} from the reference, beside {bound:.3} in a usual log at most");
                if channels.iter().all(|channel| AXES.contains(&channel.name.as_str())) {
                    invocation.console.note(&format!("{away}: the loop broke down; left out"));
                    continue;
                }
                invocation.console.note(&format!("warning: {away}; if the loop broke down there, leave the log out"));
            }
            kept += 1;
            for channel in channels {
                match joined.iter_mut().find(|known| known.name == channel.name) {
                    Some(known) => {
                        let record = Record::joined([known.record.clone(), channel.record]);
                        known.record = record.with_context(|| format!("--log {path}"))?;
                    }
                    None => joined.push(channel),
                }
            }
        }
        Ok((kept, joined))
    }
}

/// Largest distance between measured value and reference over a log, all its channels together.
fn largest_error(channels: &[Channel]) -> f64 {
    let segments = channels.iter().flat_map(|channel| &channel.record.segments);
    largest_distance(segments.map(|segment| (segment.measured.as_slice(), segment.reference.as_slice())))
}

impl Test {
    fn words(self) -> &'static str {
        match self {
            Self::Multisine => "twelve tones an axis, position and velocity reference",
            Self::Steps => "steps of the position reference, velocity reference 0",
        }
    }

    /// Logs of the test's flights.
    fn fly(self, closed_loop: &Loop, recipe: &Recipe, seed: u64) -> Result<Vec<FlightLog>> {
        match self {
            Self::Multisine => {
                let flight_set = FlightSet { flights: 2, seconds: SECONDS, ..recipe.lane.dithered_flights };
                Ok(closed_loop.collect(&flight_set.motions(seed), None, seed)?)
            }
            Self::Steps => {
                let trajectories = [seed, seed.wrapping_add(1)].map(|seed| steps(closed_loop.rate_hz(), seed));
                let plans: Vec<FlightPlan<'_>> = trajectories
                    .iter()
                    .zip(seed..)
                    .map(|(trajectory, seed)| FlightPlan { log: true, ..FlightPlan::new(trajectory, seed) })
                    .collect();
                Ok(closed_loop.fly(&plans)?.into_iter().filter_map(|record| record.log).collect())
            }
        }
    }
}

/// Steps of up to 0.3 m on each axis round 1.5 m of altitude, held for 1 to 4 s, each axis by its own clock.
fn steps(rate_hz: f64, seed: u64) -> Trajectory {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let ticks = (SECONDS * rate_hz) as usize;
    let centre = [0.0, 0.0, 1.5];
    let mut samples = vec![Sample { position: centre, ..Sample::default() }; ticks];
    for (axis, middle) in centre.into_iter().enumerate() {
        // At rest for a second first.
        let mut tick = rate_hz as usize;
        while tick < ticks {
            let (height, held) = (random.random_range(-0.3..0.3), (random.random_range(1.0..4.0) * rate_hz) as usize);
            for sample in samples.iter_mut().skip(tick).take(held) {
                sample.position[axis] = middle + height;
            }
            tick += held.max(1);
        }
    }
    Trajectory { name: "steps".into(), rate_hz, scored: 0..ticks, samples }
}

fn text(diagnosed: &Diagnosed) -> String {
    let mut text = format!("{}; seed {}\n", line(&diagnosed.source), diagnosed.seed);
    for Found { name, unit, diagnosis, .. } in &diagnosed.channels {
        text += &format!("\n{}\n{}", line(name), diagnosis.text(unit));
    }
    for Refused { name, why } in &diagnosed.refused {
        text += &format!("\n{}\nnot diagnosed: {}\n", line(name), line(why));
    }
    text
}
