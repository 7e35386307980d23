//! Lemma 1: difference learning on loops of unit and of other DC gain.
//!
//! *in* a loop with y = x₁ and x₂ = 0 in steady state, of three DC gains; *out* rows 14 to 16; *never* a prediction from the run
//! that it predicts: it follows from the network and K₀ alone; *source* Zhou 2017, section III-C: y_ss = K₀ (K + b), b being the
//! network's output for inputs that are all zero. In training y(t) stands where y_d(t) stands in flight, so x₁ - y_d is always
//! zero there and is not learned.

use crate::siso::{
    FeatureSet, Learned, Plant, Start, fixtures::position_and_difference, learn, learning::Settings, levenberg_marquardt,
    simulate,
};
use anyhow::Result;
use impromptu_firmware::features::Source;
use impromptu_report::{
    Axis, Curve, Figure,
    study::{Asked, Finding, Study},
};
use nalgebra::DMatrix;

use super::systems::desired;

const SECTION: &str = "Difference learning";
/// DC gains, and their part of a name.
const GAINS: [(f64, &str); 3] = [(1.0, "unit_gain"), (0.7, "gain_0_7"), (1.5, "gain_1_5")];
/// Constant desired outputs.
const STEPS: [i32; 9] = [-4, -3, -2, -1, 0, 1, 2, 3, 4];
/// Those whose steady states are numbers of the report.
const NAMED: [(i32, &str); 3] = [(1, "step_1"), (2, "step_2"), (-3, "step_minus_3")];
/// Long enough for any of the loops to come to rest.
const SAMPLES: usize = 3000;
/// Samples in which the desired output rises to K: a jump would leave the training data.
const RISE: f64 = 1000.0;
const SHIFT: f64 = 10.0;

pub(super) fn add(study: &mut Study, settings: &Settings) -> Result<()> {
    let sets = [
        ("state_space", "with state features", FeatureSet::state_space(2, 2).difference()),
        ("desired_only", "of the desired output alone", FeatureSet::window(1, 2, 1).difference()),
    ];
    // Where the target is one-to-many, more steps fit its accidents.
    let training = levenberg_marquardt::Settings { iterations: settings.training.iterations.min(40), ..settings.training };
    let settings = Settings { training, restarts: 1, ..*settings };
    for (key, what, set) in sets {
        let mut curves = Vec::new();
        for (gain, name) in GAINS {
            let learned = learn(&position_and_difference(gain), &set, &settings)?;
            if gain == 1.0 && key == "state_space" {
                shifted(study, &learned);
            }
            curves.extend(steps(study, &learned, gain, &format!("{name}_{key}"), what));
        }
        study.draw(Figure {
            section: SECTION.into(),
            name: format!("steady_state_error_{key}"),
            title: format!("Steady-state error after a step to K, difference learning {what}: dots found, lines predicted"),
            x: Axis::linear("K"),
            y: Axis::linear("y_ss - K"),
            curves,
        });
    }
    study.note(
        SECTION,
        "Without steady-state error the network would have to add K / K0 - K, another number for each K, to the same inputs: \
         only K0 = 1 lets it. \
         The steady state is K0 (K + b) with the one b that training left. The state does not help: in training y_d(t) is y(t), \
         so that x1 - y_d is \
         always zero there. With state features and K0 other than 1 the loop does not even come to rest, and the numbers found \
         are those of the last \
         sample: on sines the acceleration tells where one is (p = -a / omega^2), the network reads K / K0 - K from it with a \
         very large gain on the \
         second difference, and this feedback moves a pole of the loop out of the unit circle, as the largest poles below say.",
    );
    Ok(())
}

/// K₀ (K + b).
fn predicted(learned: &Learned, gain: f64, step: f64) -> f64 {
    gain * (step + learned.network().evaluate(&vec![0.0; learned.set.features.len()]))
}

/// Magnitude of the largest pole of the loop with the network in front, linearised where the inputs are zero.
fn largest_pole(learned: &Learned, gain: f64) -> f64 {
    let system = position_and_difference(gain);
    let order = Plant::<f64>::order(&system);
    let step = 1e-6;
    let slope = |feature: usize| {
        let at = |value: f64| {
            let mut inputs = vec![0.0; learned.set.features.len()];
            inputs[feature] = value;
            learned.network().evaluate(&inputs)
        };
        (at(step) - at(-step)) / (2.0 * step)
    };
    let mut feedback = vec![0.0; order];
    for (index, feature) in learned.set.features.iter().enumerate().filter(|(_, feature)| feature.source == Source::Measured) {
        feedback[usize::from(feature.channel)] += slope(index);
    }
    let mut matrix = DMatrix::zeros(order, order);
    for (state, mut column) in matrix.column_iter_mut().enumerate() {
        let mut next: Vec<f64> = (0..order).map(|index| if index == state { 1.0 } else { 0.0 }).collect();
        system.advance(&mut next, feedback[state]);
        column.copy_from_slice(&next);
    }
    matrix.complex_eigenvalues().iter().map(|pole| pole.norm()).fold(0.0, f64::max)
}

