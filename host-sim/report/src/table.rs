//! The table on the console: a line for each case, a column for each method, readable at 130 columns.

use crate::{
    cases::{Case, flights_in_words, methods},
    method::Method,
    notation::{NOT_AVAILABLE, centimetres_with_unit, mean_and_worst, speed},
    results::{Results, Row},
};
use comfy_table::{Cell, CellAlignment, ContentArrangement, Table, presets};
use std::fmt::Write as _;

/// The table with its legend, as plain text that ends with a line break.
#[must_use]
pub fn console_table(results: &Results) -> String {
    let results = &results.harmless();
    let cases = Case::group(&results.table);
    // What quantisation costs is in the document and on the page: the columns would not fit.
    let shown = |method: &Method| !matches!(method, Method::NetF32 | Method::FullF32);
    let methods: Vec<Method> = methods(&results.table).into_iter().filter(shown).collect();
    let mut text = format!("{}\n", results.title);
    if cases.is_empty() {
        text.push_str("No flights: the table is empty.\n");
        return text;
    }
    let several_seeds = cases.iter().any(|case| case.seed != cases[0].seed);

    let mut table = Table::new();
    table.load_style(presets::UTF8_HORIZONTAL_ONLY).set_content_arrangement(ContentArrangement::Disabled).set_header(
        std::iter::once(Cell::new("vehicle; gains,\ncondition, speed"))
            .chain(methods.iter().map(|method| right(method.heading().join("\n").trim_end()))),
    );
    for case in &cases {
        let mut name = format!("{}\n{} {} {}", case.vehicle, case.gains, case.condition, speed(case.speed));
        if several_seeds {
            let _ = write!(name, " seed {}", case.seed);
        }
        table.add_row(std::iter::once(Cell::new(name)).chain(methods.iter().map(|method| right(&cell(case.row(*method))))));
    }
    for column in table.column_iter_mut() {
        column.set_padding((0, 1));
    }
    text.push_str(&table.trim_fmt());
    text.push('\n');
    text.push_str(&legend(results, &cases));
    text
}

fn right(text: &str) -> Cell {
    Cell::new(text).set_alignment(CellAlignment::Right)
}

fn cell(row: Option<&Row>) -> String {
    match row {
        None => NOT_AVAILABLE.to_owned(),
        Some(row) if row.method == Method::Baseline => centimetres_with_unit(row.rms_cm_mean),
        Some(row) => format!(
            "{}\n{}",
            centimetres_with_unit(row.rms_cm_mean),
            mean_and_worst(row.reduction_mean, row.reduction_worst, "/")
        ),
    }
}

fn legend(results: &Results, cases: &[Case<'_>]) -> String {
    let flights = flights_in_words(cases, &results.per_flight)
        .map_or_else(|| "over all flights".to_owned(), |count| format!("over {count} flights of unseen trajectories"));
    let mut text = format!(
        "\
Each cell, {flights}: mean RMS position error in cm; below it its reduction in %, mean/worst flight.
  RMS of one flight = sqrt(mean |desired - flown|^2) over the scored part: true position, three axes together.
  Reduction of one flight = 100 (1 - RMS / baseline's RMS on the same trajectory); below 0 it is worse than the baseline.
  flatness: desired acceleration / kp added to the reference. lane: feedback lane. net: network lane. ridge: linear, same \
  features.
  net int8 + lane is what is flashed. 1.7x: times the drawn speed. +20ms: 20 ms more delay in the whole loop, at test time only.
"
    );
    if results.table.iter().any(|row| row.method == Method::Learned) {
        text.push_str(
            "  learned in flight: nothing trained, taught by a minute of other strokes, still learning in each flight.\n",
        );
    }
    let _ = writeln!(text, "Seed {}, version {}. Again: {}", results.seed, results.software_version, results.command);
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture;

    #[test]
    fn small_table_is_printed_as_agreed() {
        let text = console_table(&fixture::small());
        let expected = "\
Two flights
─────────────────────────────────────────────────────────────
vehicle; gains,   baseline    flatness   net int8   net int8
condition, speed                                      + lane
═════════════════════════════════════════════════════════════
crazyflie          11.2 cm     9.50 cm    1.25 cm    0.35 cm
stock lab 1x                20.0/-20.0  89.0/88.0  97.0/96.0
─────────────────────────────────────────────────────────────
Each cell, over 2 flights of unseen trajectories: mean RMS position error in cm; below it its reduction in %, mean/worst flight.
  RMS of one flight = sqrt(mean |desired - flown|^2) over the scored part: true position, three axes together.
  Reduction of one flight = 100 (1 - RMS / baseline's RMS on the same trajectory); below 0 it is worse than the baseline.
  flatness: desired acceleration / kp added to the reference. lane: feedback lane. net: network lane. ridge: linear, same \
  features.
  net int8 + lane is what is flashed. 1.7x: times the drawn speed. +20ms: 20 ms more delay in the whole loop, at test time only.
Seed 7, version 0.1.0. Again: host-sim --seed 7
";
        assert_eq!(text, expected, "got:\n{text}");
    }

    #[test]
    fn all_methods_fit_into_132_columns() {
        let text = console_table(&fixture::full());
        let widest = text.lines().max_by_key(|line| line.chars().count()).unwrap();
        assert!(widest.chars().count() <= 132, "{} columns: {widest}", widest.chars().count());
    }

    #[test]
    fn nothing_and_not_a_number_are_shown_not_hidden() {
        let mut results = fixture::small();
        results.table[1].rms_cm_mean = f64::NAN;
        results.table[1].reduction_mean = f64::INFINITY;
        assert!(console_table(&results).contains("n/a"));
        assert!(console_table(&fixture::empty()).contains("the table is empty"));
    }
}
