//! Rows as findings and words.
//!
//! *in* rows; *out* entries of a [`Study`]; *never* a percentage without the centimetres that it is of; *source* none.

use impromptu_report::study::{Asked, Finding, Study};

use super::{Settings, cases::Case, row::Row};

/// Section of the report.
pub(super) const SECTION: &str = "Learning in flight";

/// What the study does, and its rows.
pub(super) fn tell(study: &mut Study, settings: &Settings, cases: &[Case], rows: &[Row]) {
    study.note(
        SECTION,
        &format!(
            "{} unseen strokes a row. Nothing is known of a loop but a guess of its response from the gains of its position \
             loop. `After N s`: N seconds of motion along every axis taught, then each stroke is flown by itself with what \
             they taught, and goes on learning. `From the first stroke on`: one stroke after another, the first four are not \
             judged. Reductions are against the baseline's flight of the same vehicle in the same air.",
            settings.strokes
        ),
    );
    for (index, (case, row)) in cases.iter().zip(rows).enumerate() {
        // The same words would be one row of a table.
        let speed = if row.speed == 1.0 { String::new() } else { format!(" at {}x", row.speed) };
        let parts = if row.parts == "both" { String::new() } else { format!(", {}", row.parts) };
        let title = format!("{}{speed}, {}{parts}", case.loop_name(), row.seconds.words());
        let asked = case.asked;
        let table = match row.start {
            "nothing" => "From nothing",
            _ => "On top of a model with both lanes",
        };
        let mut find = |name: &str, what: &str, value: f64, unit: &str, bound: Option<f64>| {
            let found = Finding::new(SECTION, &format!("row_{index}_{name}"), &[], &format!("{title}: {what}"), value, unit);
            let found = found.cell(table, &title, what);
            study.find(bound.map_or(found.clone(), |bound| found.asked(Asked::AtLeast(bound))));
        };
        find("mean", "reduction, mean", row.reduction_mean, "%", asked.map(|[mean, _]| mean));
        find("worst", "worst", row.reduction_worst, "%", asked.map(|[_, worst]| worst));
        find("baseline", "baseline", row.baseline_cm_mean, "cm", None);
        find("error", "left", row.rms_cm_mean, "cm", None);
        find("minutes", "minutes", row.minutes, "min", None);
    }
}
