//! `host-sim study robustness`, and the Monte Carlo run by itself: `draws` and `merge`.

use std::path::PathBuf;

use anyhow::{Context as _, Result, anyhow};
use clap::Args;
use impromptu_firmware::model::Model;
use impromptu_report::study::Study;
use impromptu_reproduction::robustness::{
    Settings,
    draw::{DrawSettings, Ranges, slug},
    draws::fly_draws,
    ledger::{Header, Shard, merge},
    run, spread,
};
use impromptu_training::{build, observer::Observer as _};

use super::found::show;
use crate::cli::{
    Invocation, configuration,
    model_file::ModelFile,
    output::write,
    situation::{Situation, closed_loop},
};

/// Arguments of `study robustness`.
#[derive(Debug, Args)]
#[command(after_help = "\
A model is built for each vehicle and condition and flown with mass, thrust, drag, delay, disturbance and wind that it was not \
made for, one at a
time and, in the Monte Carlo run, all at once; how soon the guard hands over where the add-on does harm is counted; then the \
control weight
of the feedback lane is swept. The draws are kept in the folder
(draws-*.jsonl): the same command goes on with them.

Examples:
  host-sim study robustness
  host-sim study robustness --vehicle crazyflie --condition lab --draws 1000 --format json")]
pub(super) struct Robustness {
    /// Vehicles, by name or file.
    #[arg(long, value_name = "NAME|FILE.toml", default_value = "crazyflie,crazyflie-brushless", value_delimiter = ',')]
    vehicle: Vec<String>,
    /// Gains of the position loop.
    #[arg(long, value_name = "NAME", default_value = "stock")]
    gains: String,
    /// Conditions, by name or file.
    #[arg(long, value_name = "NAME|FILE.toml", default_value = "lab,rough", value_delimiter = ',')]
    condition: Vec<String>,
    /// Number of test strokes.
    #[arg(long, value_name = "N", default_value = "30", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    strokes: u32,
    /// Flights of each kind of change in the table of the guard's trips, for each loop.
    #[arg(long, value_name = "N", default_value = "24", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    guard_flights: u32,
    #[command(flatten)]
    draw: Drawn,
}

/// What is drawn.
#[derive(Debug, Args)]
struct Drawn {
    /// Vehicles that are drawn for each loop.
    #[arg(long, value_name = "N", default_value = "200", value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    draws: u32,
    /// Strokes that each of them flies.
    #[arg(long, value_name = "N", default_value = "8", value_parser = clap::value_parser!(u32).range(1..=1000))]
    draw_strokes: u32,
    /// From where to where is drawn, as TOML: mass = [0.95, 1.15], thrust, drag, inertia, motor_lag (factors), delay_s, wind.
    #[arg(long, value_name = "FILE.toml")]
    ranges: Option<PathBuf>,
}

impl Drawn {
    fn ranges(&self) -> Result<Ranges> {
        let Some(path) = &self.ranges else { return Ok(Ranges::default()) };
        let ranges: Ranges = configuration::toml(path)?;
        match ranges.fault() {
            Some(fault) => Err(anyhow!("{}: {fault}", path.display())),
            None => Ok(ranges),
        }
    }
}

impl Robustness {
    pub(super) fn run(self, invocation: &Invocation) -> Result<()> {
        let mut loops = Vec::new();
        for vehicle in &self.vehicle {
            for condition in &self.condition {
                loops.push(closed_loop(vehicle, &self.gains, condition)?);
            }
        }
        let settings = Settings {
            seed: invocation.configuration.seed(),
            loops,
            strokes: self.strokes as usize,
            draws: self.draw.draws,
            draw_strokes: self.draw.draw_strokes as usize,
            guard_flights: self.guard_flights,
            ranges: self.draw.ranges()?,
            recipe: invocation.configuration.study_recipe(),
            out: invocation.configuration.folder()?,
        };
        let study = run(&settings, &invocation.command, &invocation.console)?;
        invocation.console.finish();
        show(invocation, "robustness", &study)
    }
}

