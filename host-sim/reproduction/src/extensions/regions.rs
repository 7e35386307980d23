//! Row 11.

use impromptu_report::{
    Axis, Curve, Figure,
    study::{Finding, Study},
};

use crate::siso::{
    extensions::two_regions::{self, FADE, HYSTERESIS, NOISE, SCHEMES},
    levenberg_marquardt::Settings,
};

use super::summary::summary;

const SECTION: &str = "Two operating regions";
const TABLE: &str = "Two modules and one";
const KEYS: [&str; 6] = ["plain", "one_r1", "one_r2", "one_both", "two_hard", "two_faded"];

pub(super) fn add(study: &mut Study, settings: &Settings, others: u64, seed: u64) {
    let trials = two_regions::run(settings, others, seed);
    study.note(
        SECTION,
        &format!(
            "Below y = 1 the relative degree is 1 and the DC gain 1, above it 2 and 1.6. The output is measured with noise of \
             {NOISE}. One \
             module for all, with either preview or with both; two modules that switch at the border; two modules with the \
             firmware's selector \
             (hysteresis ±{HYSTERESIS}, change-over in {FADE} samples). 40 s across the border, along it within the noise, and \
             random trajectories. \
             Along the border the region changes all the time, whatever selects it: the reference that suits one side drives \
             the output over \
             to the other, by more than any hysteresis that is narrower than the gains are apart."
        ),
    );
    for (index, (key, scheme)) in KEYS.iter().zip(SCHEMES).enumerate() {
        for (what, name, values) in [
            ("RMS of y - y_d", "error", trials.iter().map(|trial| trial.error[index]).collect::<Vec<_>>()),
            ("largest jump of the reference in a sample", "jump", trials.iter().map(|trial| trial.jump[index]).collect()),
        ] {
            for (suffix, of, value) in summary(values, "mean", "worst") {
                let text = format!("{what}, {scheme}, {of}");
                let found = Finding::new(SECTION, &format!("regions_{name}_{key}{suffix}"), &[11], &text, value, "");
                study.find(found.cell(TABLE, scheme, &format!("{what}, {of}")));
            }
        }
    }
    for ((index, key), scheme) in ["hard", "faded"].iter().enumerate().zip(&SCHEMES[4..]) {
        let most = trials.iter().map(|trial| trial.switches[index]).max().unwrap_or(0);
        let along = trials.get(1).map_or(0, |trial| trial.switches[index]);
        for (suffix, of, value) in [("worst", "worst", most), ("along_border", "along the border", along)] {
            let text = format!("changes of region in 40 s, {scheme}, {of}");
            let name = format!("regions_switches_{key}_{suffix}");
            let found = Finding::new(SECTION, &name, &[11], &text, f64::from(value), "");
            study.find(found.cell(TABLE, scheme, &format!("changes of region in 40 s, {of}")));
        }
    }
    let curve = |index: usize| {
        Curve::line_and_dots(
            SCHEMES[index],
            trials.iter().enumerate().map(|(trial, result)| (trial as f64 + 1.0, result.error[index])),
        )
    };
    study.draw(Figure {
        section: SECTION.into(),
        name: "regions_error".into(),
        title: "Tracking error: 1 across the border, 2 along it, then random trajectories".into(),
        x: Axis::linear("trajectory"),
        y: Axis::logarithmic("RMS of y - y_d"),
        curves: (0..SCHEMES.len()).map(curve).collect(),
    });
}
