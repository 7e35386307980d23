//! `host-sim` without a command: everything, from the first training flight to the report.

use std::path::Path;

use anyhow::Result;
use impromptu_experiment::demo;
use impromptu_report::{Results, console_table, render_html, write_flights_csv, write_table_csv};

use super::{Invocation, output};

/// Files with the views of results.
pub(super) const VIEWS: [&str; 3] = ["report.html", "table.csv", "flights.csv"];

/// Runs the demo and shows what came of it.
pub(super) fn run(invocation: &Invocation) -> Result<()> {
    // Before the minutes of work: a folder that cannot be made is refused now.
    let folder = invocation.configuration.folder()?;
    for name in VIEWS.into_iter().chain(["results.json"]) {
        invocation.check_output(&folder.join(name), [])?;
    }
    let settings = demo::DemoSettings { out: Some(folder.clone()), ..invocation.configuration.settings.clone() };
    invocation.console.note(&format!("seed {}", settings.seed));
    let mut results = demo::run(&settings, &invocation.console)?;
    invocation.console.finish();
    results.command = invocation.command.clone();
    invocation.console.note(&format!("models and flight logs: {0}/models, {0}/logs", folder.display()));
    output::write(&folder.join("results.json"), results.to_json()?.as_bytes())?;
    invocation.console.note(&format!("results: {}", folder.join("results.json").display()));
    show(invocation, &results, &folder)
}

/// Prints results and writes their views into a folder.
pub(super) fn show(invocation: &Invocation, results: &Results, folder: &Path) -> Result<()> {
    let (mut table, mut flights) = (Vec::new(), Vec::new());
    write_table_csv(&results.table, &mut table)?;
    write_flights_csv(&results.per_flight, &mut flights)?;
    let [page, table_file, flights_file] = VIEWS.map(|name| folder.join(name));
    let html = render_html(results)?;
    output::write_all(&[(&table_file, &table), (&flights_file, &flights), (&page, html.as_bytes())])?;
    invocation.console.note(&format!("table: {}, flights: {}", table_file.display(), flights_file.display()));
    invocation.console.note(&format!("report: {}", page.display()));
    match invocation.format {
        output::Format::Table => output::print(&console_table(results)),
        output::Format::Json => output::print_json(&(results.to_json()? + "\n")),
    }
}
