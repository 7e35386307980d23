//! Where the numbers come from: the models, the command, the seed, the time it took.

use crate::{
    notation::{fixed, thousands},
    results::{LaneOutcome, ModelCard, Results},
};
use maud::{Markup, html};

/// A line for each model file.
pub(super) fn models(models: &[ModelCard]) -> Markup {
    html! {
        @if !models.is_empty() {
            section {
                h2 #models { "The models" }
                p { "Margins are those of the add-on\u{2019}s own feedback loop: the delay and the factor on the loop gain that \
                it would still stand, "
                    "and the smallest distance of its Nyquist curve from \u{2212}1. Quantisation: RMS difference between the \
                     int8 and the f32 network\u{2019}s corrections." }
                div.scroll tabindex="0" role="region" aria-labelledby="models" {
                    table.numbers {
                        thead { tr {
                            th scope="col" { "model" }
                            @for heading in ["size [bytes]", "CRC-32", "parameters", "multiply-adds", "quantisation [mm]",
                                "delay margin [ms]", "gain margin", "modulus margin"] { th scope="col" { (heading) } }
                        } }
                        tbody {
                            @for model in models {
                                tr {
                                    th scope="row" { (model.name) }
                                    td { (thousands(model.bytes)) }
                                    td { code { (format!("{:08x}", model.crc32)) } }
                                    td { (thousands(model.parameters)) }
                                    td { (thousands(model.multiply_adds)) }
                                    td { (optional(model.quantisation_rms_mm, 3)) }
                                    td { (optional(model.margins.map(|margins| margins.delay_ms), 1)) }
                                    td { (optional(model.margins.map(|margins| margins.gain), 2)) }
                                    td { (optional(model.margins.map(|margins| margins.modulus), 2)) }
                                }
                            }
                        }
                    }
                }
                dl.words {
                    @for model in models {
                        dt { (model.name) }
                        dd {
                            "Trained on "
                            @if let Some(minutes) = model.minutes { (fixed(minutes, 1)) " min of flight of " }
                            (model.vehicle) ", " (model.gains) " gains, " (model.condition) ". "
                            @match &model.lane {
                                LaneOutcome::Chosen(design) => { "Feedback lane: " (design) "." }
                                LaneOutcome::Refused(reason) => { span.worse { "No feedback lane: " (reason) "." } }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Command, seed, version, durations and remarks.
pub(super) fn run(results: &Results) -> Markup {
    let total: f64 = results.timings.iter().map(|(_, seconds)| seconds).sum();
    html! {
        section {
            h2 { "How this page was made" }
            dl.words {
                dt { "Command" } dd { code { (results.command) } }
                dt { "Seed" } dd { (results.seed) ". The same seed and version give the same numbers." }
                dt { "Version" } dd { (results.software_version) }
            }
            @if !results.timings.is_empty() {
                h3 { "Time taken" }
                table.plain {
                    thead { tr { th scope="col" { "stage" } th.right scope="col" { "seconds" } } }
                    tbody {
                        @for (stage, seconds) in &results.timings {
                            tr { th scope="row" { (stage) } td.right { (fixed(*seconds, 1)) } }
                        }
                        tr { th scope="row" { "total" } td.right { (fixed(total, 1)) } }
                    }
                }
            }
            @if !results.notes.is_empty() {
                h3 { "Notes" }
                @for note in &results.notes { p { (note) } }
            }
        }
    }
}

fn optional(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "\u{2013}".to_owned(), |value| fixed(value, decimals))
}