/// Steady states at several K.
fn steps(study: &mut Study, learned: &Learned, gain: f64, key: &str, what: &str) -> [Curve; 2] {
    let system = position_and_difference(gain);
    let module = learned.module();
    let rest = |step: f64| {
        let run = simulate(&system, &module, &|sample| step * (sample as f64 / RISE).min(1.0), &Start::rest(), SAMPLES);
        run.output[SAMPLES - 1]
    };
    let states: Vec<(f64, f64, f64)> = STEPS.map(f64::from).map(|step| (step, rest(step), predicted(learned, gain, step))).into();
    let title = format!("DC gain {gain}, difference learning {what}");
    let (table, row) = (format!("Steady state after a step to K, difference learning {what}"), format!("DC gain {gain}"));
    for (step, name) in NAMED {
        let Some((step, found, predicted)) = states.iter().find(|state| state.0 == f64::from(step)) else { continue };
        let mut number = |suffix: &str, text: &str, value: f64| {
            let text = format!("{title}: {text}, K = {step}");
            let found = Finding::new(SECTION, &format!("{key}_{name}_{suffix}"), &[14, 16], &text, value, "");
            study.find(found.cell(&table, &row, &format!("K = {step}, {suffix}")));
        };
        number("found", "steady state found", *found);
        number("predicted", "steady state K0 (K + b)", *predicted);
    }
    let apart = states.iter().map(|(_, found, predicted)| (found - predicted).abs()).fold(0.0, f64::max);
    let text = format!("{title}: largest difference of steady state and K0 (K + b) over nine K");
    let apart = Finding::new(SECTION, &format!("{key}_lemma_error"), &[16], &text, apart, "");
    let apart = apart.cell(&table, &row, "largest |y_ss - K0 (K + b)|");
    let pole = largest_pole(learned, gain);
    let text = format!("{title}: largest pole of the loop with the network, linearised at rest");
    let found = Finding::new(SECTION, &format!("{key}_pole"), &[16], &text, pole, "");
    study.find(found.cell(&table, &row, "largest pole with the network"));
    // A loop that does not come to rest has no steady state to be asked for.
    let rests = pole < 1.0;
    study.find(if rests { apart.asked(Asked::AtMost(1e-6)) } else { apart });
    let worst = states.iter().map(|(step, found, _)| (found - step).abs()).fold(0.0, f64::max);
    let text = format!("{title}: largest steady-state error over nine K");
    let found = Finding::new(SECTION, &format!("{key}_largest_error"), &[16], &text, worst, "");
    study.find(found.cell(&table, &row, "largest |y_ss - K|"));
    [
        Curve::dots(&format!("DC gain {gain}, found"), states.iter().map(|state| (state.0, state.1 - state.0))),
        Curve::line(&format!("DC gain {gain}, predicted"), states.iter().map(|state| (state.0, state.2 - state.0))),
    ]
}

/// The test trajectory, and the same moved away from all that was trained on.
fn shifted(study: &mut Study, learned: &Learned) {
    let system = position_and_difference(1.0);
    let module = learned.module();
    let plain = simulate(&system, &module, &desired, &Start::rest(), SAMPLES);
    let start = Start { state: vec![SHIFT, 0.0], ..Start::rest() };
    let moved = simulate(&system, &module, &|sample| desired(sample) + SHIFT, &start, SAMPLES);
    let apart = moved.output.iter().zip(&plain.output).map(|(moved, plain)| (moved - plain - SHIFT).abs()).fold(0.0, f64::max);
    let text =
        format!("DC gain 1: largest change of the outputs when everything is moved by {SHIFT}, outside of the training data");
    study.find(Finding::new(SECTION, "translation_error", &[14], &text, apart, "").asked(Asked::AtMost(1e-9)));
    let text = "DC gain 1: tracking RMS of difference learning on the test trajectory";
    study.find(Finding::new(SECTION, "difference_tracking_rms", &[14], text, plain.tracking_rms(0), ""));
}
