//! What the training flights must excite.
//!
//! *in* five training signals of about equal length; *out* reductions with the same 12 inputs, network and budget; *never* a
//! signal with the test's trajectories in it; *source* Li et al., ICRA 2017 (three growing tones); the others are ours.

use impromptu_report::{
    Axis, Curve, Figure,
    study::{Finding, Study},
};
use impromptu_sim::trajectory::{Motion, growing_tones, single_tone};
use impromptu_training::{FlightSet, Labels, Purpose, Signal, derived};
use rayon::prelude::*;

use super::{
    addon::{Course, learn},
    crazyflie::Crazyflie,
    ground::{Ground, multisine},
    inputs::{Origin, twelve},
};

const SECTION: &str = "Training signals";
const TABLE: &str = "Predecessor's loop: mean reduction over the five test trajectories";
const CRAZYFLIE_TABLE: &str = "Crazyflie, lab: reduction over validation strokes";

/// What came of a signal.
struct Flown<const N: usize> {
    name: &'static str,
    words: &'static str,
    /// R² on rows kept from training.
    determination: f64,
    /// Mean and worst reduction in each of the ways of flying.
    reductions: [(f64, f64); N],
}

/// The signals: name, words, motions.
fn signals(ground: &Ground<'_>) -> Vec<(&'static str, &'static str, Vec<Motion>)> {
    let seed = derived(ground.settings.seed, Purpose::Training);
    let flights = ground.settings.flights;
    let seconds = 100.0 * f64::from(flights);
    // One flight has no fourth: the same again decides when to stop.
    let repeated = |motions: Vec<Motion>| [motions.clone(), motions].concat();
    let random = |signal, flights, shortest_s| FlightSet { signal, flights, shortest_s, ..multisine(flights) }.motions(seed);
    let sine = (0..3).map(|axis| single_tone(axis, 0.8, 6.0, 6.0 * (seconds / 18.0).floor().max(2.0))).collect();
    vec![
        ("sine", "one sine, axis by axis", repeated(sine)),
        ("tones", "three growing tones (the predecessor's)", repeated(vec![growing_tones([6.0, 7.5, 9.0], 0.75 * seconds)])),
        ("multisine", "multisine, twelve tones an axis", random(Signal::Multisine, flights, 1.5)),
        ("spline", "splines through random points", random(Signal::Spline, flights, 1.5)),
        ("strokes", "strokes of other seeds", random(Signal::Strokes, 5 * flights, 0.0)),
    ]
}

/// Trains on each signal and flies validation strokes and test trajectories.
pub(super) fn run(ground: &Ground<'_>, study: &mut Study) -> anyhow::Result<()> {
    let closed_loop = &ground.closed_loop;
    let first = derived(ground.settings.seed, Purpose::Training);
    let found: Vec<Flown<4>> = signals(ground)
        .into_par_iter()
        .map(|(name, words, motions)| {
            let logs = closed_loop.collect(&motions, None, first)?;
            let learned = learn(&ground.recipe(twelve(Origin::Measured)), closed_loop, &logs, Labels::Corrections)?;
            let fly = |course: &Course, network, origin| {
                course.reduction(closed_loop, &learned.file(closed_loop, network, &twelve(origin), Origin::Desired)?)
            };
            let flown = [
                fly(&ground.test, &learned.maps.network, Origin::Measured)?,
                fly(&ground.test, &learned.maps.network, Origin::Desired)?,
                fly(&ground.test, &learned.maps.ridge, Origin::Measured)?,
                fly(&ground.test, &learned.maps.ridge, Origin::Desired)?,
            ];
            Ok(Flown { name, words, determination: learned.maps.determination, reductions: flown })
        })
        .collect::<anyhow::Result<_>>()?;
    let kinds = ["network_y", "network_yd", "ridge_y", "ridge_yd"];
    let words =
        ["network, inputs relative to y", "network, inputs relative to y_d", "ridge, relative to y", "ridge, relative to y_d"];
    for Flown { name, words: signal, determination, reductions } in &found {
        for ((kind, word), (mean, _)) in kinds.iter().zip(words).zip(reductions) {
            let text = format!("{signal}: {word}, mean over the five test trajectories");
            let found = Finding::new(SECTION, &format!("signal_{name}_{kind}"), &[28], &text, mean.max(-1e6), "%");
            study.find(found.cell(TABLE, signal, word));
        }
        let text = format!("{signal}: R² of the network on the flights kept from training");
        let found = Finding::new(SECTION, &format!("signal_{name}_rows"), &[28], &text, 100.0 * determination, "%");
        study.find(found.cell(TABLE, signal, "R² on flights kept from training"));
    }
    study.draw(Figure {
        section: SECTION.into(),
        name: "signals".into(),
        title: format!(
            "Mean reduction by training signal: {}; worse than -100 % is drawn as -100 %",
            found.iter().enumerate().map(|(index, flown)| format!("{} {}", index + 1, flown.name)).collect::<Vec<_>>().join(", ")
        ),
        x: Axis::linear("training signal"),
        y: Axis::linear("reduction [%]"),
        curves: kinds
            .iter()
            .enumerate()
            .map(|(kind, _)| {
                Curve::dots(
                    words[kind],
                    found.iter().enumerate().map(|(index, flown)| ((index + 1) as f64, flown.reductions[kind].0.max(-100.0))),
                )
            })
            .collect(),
    });
    study.note(
        SECTION,
        "R² on rows of the same signal says nothing about the reduction in flight: a signal that excites little is easily \
         fitted. Without noise a linear \
         map finds the loop's inverse in any of them; a network with the loop through the measured state closed needs rows all \
         around.",
    );
    Ok(())
}

/// The same with noise: a Crazyflie in the lab, the window of desired positions, a linear map and the network that refines it.
pub(super) fn crazyflie(ground: &Ground<'_>, crazyflie: &Crazyflie, study: &mut Study) -> anyhow::Result<()> {
    let closed_loop = &crazyflie.lab;
    let first = derived(ground.settings.seed, Purpose::Training);
    let found: Vec<Flown<2>> = signals(ground)
        .into_par_iter()
        .map(|(name, words, motions)| {
            let logs = closed_loop.collect(&motions, None, first)?;
            let learned = learn(&crazyflie.recipe, closed_loop, &logs, Labels::Corrections)?;
            let fly = |file: Vec<u8>| crazyflie.lab_course.reduction(closed_loop, &file);
            Ok(Flown {
                name,
                words,
                determination: learned.maps.determination,
                reductions: [fly(learned.ridge_file(closed_loop)?)?, fly(learned.network_file(closed_loop)?)?],
            })
        })
        .collect::<anyhow::Result<_>>()?;
    for Flown { name, words, reductions, .. } in &found {
        for ((kind, map), (mean, worst)) in
            [("ridge", "ridge on the window"), ("network", "network beside it")].iter().zip(reductions)
        {
            for (key, what, value) in [("", "mean", mean), ("_worst", "worst", worst)] {
                let text = format!("Crazyflie, lab, {words}: {map}, {what} over the validation strokes");
                let name = format!("crazyflie_signal_{name}_{kind}{key}");
                let found = Finding::new(SECTION, &name, &[28], &text, value.max(-1e6), "%");
                study.find(found.cell(CRAZYFLIE_TABLE, words, &format!("{map}, {what}")));
            }
        }
    }
    Ok(())
}
