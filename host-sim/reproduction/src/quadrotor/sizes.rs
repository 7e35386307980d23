//! Network sizes: tracking against cycles on the microcontroller.
//!
//! *in* a Crazyflie in the lab and a clean brushless one, trained up to twice the test strokes' speed; *out* reductions at 1 and
//! 1.7 times the speed, and cycles; *never* cycles that the golden table contradicts; *source* `tests/golden/mcu.txt`: cycles of
//! the int8 kernel with its weights in flash.

use impromptu_model_export::float_network::Activation;
use impromptu_report::{
    Axis, Curve, Figure,
    study::{Finding, Study},
};
use impromptu_training::{Labels, Recipe, supervised::TrainingSettings};
use rayon::prelude::*;

use super::{addon::learn, crazyflie::Crazyflie};

const SECTION: &str = "Network size: tracking against cycles on the microcontroller";
/// Cycles of a multiply-add and of a neuron, through the golden rows `12-128x4-6` and `shipped`, int8, weights in flash.
const CYCLES: [f64; 2] = [0.733, 90.3];
/// Hidden layers that are tried; none is the ridge regression.
const SIZES: [&[usize]; 8] = [&[], &[8], &[16], &[32], &[32, 32], &[64, 64], &[128, 128], &[128, 128, 128, 128]];

/// Estimated cycles of an evaluation: int8 layers beside a linear map, at 168 MHz with 5 flash wait states.
pub fn cycles(inputs: usize, hidden: &[usize], outputs: usize) -> f64 {
    let widths: Vec<usize> = [inputs].into_iter().chain(hidden.iter().copied()).chain([outputs]).collect();
    let products: usize = widths.windows(2).map(|pair| pair[0] * pair[1]).sum();
    let neurons: usize = widths[1..].iter().sum();
    CYCLES[0] * products as f64 + CYCLES[1] * neurons as f64
}

fn words(hidden: &[usize]) -> String {
    match hidden {
        [] => "linear".into(),
        [first, ..] => format!("{first}x{}", hidden.len()),
    }
}

/// Where sizes are compared: name, words.
const CASES: [(&str, &str); 4] = [
    ("lab", "Crazyflie, lab"),
    ("lab_fast", "Crazyflie, lab, 1.7 times as fast"),
    ("brushless", "Crazyflie Brushless, clean"),
    ("brushless_fast", "Crazyflie Brushless, clean, 1.7 times as fast"),
];

/// Trains each size and flies.
pub(super) fn run(crazyflie: &Crazyflie, study: &mut Study) -> anyhow::Result<()> {
    let loops = [
        (&crazyflie.lab, &crazyflie.lab_logs, [&crazyflie.lab_course, &crazyflie.fast_course]),
        (&crazyflie.brushless, &crazyflie.brushless_logs, [&crazyflie.brushless_course, &crazyflie.brushless_fast_course]),
    ];
    let found: Vec<Vec<(f64, f64)>> = SIZES
        .par_iter()
        .map(|hidden| {
            let activation = if hidden.len() > 2 { Activation::Relu } else { Activation::Tanh };
            let network = match hidden.is_empty() {
                true => crazyflie.linear(),
                // Large networks must not look poor because they were trained for a short time.
                false => {
                    let epochs = 3 * crazyflie.recipe.network.epochs;
                    TrainingSettings { hidden: hidden.to_vec(), activation, epochs, ..crazyflie.recipe.network.clone() }
                }
            };
            let recipe = Recipe { network, ..crazyflie.recipe.clone() };
            let mut flown = Vec::new();
            for (closed_loop, logs, courses) in loops {
                let learned = learn(&recipe, closed_loop, logs, Labels::Corrections)?;
                let file =
                    if hidden.is_empty() { learned.ridge_file(closed_loop)? } else { learned.network_file(closed_loop)? };
                for course in courses {
                    flown.push(course.reduction(closed_loop, &file)?);
                }
            }
            Ok(flown)
        })
        .collect::<anyhow::Result<_>>()?;
    let inputs = crazyflie.recipe.features().len();
    let cost: Vec<f64> = SIZES.iter().map(|hidden| cycles(inputs, hidden, 6)).collect();
    for ((hidden, cost), found) in SIZES.iter().zip(&cost).zip(&found) {
        let name = words(hidden);
        let mut find = |key: &str, what: &str, value: f64, unit: &str| {
            let text = format!("{name}: {what}");
            let found = Finding::new(SECTION, &format!("size_{name}_{key}"), &[21, 30], &text, value, unit);
            study.find(found.cell("Size of the network", &name, what));
        };
        find("cycles", "cycles of an evaluation, estimated", *cost, "");
        for ((key, case), (mean, worst)) in CASES.iter().zip(found) {
            find(key, &format!("{case}: mean reduction"), *mean, "%");
            find(&format!("{key}_worst"), &format!("{case}: worst reduction"), *worst, "%");
        }
    }
    study.draw(Figure {
        section: SECTION.into(),
        name: "sizes".into(),
        title: format!(
            "Mean reduction over strokes against cycles; from left to right {}",
            SIZES.iter().map(|hidden| words(hidden)).collect::<Vec<_>>().join(", ")
        ),
        x: Axis::logarithmic("cycles of an evaluation"),
        y: Axis::linear("mean reduction [%]"),
        curves: CASES
            .iter()
            .enumerate()
            .map(|(case, (_, words))| {
                Curve::line_and_dots(words, cost.iter().zip(&found).map(|(cost, found)| (*cost, found[case].0)))
            })
            .collect(),
    });
    study.note(
        SECTION,
        "Cycles are those of the int8 kernel, estimated as 0.733 a multiply-add and 90.3 a neuron through two rows of the \
         golden table; the networks \
         were flown in f32 (tanh up to two layers, ReLU beyond). All have the linear map beside them. 168 MHz are 1,680,000 \
         cycles in a reference \
         tick of 10 ms: what decides is flash, and what other tasks leave.",
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn estimated_cycles_are_those_of_the_golden_table() {
        let table = include_str!("../../data/mcu.txt");
        let golden = |net: &str| -> f64 {
            let row =
                table.lines().map(|line| line.split_whitespace().collect::<Vec<_>>()).find(|row| row.starts_with(&[net, "int8"]));
            row.unwrap()[3].parse().unwrap()
        };
        for (net, inputs, hidden) in [("12-128x4-6", 12, &[128; 4][..]), ("36-128x4-6", 36, &[128; 4]), ("shipped", 36, &[64; 2])]
        {
            let ratio = cycles(inputs, hidden, 6) / golden(net);
            assert!((0.9..1.1).contains(&ratio), "{net}: {ratio}");
        }
    }
}
