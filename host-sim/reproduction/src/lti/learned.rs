//! The 3-20-20-1 network in front of both systems, in f64 and as the firmware evaluates it.
//!
//! *in* both systems and both feature sets; *out* rows 7, 18 and 19, and figures 2a and 2b; *never* another test than the
//! paper's; *source* Zhou 2017, section V.

use crate::siso::{
    Assessment, FeatureSet, FirmwareModule, Learned, Module, Moment, Plant, Start, assess,
    fixtures::{PERIOD, test_samples},
    law::{StateSpaceLaw, TransferFunctionLaw},
    learn,
    learning::Settings,
};
use anyhow::Result;
use impromptu_model_export::Precision;
use impromptu_report::{
    Axis,
    study::{Asked, Finding, Study},
};

use super::{
    exact::finding_in,
    panel,
    systems::{System, desired, systems},
};

const SECTION: &str = "Learned inverse";
const KERNELS: [(&str, Precision); 3] = [("f32", Precision::Float), ("int16", Precision::Int16), ("int8", Precision::Int8)];

/// The networks of S1, by feature set.
pub(super) struct OfMinimumPhase {
    pub(super) state_space: Learned,
    pub(super) transfer_function: Learned,
}

pub(super) fn add(study: &mut Study, settings: &Settings) -> Result<OfMinimumPhase> {
    let [first, second] = systems();
    let learned = of_system(study, &first, settings)?;
    of_system(study, &second, settings)?;
    study.note(
        SECTION,
        "The model error compares the network's reference with the exact law's at the same moments of the same run. S1 is \
         tracked to rounding. \
         On S2 the network learns its training box (references within 5) just as well, and yet the loop is lost: the exact \
         reference for \
         the test leaves that box, because the inverse is unstable. A small model error beside a lost loop is what the paper \
         found.",
    );
    Ok(learned)
}

fn of_system(study: &mut Study, system: &System, settings: &Settings) -> Result<OfMinimumPhase> {
    let model = &system.model;
    let (order, ahead) = (model.order(), model.relative_degree());
    let law = StateSpaceLaw::new(model);
    let set = FeatureSet::state_space(order, ahead);
    let state_space = learn(model, &set, settings)?;
    let flown = fly(study, system, ("state_space", "state-space features"), &state_space, &law)?;
    let baseline = |moment: &Moment<'_, f64>| moment.desired(0);
    let baseline = assess(model, &baseline, &law, &desired, &Start::rest(), samples());
    let rms = baseline.tracking_rms;
    let what = "tracking RMS with the desired output as reference";
    let found = finding(system, "baseline_tracking_rms", &[19], what, rms, "");
    study.find(found.cell(system.title, "desired output as reference", "tracking, RMS"));
    draw(study, system, &flown, &baseline);
    let law = TransferFunctionLaw::new(&model.transfer_function());
    let transfer_function = learn(model, &FeatureSet::transfer_function(order, ahead), settings)?;
    fly(study, system, ("transfer_function", "transfer-function features"), &transfer_function, &law)?;
    Ok(OfMinimumPhase { state_space, transfer_function })
}

fn samples() -> usize {
    test_samples(PERIOD)
}

fn finding(system: &System, name: &str, rows: &[u8], what: &str, value: f64, unit: &str) -> Finding {
    finding_in(SECTION, system, name, rows, what, value, unit)
}

/// Flies a network in f64 and in each kernel, in that order.
fn fly(
    study: &mut Study,
    system: &System,
    (key, what): (&str, &str),
    learned: &Learned,
    law: &dyn Module<f64>,
) -> Result<Vec<Assessment>> {
    let name = format!("{key}_iterations");
    let text = format!("steps of Levenberg-Marquardt, {what}");
    let row = |precision: &str| format!("{what}, {precision}");
    let steps = finding(system, &name, &[18], &text, learned.fit.steps() as f64, "").asked(Asked::AtMost(1000.0));
    study.find(steps.cell(system.title, &row("f64"), "Levenberg-Marquardt, steps"));
    let assessed = |module: &dyn Module<f64>| assess(&system.model, module, law, &desired, &Start::rest(), samples());
    let mut flown = vec![assessed(&learned.module())];
    for (_, precision) in KERNELS {
        let file = learned.file(precision, PERIOD)?;
        flown.push(assessed(&FirmwareModule::new(&file, &learned.set)?));
    }
    for (precision, assessment) in ["f64"].into_iter().chain(KERNELS.map(|kernel| kernel.0)).zip(&flown) {
        for (quantity, text, rows, value) in [
            ("model_rms", "network less exact law, RMS", [7, 19], assessment.model_rms),
            ("tracking_rms", "tracking, RMS", [18, 19], assessment.tracking_rms),
        ] {
            let name = format!("{key}_{quantity}_{precision}");
            let found = finding(system, &name, &rows, &format!("{text}, {what}, {precision}"), value, "");
            let found = found.cell(system.title, &row(precision), text);
            study.find(beside_the_paper(found, system, key, quantity, precision));
        }
    }
    Ok(flown)
}

/// The paper has state-space features in f64.
fn beside_the_paper(finding: Finding, system: &System, key: &str, quantity: &str, precision: &str) -> Finding {
    let finding = match (system.key, key, quantity, precision) {
        ("s1", "state_space", "model_rms", "f64") => finding.paper(2e-6),
        ("s1", "state_space", "tracking_rms", "f64") => finding.paper(1e-6),
        ("s2", "state_space", "model_rms", "f64") => finding.paper(0.06),
        _ => finding,
    };
    match (system.key, key, precision) {
        ("s1", "state_space", "f64") => finding.asked(Asked::AtMost(1e-8)),
        ("s1", "state_space", "f32") => finding.asked(Asked::AtMost(4e-7)),
        _ => finding,
    }
}

/// Figures 2a and 2b, and the error that they cannot show.
fn draw(study: &mut Study, system: &System, flown: &[Assessment], baseline: &Assessment) {
    let [wide, _, _, int8] = flown else { return };
    let (key, title) = (system.key, system.title);
    let reference = vec![
        panel::curve("exact law", wide.exact.iter().copied()),
        panel::curve("network, f64", wide.run.reference.iter().copied()),
        panel::curve("network, int8", int8.run.reference.iter().copied()),
    ];
    let text = format!("{title}, figure 2a: references");
    study.draw(panel::over_time(SECTION, &format!("{key}_figure_2a"), &text, Axis::linear("u"), reference));
    let output = vec![
        panel::curve("desired", wide.run.desired.iter().copied()),
        panel::curve("network, f64", wide.run.output.iter().copied()),
        panel::curve("network, int8", int8.run.output.iter().copied()),
        panel::curve("desired output as reference", baseline.run.output.iter().copied()),
    ];
    let text = format!("{title}, figure 2b: outputs");
    study.draw(panel::over_time(SECTION, &format!("{key}_figure_2b"), &text, Axis::linear("y"), output));
    let mut errors: Vec<_> = ["f64", "f32", "int16", "int8"]
        .iter()
        .zip(flown)
        .map(|(name, flown)| panel::curve(&format!("network, {name}"), flown.run.errors().into_iter().map(f64::abs)))
        .collect();
    errors.push(panel::curve("desired output as reference", baseline.run.errors().into_iter().map(f64::abs)));
    let text = format!("{title}: error of what figure 2b shows");
    study.draw(panel::over_time(SECTION, &format!("{key}_error"), &text, panel::error_axis(), errors));
}
