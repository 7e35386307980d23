//! Plain words for the metric, the conditions and the methods.

use crate::{method::Method, results::Results};
use maud::{Markup, html};

/// Definitions of everything that the table names.
pub(super) fn definitions(results: &Results, methods: &[Method]) -> Markup {
    let mut conditions: Vec<(&str, String)> = Vec::new();
    for row in &results.table {
        if conditions.iter().all(|(name, _)| *name != row.condition) {
            conditions.extend(in_words(results, &row.condition).map(|words| (row.condition.as_str(), words)));
        }
    }
    html! {
        section {
            h2 { "What the words mean" }
            h3 { "The measure" }
            dl.words {
                dt { "RMS error" }
                dd { "Square root of the mean squared distance between desired and true position over the scored part of one \
                flight." }
                dt { "Reduction" }
                dd { "100 % less the ratio of that error to the baseline\u{2019}s on the same trajectory, for each flight; then \
                the mean and the smallest "
                    "over all flights. Below 0 % the flight was worse than without the add-on." }
                dt { "Speed" }
                dd { "Factor on the speed at which the trajectory was drawn; accelerations grow with its square." }
            }
            @if !conditions.is_empty() {
                h3 { "The conditions" }
                dl.words { @for (name, words) in &conditions { dt { (name) } dd { (words) } } }
            }
            @if !methods.is_empty() {
                h3 { "The methods" }
                dl.words { @for method in methods { dt { (method.label()) } dd { (method.in_words()) } } }
            }
        }
    }
}

/// The run's own definition, or else that of a usual name; `None` for an unknown one.
fn in_words(results: &Results, condition: &str) -> Option<String> {
    if let Some((_, words)) = results.conditions.iter().find(|(name, _)| name == condition) {
        return Some(words.clone());
    }
    if let Some((nominal, delay)) = condition.split_once('+') {
        return Some(format!(
            "As {nominal}, but with {delay} more delay in the whole loop at test time only: the model was trained without it."
        ));
    }
    let usual = match condition {
        "clean" => "No delay, no noise, no disturbance: what remains is the loop\u{2019}s own lag.",
        "lab" => {
            "Measurements 24 ms late; noise of 0.3 mm, 1 cm/s, 2 mrad and 0.02 rad/s (position, velocity, attitude, rate; \
             standard deviations); \
             random gusts of 0.05 m/s\u{b2} that last about 0.4 s."
        }
        "rough" => {
            "Measurements 24 ms late; noise of 0.7 mm, 2 cm/s, 4 mrad and 0.03 rad/s; random gusts of 0.12 m/s\u{b2} that last \
             about 0.4 s."
        }
        _ => return None,
    };
    Some(usual.to_owned())
}
