//! What state features buy: initial errors and disturbances, beside transfer-function features.
//!
//! *in* S1 and its two networks; *out* row 13; *never* a module that sees the disturbance; *source* Zhou 2017, end of section
//! III-B.

use impromptu_report::study::{Finding, Study};

use crate::siso::{
    Module, Run, Start,
    fixtures::{PERIOD, minimum_phase},
    law::{StateSpaceLaw, TransferFunctionLaw},
    simulate,
};

use super::{learned::OfMinimumPhase, panel, systems::desired};

const SECTION: &str = "State-space and transfer-function features";
/// Second state at the start; the module and the desired output know of rest.
const INITIAL: [f64; 2] = [0.0, 1.0];
/// Added to the reference between these samples.
const DISTURBANCE: f64 = 0.5;
const DISTURBED: std::ops::Range<i64> = 500..1000;
const SAMPLES: usize = 1500;

fn disturbance(sample: i64) -> f64 {
    if DISTURBED.contains(&sample) { DISTURBANCE } else { 0.0 }
}

pub(super) fn add(study: &mut Study, networks: &OfMinimumPhase) {
    let system = minimum_phase();
    let (state_space, transfer) = (networks.state_space.module(), networks.transfer_function.module());
    let exact = (StateSpaceLaw::new(&system), TransferFunctionLaw::new(&system.transfer_function()));
    let modules: [(&str, &str, &dyn Module<f64>); 4] = [
        ("state_space_exact", "exact law, state", &exact.0),
        ("transfer_function_exact", "exact law, transfer function", &exact.1),
        ("state_space_network", "network, state", &state_space),
        ("transfer_function_network", "network, transfer function", &transfer),
    ];
    let mut curves = Vec::new();
    for (key, label, module) in modules {
        let start = Start { state: INITIAL.to_vec(), disturbance: &disturbance };
        let run: Run<f64> = simulate(&system, module, &desired, &start, SAMPLES);
        let errors = run.errors();
        let settled = settling(&errors[..DISTURBED.start as usize], 1e-3);
        study.find(
            Finding::new(
                SECTION,
                &format!("{key}_settling"),
                &[13],
                &format!("{label}: samples until an initial error of 1 is below 1e-3"),
                settled as f64,
                "samples",
            )
            .cell("S1", label, "initial error of 1 below 1e-3 after"),
        );
        let disturbed = errors[DISTURBED.end as usize - 1].abs();
        study.find(
            Finding::new(
                SECTION,
                &format!("{key}_disturbed"),
                &[13],
                &format!("{label}: error under a constant disturbance of {DISTURBANCE} on the reference"),
                disturbed,
                "",
            )
            .cell("S1", label, &format!("error under a disturbance of {DISTURBANCE}")),
        );
        curves.push(panel::curve(label, errors.into_iter().map(|error| error.abs().max(1e-17))));
    }
    let title = "S1 with an initial error, and a disturbance between 5 and 10 s";
    study.draw(panel::over_time(SECTION, "disturbance_and_initial_error", title, panel::error_axis(), curves));
    study.note(
        SECTION,
        &format!(
            "State features see what an initial error or a disturbance did to the state and correct it within r samples of \
             {PERIOD} s; what acts \
             within those r samples remains (here the whole of {DISTURBANCE}, as r is 1). Transfer-function features see \
             neither: the error decays \
             as the loop's poles let it, and the disturbance passes with the loop's own gain, 16/7."
        ),
    );
}

/// Samples until no error is above a limit.
fn settling(errors: &[f64], limit: f64) -> usize {
    errors.iter().rposition(|error| error.abs() > limit).map_or(0, |sample| sample + 1)
}
