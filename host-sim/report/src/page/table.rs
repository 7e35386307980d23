//! The table of all methods under all conditions.

use crate::{
    cases::Case,
    method::Method,
    notation::{NOT_AVAILABLE, centimetres_with_unit, mean_and_worst, speed, with_minus_sign},
    results::Row,
};
use maud::{Markup, html};

pub(super) fn section(cases: &[Case<'_>], methods: &[Method], flights: Option<&str>) -> Markup {
    let several_seeds = cases.iter().any(|case| case.seed != cases[0].seed);
    html! {
        @if !cases.is_empty() {
            section {
                h2 #table { "All methods, all conditions" }
                p {
                    "Upper line: reduction of the RMS position error in %, mean / worst flight"
                    @if let Some(flights) = flights { " of " (flights) }
                    ". Lower line: mean RMS position error. The tinted column is what is flashed."
                }
                div.scroll tabindex="0" role="region" aria-labelledby="table" {
                    table.numbers {
                        thead { tr {
                            th scope="col" { "condition, speed" }
                            @for method in methods {
                                th scope="col" class=[flashed(*method)] {
                                    (method.heading()[0])
                                    @if !method.heading()[1].is_empty() { " " span { (method.heading()[1]) } }
                                }
                            }
                        } }
                        @for block in cases.chunk_by(|a, b| a.vehicle == b.vehicle && a.gains == b.gains) {
                            tbody {
                                tr { th scope="rowgroup" colspan=(methods.len() + 1) {
                                    (block[0].vehicle) ", " (block[0].gains) " gains"
                                } }
                                @for case in block {
                                    tr {
                                        th scope="row" {
                                            (case.condition) " \u{b7} " (speed(case.speed))
                                            @if several_seeds { " \u{b7} seed " (case.seed) }
                                        }
                                        @for method in methods { (cell(*method, case.row(*method))) }
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn flashed(method: Method) -> Option<&'static str> {
    (method == Method::FullInt8).then_some("flashed")
}

fn cell(method: Method, row: Option<&Row>) -> Markup {
    html! {
        td class=[flashed(method)] {
            @match row {
                None => (NOT_AVAILABLE),
                Some(row) if method == Method::Baseline => (centimetres_with_unit(row.rms_cm_mean)),
                Some(row) => {
                    @let figures = with_minus_sign(&mean_and_worst(row.reduction_mean, row.reduction_worst, " / "));
                    @if row.reduction_worst < 0.0 { span.worse title="worst flight worse than the baseline" { (figures) } }
                    @else { (figures) }
                    small { (centimetres_with_unit(row.rms_cm_mean)) }
                }
            }
        }
    }
}
