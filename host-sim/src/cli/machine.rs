//! `host-sim machine`: machines that are no quadrotor, to try `describe` and `train --loop` on.

use std::path::PathBuf;

use anyhow::{Context as _, Result, anyhow};
use clap::Args;
use impromptu_files::replacement::replace;
use impromptu_firmware::Lanes;
use impromptu_loops::{
    machines::{Machine, flown, logged, motion},
    reading::AxisLog,
};
use impromptu_training::Purpose;
use serde::Serialize;

use super::{
    Invocation,
    model_file::ModelFile,
    output::{number, table},
    situation::within,
};

/// Arguments of `machine`.
#[derive(Debug, Args)]
#[command(after_help = "\
Without --model: writes logs of the machine's own loop, with dither, and its description into --out. With --model: moves it along
motions that no log holds, with the model's lanes and without, and prints the RMS error of each axis.

Examples:
  host-sim machine gantry --out gantry
  host-sim train --loop gantry/gantry.toml --log gantry/*.csv --name gantry --out models
  host-sim machine gantry --model models/gantry.impromptu")]
pub(super) struct MachineCommand {
    /// servo (one axis, friction), gantry (two, each with a resonance), gimbal (three quick ones) or arm (six, gravity).
    #[arg(value_name = "NAME", value_parser = machine)]
    machine: Machine,
    /// A model of it.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Motions.
    #[arg(long, value_name = "N", default_value = "4", value_parser = clap::value_parser!(u32).range(1..=1_000))]
    motions: u32,
    /// Length of a motion, s.
    #[arg(long, value_name = "S", default_value = "60", value_parser = seconds)]
    seconds: f64,
    /// Logs without dither.
    #[arg(long, conflicts_with = "model")]
    plain: bool,
}

fn machine(text: &str) -> Result<Machine, String> {
    Machine::named(text).ok_or_else(|| format!("expected {}", Machine::ALL.map(Machine::name).join(", ")))
}

fn seconds(text: &str) -> Result<f64, String> {
    within(text, 6.0, 3590.0)
}

/// What is printed as JSON.
#[derive(Debug, Serialize)]
struct Moved {
    machine: &'static str,
    seed: u64,
    axes: Vec<MovedAxis>,
}

#[derive(Debug, Serialize)]
struct MovedAxis {
    axis: String,
    unit: String,
    /// RMS over the motions, without the model and with it.
    error: f64,
    with_model: f64,
    /// Mean and worst over the motions, %.
    reduction_percent: [f64; 2],
}

/// Errors of each axis along a motion, without a model and with it.
type Pair = (Vec<f64>, Vec<f64>);

impl MachineCommand {
    pub(super) fn run(self, invocation: &Invocation) -> Result<()> {
        invocation.console.note(&format!("seed {}", invocation.configuration.seed()));
        match &self.model {
            Some(path) => self.fly(path, invocation),
            None => self.log(invocation),
        }
    }

    fn log(&self, invocation: &Invocation) -> Result<()> {
        let folder = invocation.configuration.folder()?;
        let first = invocation.configuration.seed_of(Purpose::Training);
        let name = self.machine.name();
        let mut files = Vec::new();
        for index in 0..u64::from(self.motions) {
            let seed = first.wrapping_add(index);
            let logs = logged(self.machine, &motion(self.machine, self.seconds, seed), !self.plain, seed);
            files.push((folder.join(format!("{name}-{:04}.csv", index + 1)), csv(&logs)));
        }
        files.push((folder.join(format!("{name}.toml")), self.machine.description().to_toml()));
        for (path, text) in &files {
            invocation.check_output(path, [])?;
            replace(path, text.as_bytes()).with_context(|| path.display().to_string())?;
        }
        let written: Vec<String> = files.iter().map(|(path, _)| path.display().to_string()).collect();
        invocation.format.print(&written, || table(["file"], 1, written.iter().map(|file| [file.clone()])))
    }

    fn fly(&self, path: &std::path::Path, invocation: &Invocation) -> Result<()> {
        let file = ModelFile::read(path)?;
        let model = file.model()?;
        let seed = invocation.configuration.seed_of(Purpose::Test);
        let pairs = (0..u64::from(self.motions))
            .map(|index| {
                let (desired, seed) = (motion(self.machine, self.seconds, seed.wrapping_add(index)), seed.wrapping_add(index));
                let [alone, with] = [None, Some((&model, Lanes::BOTH))].map(|model| flown(self.machine, &desired, model, seed));
                Ok((alone?, with.map_err(|error| anyhow!("{}: {error}", path.display()))?))
            })
            .collect::<Result<Vec<Pair>>>()?;
        let rms =
            |of: &dyn Fn(&Pair) -> f64| (pairs.iter().map(|pair| of(pair).powi(2)).sum::<f64>() / pairs.len() as f64).sqrt();
        let described = self.machine.description();
        let axes = described.axes.iter().enumerate().map(|(axis, described)| {
            let reductions: Vec<f64> = pairs.iter().map(|(alone, with)| 100.0 * (1.0 - with[axis] / alone[axis])).collect();
            MovedAxis {
                axis: described.name.clone(),
                unit: described.unit.clone(),
                error: rms(&|(alone, _)| alone[axis]),
                with_model: rms(&|(_, with)| with[axis]),
                reduction_percent: [
                    reductions.iter().sum::<f64>() / reductions.len() as f64,
                    reductions.iter().copied().fold(f64::INFINITY, f64::min),
                ],
            }
        });
        let moved = Moved { machine: self.machine.name(), seed: invocation.configuration.seed(), axes: axes.collect() };
        invocation.format.print(&moved, || {
            let row = |axis: &MovedAxis| {
                let [mean, worst] = axis.reduction_percent;
                let [error, with_model] = [axis.error, axis.with_model].map(|error| number(error, 5));
                [axis.axis.clone(), axis.unit.clone(), error, with_model, number(mean, 1), number(worst, 1)]
            };
            table(["axis", "unit", "RMS error alone", "with the model", "mean, %", "worst, %"], 2, moved.axes.iter().map(row))
        })
    }
}

/// A log of all axes, with the columns of the machine's description.
fn csv(logs: &[AxisLog]) -> String {
    let machine = logs.first().and_then(|log| Machine::named(&log.file));
    let names: Vec<String> =
        machine.map_or_else(Vec::new, |machine| machine.description().axes.into_iter().map(|axis| axis.name).collect());
    let mut text = "time_s".to_owned();
    for name in &names {
        text += &format!(",{name}_desired,{name}_reference,{name}_measured,{name}_velocity,{name}_acceleration");
    }
    text.push('\n');
    for tick in 0..logs.first().map_or(0, |log| log.signals.len()) {
        text += &format!("{:.4}", tick as f64 / logs[0].rate_hz);
        for signals in logs.iter().map(|log| &log.signals) {
            let fresh = signals.fresh.as_ref().map_or(0.0, |fresh| fresh[tick]);
            let values = [signals.desired[tick], signals.reference[tick], signals.measured[tick], signals.velocity[tick], fresh];
            values.iter().for_each(|value| text += &format!(",{value:.7}"));
        }
        text.push('\n');
    }
    text
}
