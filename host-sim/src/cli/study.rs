//! `host-sim study`: the paper, row by row.

use anyhow::Result;
use clap::{Args, Subcommand};

use super::{Session, output::table};
use crate::{
    report::{render_study, write_page},
    study,
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

impl Study {
    pub(super) fn run(self, session: &Session) -> Result<()> {
        match self.subject {
            Subject::Lti(lti) => lti.run(session),
        }
    }
}

impl Lti {
    fn run(self, session: &Session) -> Result<()> {
        let mut settings = study::lti::Settings::default();
        settings.learning.seed = session.configuration.seed();
        settings.learning.restarts = self.restarts;
        settings.learning.training.iterations = self.iterations;
        let mut study = study::lti::run(&settings)?;
        study::extensions::add(&mut study, session.configuration.seed(), self.logs.as_deref())?;
        show(session, "lti", &study)
    }
}

/// Writes the page into the folder as `study-NAME.html` and prints what was found.
fn show(session: &Session, name: &str, study: &study::Study) -> Result<()> {
    let path = session.configuration.folder()?.join(format!("study-{name}.html"));
    write_page(&render_study(study)?, &path)?;
    session.console.note(&format!("report: {}", path.display()));
    session.format.print(study, || {
        let rows = study.findings.iter().map(|finding| {
            [
                finding.rows_text(),
                finding.name.clone(),
                finding.what.clone(),
                finding.text(),
                finding.paper_text(),
                finding.asked_text(),
            ]
        });
        table(["row", "name", "what", "found", "paper", "asked"], 3, rows)
    })
}
