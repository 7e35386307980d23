//! What is stated about logs that are read, where they leave it open.
//!
//! *in* arguments; *out* how a log is read; *never* a prompt: what is open is refused with exit code 2.

use clap::{Args, ValueEnum};
use impromptu_diagnosis::plausibility::{Reading, TimeUnit};
use impromptu_loops::{age::UnknownAge, draft::DraftError};
use impromptu_training::{agreement::Disagreement, channel::ChannelError, track::TrackError};

use super::Invocation;

/// How logs are read.
#[derive(Clone, Copy, Debug, Args)]
pub(super) struct LogReading {
    /// Unit of the time; needed where it goes by whole numbers [default: s].
    #[arg(long, value_enum)]
    time_unit: Option<Unit>,
    /// The measured value counts against the reference, as in another frame.
    #[arg(long)]
    negate_measured: bool,
    /// What the measured value is multiplied by to have the reference's unit, as 0.001 for millimetres beside metres.
    #[arg(long, value_name = "FACTOR", value_parser = factor)]
    measured_scale: Option<f64>,
}

fn factor(text: &str) -> Result<f64, String> {
    let factor: f64 = text.parse().map_err(|_| "expected a number".to_owned())?;
    let sane = (1e-9..=1e9).contains(&factor);
    sane.then_some(factor).ok_or_else(|| "expected a factor from 1e-9 to 1e9; for another sign see --negate-measured".into())
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Unit {
    S,
    Ms,
    Us,
    Ns,
}

impl LogReading {
    pub(super) fn reading(self) -> Reading {
        let time_unit = self.time_unit.map(|unit| match unit {
            Unit::S => TimeUnit::Seconds,
            Unit::Ms => TimeUnit::Milliseconds,
            Unit::Us => TimeUnit::Microseconds,
            Unit::Ns => TimeUnit::Nanoseconds,
        });
        Reading { time_unit, negated: self.negate_measured, scale: self.measured_scale }
    }
}

/// Says what was done to a log, once for all its axes.
pub(super) fn say<'a>(invocation: &Invocation, file: &str, notes: impl Iterator<Item = &'a String>) {
    let mut said: Vec<&String> = Vec::new();
    for note in notes {
        if !said.contains(&note) {
            invocation.console.note(&format!("{file}: {note}"));
            said.push(note);
        }
    }
}

/// The simulated loop is not that of the logs.
#[derive(Debug, thiserror::Error)]
#[error(
    "--vehicle {vehicle}: {found}; leave --vehicle out, and both lanes are chosen on what the logs alone leave possible, or give \
     the vehicle, --gains, --controller and --condition that were flown (--force trains all the same)"
)]
pub(super) struct OtherLoop {
    pub(super) vehicle: String,
    pub(super) found: Disagreement,
}

/// Whether the arguments leave open how a log is meant.
pub(super) fn leaves_open(error: &anyhow::Error) -> bool {
    if error.is::<DraftError>() || error.is::<UnknownAge>() || error.is::<OtherLoop>() {
        return true;
    }
    let open = |error: &ChannelError| matches!(error, ChannelError::Implausible { source, .. } if source.leaves_open());
    match error.downcast_ref() {
        Some(TrackError::Ambiguous { .. }) => true,
        Some(TrackError::Channel(error)) => open(error),
        None => error.downcast_ref().is_some_and(open),
    }
}
