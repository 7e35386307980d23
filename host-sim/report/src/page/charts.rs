//! The sections with plots: first all flights, then a few in detail.

use super::cards::groups;
use crate::{
    cases::{Case, Scene},
    method::Method,
    notation::speed,
    plots,
    results::{FlightTrace, Results},
};
use maud::{Markup, html};

/// No more paths than this many are drawn.
const PATHS: usize = 9;

pub(super) fn sections(
    results: &Results,
    cases: &[Case<'_>],
    methods: &[Method],
    scenes: &[Scene<'_>],
) -> anyhow::Result<Markup> {
    let (mut reductions, mut errors, mut speeds) = (Vec::new(), Vec::new(), Vec::new());
    for group in groups(cases) {
        let name = html! { (group[0].vehicle) ", " (group[0].gains) " gains" };
        let named = html! { (name) ", " (speed(group[0].speed)) " speed" };
        let (mut reduction, mut error, mut fast) = (Vec::new(), Vec::new(), Vec::new());
        for case in group {
            reduction.extend(plots::reduction_by_method(case, methods)?.map(|svg| figure(case.condition, "", &svg)));
            let distribution = plots::error_distribution(case, methods, &results.per_flight)?;
            error.extend(distribution.map(|svg| figure(case.condition, "", &svg)));
            let same: Vec<&Case<'_>> = cases
                .iter()
                .filter(|other| {
                    (other.vehicle, other.gains, other.condition, other.seed)
                        == (case.vehicle, case.gains, case.condition, case.seed)
                })
                .collect();
            fast.extend(plots::reduction_by_speed(&same)?.map(|svg| figure(case.condition, "", &svg)));
        }
        reductions.push((named.clone(), reduction));
        errors.push((named, error));
        speeds.push((name, fast));
    }
    Ok(html! {
        (section("Which part does what", html! {
            p { "Reduction of the error by method: the mean over all flights, and how far the worst flight falls behind it. "
                "The scale is logarithmic in the error that is left, as reductions crowd near 100 %; below 0 % they are drawn \
                 at 0. The figures at the right are mean / worst." }
            ul.legend {
                (key("dot comparison", "mean")) (key("ring comparison", "worst flight"))
                (key("comparison", "not learned, or feedback alone")) (key("ridge", "ridge, linear"))
                (key("network", "network lane")) (key("both-lanes", "network and feedback lane"))
                (key("learned", "learned in flight"))
            }
        }, &reductions))
        (section("Every flight", html! {
            p { "Each dot is one flight\u{2019}s RMS error. The scale is logarithmic: a step to the left of one decade is 90 % \
            less error. "
                "The figure at the right is the worst flight." }
            ul.legend { (key("dot comparison", "one flight")) (key("bar", "median")) (key("ring comparison", "worst flight")) }
        }, &errors))
        (section("Flying faster", html! {
            p { "The same strokes at a multiple of the drawn speed. Mean reduction of the error; the vertical axis does not \
            start at 0." }
            ul.legend {
                @for method in plots::methods_by_speed() { (key(plots::colour_class(method), &method.label())) }
            }
        }, &speeds))
        (paths(scenes)?)
        (one_flight(scenes)?)
    })
}

/// A section with a heading for each group of panels; empty groups and an empty section leave no trace.
fn section(title: &str, introduction: Markup, groups: &[(Markup, Vec<Markup>)]) -> Markup {
    html! {
        @if groups.iter().any(|(_, panels)| !panels.is_empty()) {
            section {
                h2 { (title) }
                (introduction)
                @for (name, panels) in groups.iter().filter(|(_, panels)| !panels.is_empty()) {
                    h3 { (name) }
                    div.panels { @for panel in panels { (panel) } }
                }
            }
        }
    }
}

fn paths(scenes: &[Scene<'_>]) -> anyhow::Result<Markup> {
    let mut panels = Vec::new();
    for scene in scenes.iter().take(PATHS) {
        let first = scene.first();
        panels.extend(
            plots::path_in_space(scene)?
                .map(|svg| figure(&short(&first.trajectory), &format!("{}, {}", first.vehicle, circumstances(first)), &svg)),
        );
    }
    Ok(section(
        "Paths in space",
        html! {
            p { "One metre is as long across as it is up. Where the blue line runs inside the grey band, the flight is on the \
            desired path." }
            (curves_legend(scenes, false))
        },
        &[(html! { "Scored part of the flight" }, panels)],
    ))
}

/// The first trajectory that flew with and without the add-on, or else the first one.
fn one_flight(scenes: &[Scene<'_>]) -> anyhow::Result<Markup> {
    let complete = scenes.iter().find(|scene| scene.baseline().is_some() && scene.add_on().is_some());
    let Some(scene) = complete.or(scenes.first()) else {
        return Ok(html! {});
    };
    let first = scene.first();
    let add_on = scene.add_on().map_or_else(String::new, |trace| format!(", add-on: {}", trace.method.label()));
    let positions = plots::position_over_time(scene)?;
    let errors = plots::error_over_time(scene)?;
    let corrections = plots::correction_over_time(scene)?;
    if positions.is_empty() && errors.is_empty() && corrections.is_empty() {
        return Ok(html! {});
    }
    Ok(html! {
        section {
            h2 { "One flight in detail" }
            p { (short(&first.trajectory)) ", " (first.vehicle) ", \
            " (first.gains) " gains, " (circumstances(first)) (add_on) "." }
            (curves_legend(scenes, true))
            @if !positions.is_empty() {
                h3 { "Position" }
                div.panels { @for svg in &positions { figure { (svg) } } }
            }
            @if !errors.is_empty() {
                h3 { "Distance from the desired position" }
                div.panels.wide { @for (svg, name) in errors.iter().zip(["on one scale", "add-on alone, enlarged"]) {
                    figure { figcaption { (name) } (svg) }
                } }
            }
            @if !corrections.is_empty() {
                h3 { "What the add-on asks the loop for" }
                p { "Position reference less desired position. The add-on moves nothing else but this reference and the \
                matching velocity reference." }
                div.panels { @for svg in &corrections { figure { (svg) } } }
            }
        }
    })
}

/// `strokes:SEED:3` is stroke 3: the seed stands at the top of the page.
fn short(trajectory: &str) -> String {
    let number = trajectory.strip_prefix("strokes:").and_then(|rest| rest.rsplit(':').next());
    number.map_or_else(|| trajectory.to_owned(), |number| format!("stroke {number}"))
}

fn circumstances(trace: &FlightTrace) -> String {
    format!("{}, {} speed", trace.condition, speed(trace.speed))
}

fn figure(caption: &str, detail: &str, svg: &Markup) -> Markup {
    html! {
        figure {
            figcaption { (caption) @if !detail.is_empty() { " " small { (detail) } } }
            (svg)
        }
    }
}

fn curves_legend(scenes: &[Scene<'_>], over_time: bool) -> Markup {
    let add_on = scenes.iter().find_map(Scene::add_on);
    html! {
        ul.legend {
            (key("band desired", "desired"))
            @if scenes.iter().any(|scene| scene.baseline().is_some()) { (key("baseline", "baseline loop alone")) }
            @if let Some(trace) = add_on { (key("both-lanes", &format!("with the add-on ({})", trace.method.label()))) }
            @if over_time { (key("shade", "scored part")) }
        }
    }
}

fn key(class: &str, text: &str) -> Markup {
    html! { li { i class=(class) aria-hidden="true" {} span { (text) } } }
}
