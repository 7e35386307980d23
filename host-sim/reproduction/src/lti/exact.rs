//! Relative degree, zeros, gain, and the exact laws in two precisions.
//!
//! *in* the paper's systems; *out* rows 3, 4, 6, 8, 12 and 17; *never* more samples than the error needs to show; *source* Zhou 2017,
//! equations (4), (9), (10) and the transfer-function law.

use impromptu_report::study::{Finding, Study};

use crate::siso::{
    FeatureSet, Module, Plant, Run, Scalar, Start,
    fixtures::{PERIOD, test_samples},
    law::{StateSpaceLaw, TransferFunctionLaw},
    simulate,
};

use super::{
    panel,
    systems::{self, System, systems},
};

const SECTION: &str = "Exact laws";
/// Long enough for both precisions to lose S2.
const LONG: usize = 20_000;

pub(super) fn add(study: &mut Study) {
    let mut curves = Vec::new();
    for system in systems() {
        properties(study, &system);
        let model = &system.model;
        let wide = laws::<f64>(study, &system, "f64");
        let narrow = laws::<f32>(study, &system, "f32");
        let transfer = model.transfer_function();
        let set = FeatureSet::transfer_function(model.order(), model.relative_degree());
        let count = set.features.len() as f64;
        study.find(finding(&system, "transfer_function_features", &[12], "transfer-function features, 2n - r + 1", count, ""));
        debug_assert_eq!(set.features.len(), 2 * transfer.order() - transfer.dead_time + 1);
        for (label, errors) in [("f64", wide), ("f32", narrow)] {
            curves.push(panel::curve(&format!("{}, {label}", system.title), errors.into_iter().map(f64::abs)));
        }
    }
    let title = "Error of the exact state-space law: the zero outside of the unit circle multiplies every rounding";
    study.draw(panel::over_time(SECTION, "exact_law_error", title, panel::error_axis(), curves));
    study.note(
        SECTION,
        "The add-on reads the desired output r samples ahead: that is the preview it needs. Beyond the end of a trajectory the last sample is \
         held. S2's inverse is unstable (its zero lies outside of the unit circle), so that Insight 1b refuses it: rounding errors grow as 1.002 \
         to the power of the sample, whatever computes the law.",
    );
}

fn finding(system: &System, name: &str, rows: &[u8], what: &str, value: f64, unit: &str) -> Finding {
    finding_in(SECTION, system, name, rows, what, value, unit)
}

/// A number of one of the systems.
pub(super) fn finding_in(section: &str, system: &System, name: &str, rows: &[u8], what: &str, value: f64, unit: &str) -> Finding {
    Finding::new(section, &format!("{}_{name}", system.key), rows, &format!("{}: {what}", system.title), value, unit).cell(
        "The paper's systems",
        what,
        system.title,
    )
}

fn properties(study: &mut Study, system: &System) {
    let model = &system.model;
    let (zero, paper) = (model.zeros()[0].re, if system.key == "s1" { 0.2 } else { 1.002 });
    let ahead = model.relative_degree();
    study.find(finding(system, "relative_degree", &[3], "relative degree", ahead as f64, "samples").paper(1.0));
    let preview = FeatureSet::state_space(model.order(), ahead).preview();
    study.find(finding(system, "preview", &[6], "preview that the features need", preview as f64, "samples"));
    study.find(finding(system, "zero", &[8, 17], "zero", zero, "").paper(paper));
    study.find(finding(system, "largest_pole", &[17], "largest pole", model.poles()[0].norm(), "").paper(0.5));
    study.find(finding(system, "dc_gain", &[16, 17], "DC gain; difference learning needs 1", model.dc_gain(), ""));
    let stable = f64::from(u8::from(model.is_minimum_phase()));
    study.find(finding(system, "inverse_is_stable", &[8], "stable inverse (1: yes)", stable, ""));
}

/// Both laws in `T`; gives the errors of the state-space law.
fn laws<T: Scalar>(study: &mut Study, system: &System, precision: &str) -> Vec<f64> {
    let model = system.model.cast::<T>();
    let desired = |sample: i64| T::of(systems::desired(sample));
    let fly = |law: &dyn Module<T>| -> Run<T> { simulate(&model, law, &desired, &Start::rest(), LONG) };
    let minute = test_samples(PERIOD);
    let state_space = fly(&StateSpaceLaw::new(&model));
    let transfer = fly(&TransferFunctionLaw::new(&system.model.transfer_function()));
    for (key, what, rows, run) in
        [("state_space", "state-space", [4, 19], &state_space), ("transfer_function", "transfer-function", [12, 19], &transfer)]
    {
        let errors = run.errors();
        let rms = crate::siso::simulation::rms(errors.iter().take(minute).copied());
        let name = format!("exact_{key}_law_rms_{precision}");
        study.find(finding(system, &name, &rows, &format!("RMS error of the exact {what} law over 60 s, {precision}"), rms, ""));
        if let Some(sample) = run.first_error_above(1.0) {
            let name = format!("exact_{key}_law_lost_{precision}");
            let what = format!("first sample with an error above 1, exact {what} law, {precision}");
            study.find(finding(system, &name, &rows, &what, sample as f64, "samples"));
        }
    }
    let largest = state_space.reference.iter().take(minute).fold(0.0, |largest: f64, value| largest.max(value.wide().abs()));
    let name = format!("exact_reference_largest_{precision}");
    let what = format!("largest reference of the exact law over 60 s, {precision}; training has up to 5");
    study.find(finding(system, &name, &[8, 19], &what, largest, ""));
    state_space.errors()
}
