//! Rows as findings and words.
//!
//! *in* rows; *out* entries of a [`Study`]; *never* a percentage without the centimetres that it is of; *source* none.

use impromptu_report::study::{Asked, Finding, Study};

use super::{Settings, cases::Case, machines::Machine, row::Row};

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
        find(study, row, &format!("row_{index}"), [table, &title], asked, (1.0, "cm"));
    }
}

/// A machine that is no quadrotor.
pub(super) fn tell_machine(study: &mut Study, machine: Machine, row: &Row) {
    let title = format!("{}, loop {}, {}", row.vehicle, row.kind, row.seconds.words()).replace('_', " ");
    let table = "Loops that are no quadrotor, from nothing";
    find(study, row, &row.vehicle, [table, &title], machine.asked(), (10.0, "mrad"));
}

/// What was found of a row, in a line of a table; `unit` is how many of it are in the row's unit.
fn find(study: &mut Study, row: &Row, name: &str, [table, title]: [&str; 2], asked: Option<[f64; 2]>, unit: (f64, &str)) {
    let (scale, unit) = unit;
    let [mean, worst] = asked.map_or([None; 2], |asked| asked.map(Some));
    for (key, what, value, unit, bound) in [
        ("mean", "reduction, mean", row.reduction_mean, "%", mean),
        ("worst", "worst", row.reduction_worst, "%", worst),
        ("baseline", "baseline", scale * row.baseline_cm_mean, unit, None),
        ("error", "left", scale * row.rms_cm_mean, unit, None),
        ("minutes", "minutes", row.minutes, "min", None),
    ] {
        let found = Finding::new(SECTION, &format!("{name}_{key}"), &[], &format!("{title}: {what}"), value, unit);
        let found = found.cell(table, title, what);
        study.find(match bound {
            Some(bound) => found.asked(Asked::AtLeast(bound)),
            None => found,
        });
    }
}
