//! The page of a study: every row of the paper, its figure or number, and what differs.

use maud::{Markup, html};

use super::document;
use crate::{
    grid::grids,
    plots::{colour_variable, draw},
    study::{Finding, Study, listed},
};

/// The whole page as text.
///
/// # Errors
/// When a figure cannot be drawn; the message names it.
pub fn render_study(study: &Study) -> anyhow::Result<String> {
    let study = &study.harmless();
    let mut panels = Vec::new();
    for figure in &study.figures {
        panels.extend(draw(figure)?.map(|panel| (figure, panel)));
    }
    let body = html! {
        header {
            h1 { (study.title) }
            dl.facts {
                div { dt { "Seed" } dd { (study.seed) } }
                div { dt { "Command" } dd { code { (study.command) } } }
            }
        }
        main {
            @for section in study.sections() {
                section {
                    h2 { (section) }
                    @for note in study.notes.iter().filter(|note| note.section == section) { p { (note.text) } }
                    div.panels.wide { @for (figure, panel) in panels.iter().filter(|(figure, _)| figure.section == section) {
                        figure {
                            figcaption { (figure.title) }
                            ul.legend { @for (index, curve) in figure.curves.iter().enumerate() {
                                li { span style=(format!("color:var(--{})", colour_variable(index))) { "\u{25cf} \
                                " } (curve.label) }
                            } }
                            (panel)
                        }
                    } }
                    (numbers(study, section))
                }
            }
        }
    };
    Ok(document(&study.title, &body))
}

/// Tables of a section, then what stands in none.
fn numbers(study: &Study, section: &str) -> Markup {
    let (grids, others) = grids(study.of_section(section));
    html! {
        @for grid in grids {
            h3 { (grid.title) @if !grid.paper_rows.is_empty() { " (rows " (listed(&grid.paper_rows)) " of the paper)" } }
            div.scroll tabindex="0" { table.numbers {
                thead { tr { th {} @for column in &grid.columns { th { (column) } } } }
                tbody { @for (title, cells) in &grid.rows { tr {
                    th scope="row" { (title) }
                    @for cell in cells { td { @if let Some(finding) = cell {
                        span title=(finding.name) { (found(finding)) }
                        @if finding.paper.is_some() { small { "paper " (finding.paper_text()) } }
                        @if finding.asked.is_some() { small { "asked " (finding.asked_text()) } }
                    } } }
                } } }
            } }
        }
        @if !others.is_empty() {
            div.scroll tabindex="0" { table.plain {
                thead { tr { th { "Row" } th { "What" } th.right { "Found" } th.right { "Paper" } th.right { "Asked" } } }
                tbody { @for finding in others {
                    tr {
                        td { (finding.rows_text()) }
                        td title=(finding.name) { (finding.what) }
                        td.right { (found(finding)) }
                        td.right { (finding.paper_text()) }
                        td.right { (finding.asked_text()) }
                    }
                } }
            } }
        }
    }
}

/// The number; marked if it misses what is asked.
fn found(finding: &Finding) -> Markup {
    html! { @if finding.meets() == Some(false) { span.worse { (finding.text()) } } @else { (finding.text()) } }
}
