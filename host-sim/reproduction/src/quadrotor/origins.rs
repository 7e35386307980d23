//! Reference points of difference learning, and learning without differences.
//!
//! *in* the predecessor's loop, the network with 12 inputs; *out* reductions for each of {inputs, output} x {y_d, y}; *never*
//! another training for another reference point: in the training data y_d and y are the same; *source* Zhou 2017, Insight 3.

use impromptu_report::study::{Finding, Study};
use impromptu_training::Labels;
use rayon::prelude::*;

use super::{
    addon::{Learned, learn},
    ground::Ground,
    inputs::{Origin, twelve},
};

const SECTION: &str = "Difference learning and its reference point";

/// Flies the four choices, and trains without differences.
pub(super) fn run(ground: &Ground<'_>, twelve_inputs: &Learned, study: &mut Study) -> anyhow::Result<()> {
    let closed_loop = &ground.closed_loop;
    let choices: Vec<(Origin, Origin)> = [Origin::Desired, Origin::Measured]
        .into_iter()
        .flat_map(|inputs| [(inputs, Origin::Desired), (inputs, Origin::Measured)])
        .collect();
    let found: Vec<[(f64, f64); 4]> = choices
        .par_iter()
        .map(|&(inputs, base)| {
            let list = twelve(inputs);
            let network = twelve_inputs.file(closed_loop, &twelve_inputs.maps.network, &list, base)?;
            let ridge = twelve_inputs.file(closed_loop, &twelve_inputs.maps.ridge, &list, base)?;
            Ok([
                ground.test.reduction(closed_loop, &network)?,
                ground.validation.reduction(closed_loop, &network)?,
                ground.test.reduction(closed_loop, &ridge)?,
                ground.validation.reduction(closed_loop, &ridge)?,
            ])
        })
        .collect::<anyhow::Result<_>>()?;
    for ((inputs, base), found) in choices.iter().zip(&found) {
        for (map, [test, validation]) in [("network", [found[0], found[1]]), ("ridge", [found[2], found[3]])] {
            let of = |origin: &Origin| if *origin == Origin::Desired { "yd" } else { "y" };
            report(
                study,
                &format!("in_{}_out_{}_{map}", of(inputs), of(base)),
                &format!("{map}, inputs relative to {}, output added to {}", inputs.word(), base.word()),
                test,
                validation,
            );
        }
    }
    let whole = learn(&ground.recipe(twelve(Origin::Nothing)), closed_loop, &ground.logs, Labels::References)?;
    for (map, network) in [("network", &whole.maps.network), ("ridge", &whole.maps.ridge)] {
        let file = whole.file(closed_loop, network, &twelve(Origin::Nothing), Origin::Nothing)?;
        let (test, validation) = (ground.test.reduction(closed_loop, &file)?, ground.validation.reduction(closed_loop, &file)?);
        report(
            study,
            &format!("no_difference_{map}"),
            &format!("{map}, no differences: absolute inputs, whole references"),
            test,
            validation,
        );
    }
    study.note(
        SECTION,
        "One network serves all four choices: in the training data the output stands in the place of the desired state, so that \
         both reference \
         points coincide. An output that is added to the measured state, or inputs that are taken relative to it, close a \
         second loop around \
         the baseline through the held sub-rate tick.",
    );
    Ok(())
}

fn report(study: &mut Study, name: &str, what: &str, test: (f64, f64), validation: (f64, f64)) {
    for (key, of, value) in [
        ("", "mean over the five test trajectories", test.0),
        ("_worst", "worst of the five", test.1),
        ("_strokes", "mean over the validation strokes", validation.0),
    ] {
        // A flight that left the numbers is as bad as can be.
        let value = value.max(-1e6);
        let found = Finding::new(SECTION, &format!("{name}{key}"), &[14, 15], &format!("{what}; {of}"), value, "%");
        study.find(found.cell("Reduction by reference points", what, of));
    }
}
