//! The HTML page: one file, no script, no request to anywhere, readable in light, in dark and on paper.

mod cards;
mod charts;
mod provenance;
mod study;
mod table;
mod words;

pub use study::render_study;

use crate::{
    cases::{Case, Scene, flights_in_words, methods},
    results::Results,
};
use anyhow::Context as _;
use impromptu_files::replacement::replace;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use std::path::Path;

const STYLE: &str = include_str!("style.css");

/// The whole page as text.
///
/// # Errors
/// When a plot cannot be drawn; the message names it.
pub fn render_html(results: &Results) -> anyhow::Result<String> {
    let results = &results.harmless();
    let cases = Case::group(&results.table);
    let methods = methods(&results.table);
    let scenes = Scene::group(&results.flights);
    let flights = flights_in_words(&cases, &results.per_flight);
    let charts = charts::sections(results, &cases, &methods, &scenes)?;
    let body = html! {
        header {
            h1 { (results.title) }
            p.lead {
                "A learned add-on corrects the reference that a quadrotor\u{2019}s control loop is given; the loop itself stays \
                 as it is. "
                "Every number here is simulated, in closed loop, on trajectories that the add-on was not trained on."
            }
            dl.facts {
                @if let Some(flights) = &flights { div { dt { "Flights per cell" } dd { (flights) } } }
                div { dt { "Seed" } dd { (results.seed) } }
                div { dt { "Version" } dd { (results.software_version) } }
            }
        }
        main {
            (cards::headline(&cases))
            (table::section(&cases, &methods, flights.as_deref()))
            (charts)
            (provenance::models(&results.models))
            (words::definitions(results, &methods))
            (provenance::run(results))
        }
    };
    Ok(document(&results.title, &body))
}

/// A page of its own: nothing is loaded from elsewhere.
fn document(title: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { (body) }
        }
    };
    page.into_string()
}

/// Writes the page to `path` at once: another file's content is replaced as a whole, or not at all.
///
/// # Errors
/// When a plot cannot be drawn or the file cannot be written; the message names the file.
pub fn write_html(results: &Results, path: &Path) -> anyhow::Result<()> {
    write_page(&render_html(results)?, path)
}

/// Writes the text of a page to `path` at once, or not at all.
///
/// # Errors
/// When the file cannot be written; the message names it.
pub fn write_page(page: &str, path: &Path) -> anyhow::Result<()> {
    replace(path, page.as_bytes()).with_context(|| format!("the report cannot be written to '{}'", path.display()))
}

#[cfg(test)]
mod tests;
