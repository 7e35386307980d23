//! Row 5.

use impromptu_report::study::{Asked, Finding, Study};

use crate::siso::{
    extensions::{input_affine, mean_and_worst},
    levenberg_marquardt::Settings,
};

use super::summary::summary;

const SECTION: &str = "A nonlinear plant with a known law";
const TABLE: &str = "RMS over a trajectory";

pub(super) fn add(study: &mut Study, settings: &Settings, others: u64, seed: u64) {
    let trials = input_affine::run(settings, others, seed);
    study.note(
        SECTION,
        "y(t+1) = \u{125}(x) + D(x) u(t) with D from 0.15 to 0.45 and a hidden state. The network (2 hidden layers, \
         Levenberg-Marquardt) \
         and ridge get the same features {x(t), y_d(t+1)} and the same rows: random multisines, none of which is flown. RMS \
         over the paper's \
         test trajectory and random ones; the last number of each kind is the worst trajectory's.",
    );
    let mut find = |name: &str, what: &str, errors: Vec<f64>| {
        for (suffix, of, value) in summary(errors, "mean", "worst") {
            let found = Finding::new(SECTION, &format!("nonlinear_{name}{suffix}"), &[5], &format!("{what}, {of}"), value, "");
            study.find(found.cell(TABLE, what, of));
        }
    };
    find("model_rms", "u of the network less u of the exact law", trials.iter().map(|trial| trial.model).collect());
    find("tracking_network", "y - y_d, network", trials.iter().map(|trial| trial.network).collect());
    find("tracking_ridge", "y - y_d, ridge on the same features", trials.iter().map(|trial| trial.ridge).collect());
    find("tracking_plain", "y - y_d, y_d as reference", trials.iter().map(|trial| trial.plain).collect());
    let (_, exact) = mean_and_worst(trials.iter().map(|trial| trial.exact));
    study.find(
        Finding::new(
            SECTION,
            "nonlinear_tracking_exact_worst",
            &[5],
            "y - y_d, exact law u = (y_d(t+r) - \u{125}(x))/D(x), worst",
            exact,
            "",
        )
        .cell(TABLE, "y - y_d, exact law u = (y_d(t+r) - \u{125}(x))/D(x)", "worst")
        .asked(Asked::AtMost(1e-12)),
    );
}
