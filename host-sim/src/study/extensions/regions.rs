//! Row 11.

use impromptu_lti::{
    extensions::{
        mean_and_worst,
        two_regions::{self, FADE, HYSTERESIS, NOISE, SCHEMES},
    },
    levenberg_marquardt::Settings,
};

use crate::{
    report::{Axis, Curve, Figure},
    study::{Finding, Study},
};

const SECTION: &str = "Two operating regions";
const KEYS: [&str; 6] = ["plain", "one_r1", "one_r2", "one_both", "two_hard", "two_faded"];

pub(super) fn add(study: &mut Study, settings: &Settings, others: u64, seed: u64) {
    let trials = two_regions::run(settings, others, seed);
    study.note(
        SECTION,
        &format!(
            "Below y = 1 the relative degree is 1 and the DC gain 1, above it 2 and 1.6. The output is measured with noise of {NOISE}. One \
             module for all, with either preview or with both; two modules that switch at the border; two modules with the firmware's selector \
             (hysteresis ±{HYSTERESIS}, change-over in {FADE} samples). 40 s across the border, along it within the noise, and random trajectories."
        ),
    );
    for (index, (key, scheme)) in KEYS.iter().zip(SCHEMES).enumerate() {
        for (what, name, values) in [
            ("RMS of y - y_d", "error", trials.iter().map(|trial| trial.error[index]).collect::<Vec<_>>()),
            ("largest jump of the reference in a sample", "jump", trials.iter().map(|trial| trial.jump[index]).collect()),
        ] {
            let (mean, worst) = mean_and_worst(values);
            study.find(Finding::new(
                SECTION,
                &format!("regions_{name}_{key}"),
                &[11],
                &format!("{what}, {scheme}, mean"),
                mean,
                "",
            ));
            study.find(Finding::new(
                SECTION,
                &format!("regions_{name}_{key}_worst"),
                &[11],
                &format!("{what}, {scheme}, worst"),
                worst,
                "",
            ));
        }
    }
    for (index, key) in ["hard", "faded"].iter().enumerate() {
        let most = trials.iter().map(|trial| trial.switches[index]).max().unwrap_or(0);
        let along = trials.get(1).map_or(0, |trial| trial.switches[index]);
        study.find(Finding::new(
            SECTION,
            &format!("regions_switches_{key}_worst"),
            &[11],
            "changes of region in 40 s, worst",
            f64::from(most),
            "",
        ));
        study.find(Finding::new(
            SECTION,
            &format!("regions_switches_{key}_along_border"),
            &[11],
            "changes of region in 40 s along the border",
            f64::from(along),
            "",
        ));
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
