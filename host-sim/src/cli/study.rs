//! `host-sim study`: the paper, row by row.

mod robustness;

use anyhow::Result;
use clap::{Args, Subcommand};

use super::{
    Invocation,
    output::{table, table_of},
};
use crate::{
    report::{render_study, write_page},
    study::{
        self, Finding,
        grid::grids,
        quadrotor::{self, QuadrotorSettings},
    },
};

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
    /// The Monte Carlo run over vehicles by itself, or a part of it.
    Draws(robustness::Draws),
    /// Puts the parts of a Monte Carlo run together.
    Merge(robustness::Merge),
}

impl Study {
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
            Subject::Draws(command) => command.run(invocation),
            Subject::Merge(command) => command.run(invocation),
        }
    }
}

/// Arguments of `study lti`.
#[derive(Debug, Args)]
struct Lti {
    /// Networks trained for each system and feature set; the best in the f32 kernel is kept.
    #[arg(long, default_value_t = study::lti::Settings::default().learning.restarts)]
    restarts: usize,
    /// Most steps of Levenberg-Marquardt.
    #[arg(long, default_value_t = study::lti::Settings::default().learning.training.iterations)]
    iterations: usize,
    /// Folder of flight logs (CSV with px, py, sp_ctrltarget_x, sp_ctrltarget_y in m, every 40 ms; FAMILY_NUMBER_….csv) instead of those in the program.
    #[arg(long, value_name = "DIR")]
    logs: Option<std::path::PathBuf>,
}

impl Lti {
    fn run(self, invocation: &Invocation) -> Result<()> {
        let mut settings = study::lti::Settings::default();
        settings.learning.seed = invocation.configuration.seed();
        settings.learning.restarts = self.restarts;
        settings.learning.training.iterations = self.iterations;
        let mut study = study::lti::run(&settings)?;
        study::extensions::add(&mut study, invocation.configuration.seed(), self.logs.as_deref())?;
        show(invocation, "lti", &study)
    }
}

/// Writes the page into the folder as `study-NAME.html` and prints what was found.
fn show(invocation: &Invocation, name: &str, study: &study::Study) -> Result<()> {
    let path = invocation.configuration.folder()?.join(format!("study-{name}.html"));
    write_page(&render_study(study)?, &path)?;
    invocation.console.note(&format!("report: {}", path.display()));
    invocation.format.print(study, || text(study))
}

/// Section by section: its tables, then what stands in none.
fn text(study: &study::Study) -> String {
    let mut text = format!("{}; seed {}; names of all numbers: --format json\n", study.title, study.seed);
    for section in study.sections() {
        text += &format!("\n{section}\n");
        let (grids, others) = grids(study.of_section(section));
        for grid in grids {
            text += &format!("\n{}\n", grid.title);
            // A title of several parts takes several lines: the numbers below it are short.
            let header = std::iter::once("")
                .chain(grid.columns.iter().copied())
                .map(|title| title.replace(", ", ",\n").replace(": ", ":\n"));
            let rows = grid.rows.iter().map(|(title, cells)| {
                let cells = cells.iter().map(|cell| cell.map_or_else(String::new, in_cell));
                std::iter::once((*title).to_owned()).chain(cells).collect::<Vec<_>>()
            });
            text += &table_of(header, 1, rows);
        }
        if !others.is_empty() {
            let rows = others.into_iter().map(|finding| {
                [finding.rows_text(), finding.what.clone(), finding.text(), finding.paper_text(), finding.asked_text()]
            });
            text += &table(["row", "what", "found", "paper", "asked"], 2, rows);
        }
    }
    text
}

/// A number with what stands beside it.
fn in_cell(finding: &Finding) -> String {
    let mut text = finding.text();
    if finding.paper.is_some() {
        text += &format!("\npaper {}", finding.paper_text());
    }
    if let Some(meets) = finding.meets() {
        text += &format!("\n{} {}", if meets { "kept:" } else { "MISSED:" }, finding.asked_text());
    }
    text
}
