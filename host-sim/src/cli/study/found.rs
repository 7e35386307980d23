//! What a study found, as a page and as text.

use anyhow::Result;
use impromptu_report::{
    grid::grids,
    render_study,
    study::{Finding, Study},
    write_page,
};
use serde::Serialize;

use crate::cli::{
    Invocation,
    output::{table, table_of},
};

/// Writes the page into the folder as `study-NAME.html` and prints what was found.
pub(super) fn show(invocation: &Invocation, name: &str, study: &Study) -> Result<()> {
    show_as(invocation, name, study, study)
}

/// The same, with a JSON document that holds more than the study.
pub(super) fn show_as(invocation: &Invocation, name: &str, study: &Study, document: &impl Serialize) -> Result<()> {
    let path = invocation.configuration.folder()?.join(format!("study-{name}.html"));
    invocation.check_output(&path, [])?;
    write_page(&render_study(study)?, &path)?;
    invocation.console.note(&format!("report: {}", path.display()));
    invocation.format.print(document, || text(&study.harmless()))
}

/// Section by section: its tables, then what stands in none.
fn text(study: &Study) -> String {
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