/// Arguments of `study draws`.
#[derive(Debug, Args)]
#[command(after_help = "\
Each draw is another vehicle in another air, flown with the model of the nominal one. A line of JSON for each goes to a file in \
the folder; the
same command goes on where it stopped. With --shard a run is shared out, by hand or by a scheduler (SLURM: sbatch --array=1-16):

  host-sim study draws --model model.impromptu --draws 10000 --shard $SLURM_ARRAY_TASK_ID/16 --out draws
  host-sim study merge draws/draws-*-of-16.jsonl --out draws")]
pub(super) struct Draws {
    /// Model file; built for the nominal loop if not given.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    #[command(flatten)]
    situation: Situation,
    #[command(flatten)]
    draw: Drawn,
    /// The part of the run that is flown, from 1.
    #[arg(long, value_name = "PART/PARTS", default_value = "1/1")]
    shard: Shard,
}

impl Draws {
    /// Why the arguments do not go together, if they do not.
    pub(in crate::cli) fn conflict(&self) -> Option<String> {
        self.situation.conflict()
    }

    pub(super) fn run(self, invocation: &Invocation) -> Result<()> {
        let (closed_loop, ranges) = (self.situation.closed_loop()?, self.draw.ranges()?);
        let seed = invocation.configuration.seed();
        let bytes = match &self.model {
            Some(path) => ModelFile::read(path)?.bytes().to_vec(),
            None => build(&invocation.configuration.study_recipe(), &closed_loop, seed, &mut |_| {})?.models.int8,
        };
        let model = Model::from_bytes(&bytes).with_context(|| match &self.model {
            Some(path) => format!("{}: refused", path.display()),
            None => "the model that was built".into(),
        })?;
        let settings = DrawSettings::new(&closed_loop, &model, seed, self.draw.draws, self.draw.draw_strokes as usize, ranges);
        let header = Header { settings, shard: self.shard };
        let name = header.name().context("--vehicle, --gains and --condition")?;
        let path = invocation.configuration.folder()?.join(format!("{name}.jsonl"));
        let inputs = self.model.as_deref().into_iter().chain(self.draw.ranges.as_deref()).chain(self.situation.files());
        invocation.check_output(&path, inputs)?;
        let console = &invocation.console;
        let content = fly_draws(&header, &closed_loop, &model, &path, &|done, of| console.steps(done, of))?;
        console.finish();
        console.note(&format!("{}: {} draws, seed {seed}", path.display(), content.draws.len()));
        let mut study = Study::new("Monte Carlo over vehicles", &invocation.command, seed);
        spread::tell(&mut study, &slug(&header.settings.nominal), &content);
        show(invocation, &name, &study)
    }
}

/// Arguments of `study merge`.
#[derive(Debug, Args)]
#[command(after_help = "\
Checks that the files are all parts of one run, each once and whole, and writes draws-VEHICLE_GAINS_CONDITION.jsonl: the bytes \
of a run without --shard.")]
pub(super) struct Merge {
    /// Files of `study draws --shard`.
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
}

impl Merge {
    pub(super) fn run(self, invocation: &Invocation) -> Result<()> {
        let (bytes, content) = merge(&self.files)?;
        let settings = &content.header.settings;
        let name = content.header.name()?;
        let path = invocation.configuration.folder()?.join(format!("{name}.jsonl"));
        invocation.check_output(&path, self.files.iter().map(PathBuf::as_path))?;
        write(&path, &bytes)?;
        invocation.console.note(&format!("{}: {} draws, seed {}", path.display(), content.draws.len(), settings.seed));
        let mut study = Study::new("Monte Carlo over vehicles", &invocation.command, settings.seed);
        spread::tell(&mut study, &slug(&settings.nominal), &content);
        show(invocation, &name, &study)
    }
}
