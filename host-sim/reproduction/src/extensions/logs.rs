//! Real flight logs.

use impromptu_files::reading;
use std::{fs, path::Path};

use crate::siso::extensions::{
    flights::{self, Flight, Prediction},
    mean_and_worst,
};
use anyhow::{Context, Result};
use impromptu_report::{
    Axis, Curve, Figure,
    study::{Finding, Study},
};

use super::summary::summary;

const SECTION: &str = "Real logs: a Crazyflie with its stock controller, horizontal position";

macro_rules! logs {
    ($($name:literal),* $(,)?) => { [$(($name, include_str!(concat!("../../data/nanobench/", $name, ".csv")))),*] };
}

/// Logs in the program (BSD-3-Clause, see `data/nanobench`), but for the flight of another controller.
const LOGS: [(&str, &str); 17] = logs![
    "B10_lissajous_fast_rep1",
    "B10_lissajous_slow_rep1",
    "B2_circle_medium_rep2",
    "B2_circle_slow_rep1",
    "B3_figure8_fast_rep1",
    "B3_figure8_medium_rep1",
    "B3_figure8_slow_rep1",
    "B5_helix_fast_rep1",
    "B5_helix_medium_rep1",
    "B6_linear_ramp_rep2",
    "B7_oval_medium_rep2",
    "B7_oval_slow_rep2",
    "B8_star_fast_rep1",
    "B8_star_medium_rep1",
    "B8_star_slow_rep1",
    "B9_trefoil_medium_rep1",
    "B9_trefoil_slow_rep1",
];

/// Flights of a folder, or those in the program.
pub(super) fn load(folder: Option<&Path>) -> Result<Vec<Flight>> {
    let Some(folder) = folder else {
        return LOGS.iter().map(|(name, text)| Ok(Flight::parse(name, text)?)).collect();
    };
    let mut paths = fs::read_dir(folder)
        .and_then(|entries| entries.map(|entry| entry.map(|entry| entry.path())).collect::<std::io::Result<Vec<_>>>())
        .with_context(|| format!("cannot read the folder of logs {}", folder.display()))?;
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "csv"));
    paths.sort();
    paths
        .iter()
        .map(|path| {
            let text = reading::read_text(path, reading::TABLE).with_context(|| format!("cannot read {}", path.display()))?;
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            Ok(Flight::parse(&name, &text)?)
        })
        .collect()
}

/// Predicts each family from the others.
pub(super) fn add(study: &mut Study, folder: Option<&Path>) -> Result<()> {
    let flights = flights::distinct(load(folder)?);
    let predictions = flights::predict(&flights)?;
    study.note(
        SECTION,
        "Nothing was flown here. A delay and a second-order lag are identified from the flights of all other families (copies \
         under another name \
         are dropped by content), a window of the desired position is learned from the same flights, and the model says what \
         the window would leave. That \
         is a model's word about a model: it shares the model's blind spots (saturation, wind, the battery, what set-points \
         faster than the logged ones do). \
         The model's free run misses the measured flights by the misfit below; a predicted error smaller than that is no more \
         than \u{201c}about the misfit \
         or less\u{201d}, and the cautious number adds the misfit. Nearly all of the baseline's error is lag: a pure time shift \
         must stand beside it.",
    );
    let count = predictions.len() as f64;
    study.find(Finding::new(SECTION, "logs_flights", &[], "flights predicted, each from other families", count, ""));
    let mut find = |name: &str, what: &str, of: &dyn Fn(&Prediction) -> f64| {
        let errors = predictions.iter().map(|prediction| 100.0 * of(prediction));
        for (suffix, of, value) in summary(errors, "mean of the flights", "worst flight") {
            let found = Finding::new(SECTION, &format!("logs_{name}{suffix}"), &[], &format!("{what}, {of}"), value, "cm");
            study.find(found.cell("RMS error", what, of));
        }
    };
    find("measured", "error as flown", &|prediction| prediction.measured);
    find("repeated", "error of the model without add-on", &|prediction| prediction.repeated);
    find("misfit", "free run of the model against the flight", &|prediction| prediction.misfit);
    find("window", "predicted error with the learned window", &|prediction| prediction.window);
    find("shift", "predicted error with a pure time shift", &|prediction| prediction.shift);
    find("cautious", "predicted error with the learned window and the misfit", &Prediction::cautious);
    let mean = |of: &dyn Fn(&Prediction) -> f64| mean_and_worst(predictions.iter().map(of)).0;
    for (name, what, error) in [
        ("window", "learned window", mean(&|prediction| prediction.window)),
        ("shift", "pure time shift", mean(&|prediction| prediction.shift)),
        ("cautious", "learned window, with the misfit", mean(&Prediction::cautious)),
    ] {
        let reduction = 100.0 * (1.0 - error / mean(&|prediction| prediction.measured));
        let what = format!("predicted reduction of the mean error, {what}");
        study.find(Finding::new(SECTION, &format!("logs_reduction_{name}"), &[], &what, reduction, "%"));
    }
    study.find(Finding::new(SECTION, "logs_shift_time", &[], "time shift, mean", mean(&|prediction| prediction.shift_time), "s"));
    let curve = |label: &str, of: &dyn Fn(&Prediction) -> f64| {
        Curve::dots(label, predictions.iter().zip(1..).map(|(prediction, flight)| (f64::from(flight), 100.0 * of(prediction))))
    };
    study.draw(Figure {
        section: SECTION.into(),
        name: "logs_prediction".into(),
        title: "Errors as flown and as predicted, flight by flight".into(),
        x: Axis::linear("flight, by family"),
        y: Axis::linear("RMS error [cm]"),
        curves: vec![
            curve("predicted, learned window", &|prediction| prediction.window),
            curve("as flown", &|prediction| prediction.measured),
            curve("the model without add-on", &|prediction| prediction.repeated),
            curve("predicted, time shift", &|prediction| prediction.shift),
            curve("the model's misfit", &|prediction| prediction.misfit),
        ],
    });
    Ok(())
}
