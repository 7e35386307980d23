//! The numbers that matter most: what is flashed, one card for each condition.

use crate::{
    cases::Case,
    method::Method,
    notation::{centimetres_with_unit, percent, speed, with_minus_sign},
    results::Row,
};
use maud::{Markup, html};

/// Cards of the most complete method at the speed nearest to the drawn one, for each vehicle and gains.
pub(super) fn headline(cases: &[Case<'_>]) -> Markup {
    let groups = groups(cases);
    let shown = |case: &Case<'_>| headline_row(case).is_some();
    html! {
        @if cases.iter().any(shown) {
            section {
                h2 { "In short" }
                p { "Reduction of the RMS position error against the same loop without the add-on, mean over the flights." }
                @for group in &groups {
                    h3 { (group[0].vehicle) ", " (group[0].gains) " gains, " (speed(group[0].speed)) " speed" }
                    div.cards { @for case in group { (card(case)) } }
                }
            }
        } @else if cases.is_empty() {
            section { h2 { "In short" } p { "Nothing was flown." } }
        }
    }
}

/// The cases of each vehicle and gains at the speed nearest to 1.
pub(super) fn groups<'a, 'b>(cases: &'a [Case<'b>]) -> Vec<Vec<&'a Case<'b>>> {
    let mut groups: Vec<Vec<&Case<'_>>> = Vec::new();
    for case in cases {
        match groups.iter_mut().find(|group| group[0].vehicle == case.vehicle && group[0].gains == case.gains) {
            Some(group) => group.push(case),
            None => groups.push(vec![case]),
        }
    }
    for group in &mut groups {
        let distance = |case: &Case<'_>| (case.speed - 1.0).abs();
        let nearest = group.iter().map(|case| distance(case)).fold(f64::INFINITY, f64::min);
        // `total_cmp` keeps a group whose speeds are all not a number.
        group.retain(|case| !distance(case).total_cmp(&nearest).is_gt() || nearest.is_infinite());
    }
    groups
}

fn headline_row<'a>(case: &Case<'a>) -> Option<&'a Row> {
    [Method::FullInt8, Method::FullF32, Method::NetInt8, Method::NetF32].into_iter().find_map(|method| case.row(method))
}

fn card(case: &Case<'_>) -> Markup {
    let baseline = case.row(Method::Baseline);
    html! {
        @if let Some(row) = headline_row(case) {
            div.card {
                h4 { (case.condition) @if row.method != Method::FullInt8 { " (" (row.method.label()) ")" } }
                div.figure { (with_minus_sign(&percent(row.reduction_mean))) small { " %" } }
                p { "worst flight " strong { (with_minus_sign(&percent(row.reduction_worst))) " %" } }
                p {
                    @if let Some(baseline) = baseline { (centimetres_with_unit(baseline.rms_cm_mean)) " \u{2192} " }
                    strong { (centimetres_with_unit(row.rms_cm_mean)) } " RMS"
                }
            }
        }
    }
}
