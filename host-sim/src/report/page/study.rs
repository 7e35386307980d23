//! The page of a study: every row of the paper, its figure or number, and what differs.

use maud::html;

use super::document;
use crate::{
    report::plots::{colour_variable, draw},
    study::Study,
};

/// The whole page as text.
///
/// # Errors
/// When a figure cannot be drawn; the message names it.
pub fn render_study(study: &Study) -> anyhow::Result<String> {
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
                    @if study.findings.iter().any(|finding| finding.section == section) {
                        div.scroll tabindex="0" { table.plain {
                            thead { tr { th { "Row" } th { "What" } th.right { "Found" } th.right { "Paper" } th.right { "Asked" } } }
                            tbody { @for finding in study.findings.iter().filter(|finding| finding.section == section) {
                                tr {
                                    td { (finding.rows_text()) }
                                    td { (finding.what) " " code { (finding.name) } }
                                    td.right { @if finding.meets() == Some(false) { span.worse { (finding.text()) } } @else { (finding.text()) } }
                                    td.right { (finding.paper_text()) }
                                    td.right { (finding.asked_text()) }
                                }
                            } }
                        } }
                    }
                    div.panels { @for (figure, panel) in panels.iter().filter(|(figure, _)| figure.section == section) {
                        figure {
                            figcaption { (figure.title) }
                            ul.legend { @for (index, curve) in figure.curves.iter().enumerate() {
                                li { span style=(format!("color:var(--{})", colour_variable(index))) { "\u{25cf} " } (curve.label) }
                            } }
                            (panel)
                        }
                    } }
                }
            }
        }
    };
    Ok(document(&study.title, &body))
}
