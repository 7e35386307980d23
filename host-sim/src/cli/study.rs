//! `host-sim study`: the paper, row by row.

mod found;
mod learning;
mod robustness;

use anyhow::Result;
use clap::{Args, Subcommand};
use impromptu_reproduction::{
    extensions, lti,
    quadrotor::{self, QuadrotorSettings},
};

use super::Invocation;
use found::show;

/// Arguments of `study`.
#[derive(Debug, Args)]
pub(super) struct Study {
    #[command(subcommand)]
    subject: Subject,
}

#[derive(Debug, Subcommand)]
enum Subject {
    /// Linear systems: exact laws, learned inverse, feature sets, difference learning (Insight 1, Lemma 1).
    Lti(Lti),
    /// 12 and 36 inputs, reference points, training signals, rates, sizes, 30 strokes (Insights 2 and 3).
    Quadrotor {
        /// Few flights and epochs: other numbers, in a fraction of the time.
        #[arg(long)]
        quick: bool,
    },
    /// What is left of the gain when vehicle, loop and air are not those of the training.
    Robustness(robustness::Robustness),
    /// What a loop learns while it flies, from nothing or on top of a model that was made for another one.
    Learning(learning::Learning),
    /// The Monte Carlo run over vehicles by itself, or a part of it.
    Draws(robustness::Draws),
    /// Puts the parts of a Monte Carlo run together.
    Merge(robustness::Merge),
}

impl Study {
    /// Why the arguments do not go together, if they do not.
    pub(super) fn conflict(&self) -> Option<String> {
        match &self.subject {
            Subject::Draws(command) => command.conflict(),
            _ => None,
        }
    }

    pub(super) fn run(self, invocation: &Invocation) -> Result<()> {
        match self.subject {
            Subject::Lti(lti) => lti.run(invocation),
            Subject::Quadrotor { quick } => {
                let settings = if quick { QuadrotorSettings::quick() } else { QuadrotorSettings::default() };
                let settings = QuadrotorSettings { seed: invocation.configuration.seed(), ..settings };
                let found = quadrotor::run(&settings, &invocation.command, &|text| invocation.console.note(text))?;
                show(invocation, "quadrotor", &found)
            }
            Subject::Robustness(command) => command.run(invocation),
            Subject::Learning(command) => command.run(invocation),
            Subject::Draws(command) => command.run(invocation),
            Subject::Merge(command) => command.run(invocation),
        }
    }
}

/// Arguments of `study lti`.
#[derive(Debug, Args)]
struct Lti {
    /// Networks trained for each system and feature set; the best in the f32 kernel is kept.
    #[arg(long, default_value_t = lti::Settings::default().learning.restarts, value_parser = count::<1000>)]
    restarts: usize,
    /// Most steps of Levenberg-Marquardt.
    #[arg(long, default_value_t = lti::Settings::default().learning.training.iterations, value_parser = count::<100_000>)]
    iterations: usize,
    /// Folder of flight logs (CSV with px, py, sp_ctrltarget_x, sp_ctrltarget_y in m, every 40 ms; FAMILY_NUMBER_….csv) instead
    /// of those in the program.
    #[arg(long, value_name = "DIR")]
    logs: Option<std::path::PathBuf>,
}

/// A count from 1 to `MOST`.
fn count<const MOST: usize>(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|value| (1..=MOST).contains(value)).ok_or_else(|| format!("expected a number from 1 to {MOST}"))
}

impl Lti {
    fn run(self, invocation: &Invocation) -> Result<()> {
        let mut settings = lti::Settings::default();
        settings.learning.seed = invocation.configuration.seed();
        settings.learning.restarts = self.restarts;
        settings.learning.training.iterations = self.iterations;
        let mut study = lti::run(&settings)?;
        extensions::add(&mut study, invocation.configuration.seed(), self.logs.as_deref())?;
        show(invocation, "lti", &study)
    }
}
