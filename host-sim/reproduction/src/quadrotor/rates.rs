//! Sub-rate and preview: how often the network must run, and how far it must look ahead.
//!
//! *in* a Crazyflie and the predecessor's loop; *out* reductions over validation-like strokes by sub-rate, held and interpolated,
//! and by preview; *never* a sub-rate that is not a whole part of the reference's rate; *source* Zhou 2017, section V-A (the
//! module is slower than the loop).

use impromptu_firmware::model::Interpolation;
use impromptu_flight::flight::PREVIEW;
use impromptu_report::{
    Axis, Curve, Figure,
    study::{Finding, Study},
};
use impromptu_training::{Labels, Recipe};
use rayon::prelude::*;

use super::{
    addon::learn,
    crazyflie::Crazyflie,
    ground::Ground,
    inputs::{Origin, with_degrees},
    predecessor::DIVISOR,
};

const SECTION: &str = "Sub-rate and preview";
/// Reference ticks (10 ms) in a sub-rate tick of the Crazyflie: 2 to 100 Hz.
const DIVISORS: [u16; 7] = [50, 25, 20, 10, 5, 2, 1];
/// Past and future of the window, s, and the time between its points.
const WINDOW: [f64; 3] = [0.4, 0.8, 0.1];
/// Previews tried on the Crazyflie, s.
const PREVIEWS: [f64; 8] = [0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.2];
/// Sub-rate ticks (15 ms) of the predecessor's loop.
const TICKS: [u16; 6] = [20, 10, 5, 3, 2, 1];
/// Relative degrees tried on the predecessor's loop, in ticks of 0.15 s.
const DEGREES: [i16; 7] = [1, 2, 3, 4, 5, 6, 8];

/// The window at a sub-rate, in its ticks.
fn windowed(recipe: &Recipe, divisor: u16, future_s: f64) -> Recipe {
    let tick = f64::from(divisor) / 100.0;
    let ticks = |seconds: f64| (seconds / tick).round() as i16;
    let past = ticks(WINDOW[0]).max(1);
    // The ramp needs one tick more, and all of it has to fit into the flight stack's preview.
    let most = ((PREVIEW - 1) / usize::from(divisor)) as i16 - past - 1;
    Recipe {
        features: None,
        divisor,
        window: [-past, ticks(future_s).min(most)],
        window_step: ticks(WINDOW[2]).max(1),
        ..recipe.clone()
    }
}

/// All sweeps.
pub(super) fn run(ground: &Ground<'_>, crazyflie: &Crazyflie, study: &mut Study) -> anyhow::Result<()> {
    sub_rates(crazyflie, study)?;
    previews(crazyflie, study)?;
    steps_and_seconds(ground, study)
}

fn sub_rates(crazyflie: &Crazyflie, study: &mut Study) -> anyhow::Result<()> {
    let closed_loop = &crazyflie.clean;
    let found: Vec<[(f64, f64); 2]> = DIVISORS
        .par_iter()
        .map(|&divisor| {
            let recipe = windowed(&crazyflie.recipe, divisor, WINDOW[1]);
            let learned = learn(&recipe, closed_loop, &crazyflie.clean_logs, Labels::Corrections)?;
            let fly = |interpolation| {
                let file = learned.at(interpolation).network_file(closed_loop)?;
                crazyflie.clean_course.reduction(closed_loop, &file)
            };
            Ok([fly(Interpolation::Hold)?, fly(Interpolation::Linear)?])
        })
        .collect::<anyhow::Result<_>>()?;
    let rates: Vec<f64> = DIVISORS.iter().map(|divisor| 100.0 / f64::from(*divisor)).collect();
    for (way, kind) in [(0, "held"), (1, "interpolated")] {
        for (rate, found) in rates.iter().zip(&found) {
            let text = format!("Crazyflie, window network at {rate:.0} Hz, {kind}: mean reduction over strokes");
            let found = Finding::new(SECTION, &format!("rate_{rate:.0}_hz_{kind}"), &[29], &text, found[way].0, "%");
            study.find(found.cell("Crazyflie, clean: mean reduction by the rate of the network", kind, &format!("{rate:.0} Hz")));
        }
    }
    study.draw(Figure {
        section: SECTION.into(),
        name: "sub_rates".into(),
        title: "Crazyflie, nothing else disturbing: reduction by the rate of the network".into(),
        x: Axis::logarithmic("sub-rate [Hz]"),
        y: Axis::linear("mean reduction [%]"),
        curves: [(0, "held"), (1, "interpolated")]
            .map(|(way, kind)| {
                Curve::line_and_dots(kind, rates.iter().zip(&found).map(|(rate, found)| (*rate, found[way].0.max(-100.0))))
            })
            .into(),
    });
    Ok(())
}

fn previews(crazyflie: &Crazyflie, study: &mut Study) -> anyhow::Result<()> {
    let found: Vec<[(f64, f64); 2]> = PREVIEWS
        .par_iter()
        .map(|&preview| {
            let fly = |closed_loop, logs, course: &super::addon::Course| {
                let recipe = windowed(&crazyflie.recipe, 10, preview);
                let learned = learn(&Recipe { network: crazyflie.linear(), ..recipe }, closed_loop, logs, Labels::Corrections)?;
                course.reduction(closed_loop, &learned.ridge_file(closed_loop)?)
            };
            Ok([
                fly(&crazyflie.clean, &crazyflie.clean_logs, &crazyflie.clean_course)?,
                fly(&crazyflie.lab, &crazyflie.lab_logs, &crazyflie.lab_course)?,
            ])
        })
        .collect::<anyhow::Result<_>>()?;
    for (way, kind) in [(0, "clean"), (1, "lab")] {
        for (preview, found) in PREVIEWS.iter().zip(&found) {
            let text = format!("Crazyflie, {kind}: ridge on the window, {preview} s of preview, mean reduction");
            let found = Finding::new(SECTION, &format!("preview_{:.0}_ms_{kind}", 1e3 * preview), &[6], &text, found[way].0, "%");
            study.find(found.cell("Crazyflie, ridge on the window: mean reduction by preview", kind, &format!("{preview} s")));
        }
    }
    study.draw(Figure {
        section: SECTION.into(),
        name: "previews".into(),
        title: "Crazyflie: reduction by the preview (and as much again for the ramp to the next tick, 0.1 s)".into(),
        x: Axis::linear("preview [s]"),
        y: Axis::linear("mean reduction [%]"),
        curves: [(0, "clean"), (1, "lab")]
            .map(|(way, kind)| {
                Curve::line_and_dots(kind, PREVIEWS.iter().zip(&found).map(|(preview, found)| (*preview, found[way].0)))
            })
            .into(),
    });
    Ok(())
}

/// The predecessor's loop with 12 inputs: r as a number of ticks against r as a time, by sub-rate; and r itself.
fn steps_and_seconds(ground: &Ground<'_>, study: &mut Study) -> anyhow::Result<()> {
    let closed_loop = &ground.closed_loop;
    let fly = |divisor: u16, degrees: [i16; 3]| {
        let recipe = Recipe { divisor, ..ground.recipe(with_degrees(degrees, Origin::Measured)) };
        let recipe = Recipe { network: super::crazyflie::linear(&recipe.network), ..recipe };
        let learned = learn(&recipe, closed_loop, &ground.logs, Labels::Corrections)?;
        Ok::<_, anyhow::Error>(ground.validation.reduction(closed_loop, &learned.ridge_file(closed_loop)?)?.0.max(-1e6))
    };
    let found: Vec<[f64; 2]> = TICKS
        .par_iter()
        .map(|&ticks| {
            let scale = f64::from(DIVISOR) / f64::from(ticks);
            let seconds = [4.0, 4.0, 2.0].map(|degree| (degree * scale).round().max(1.0) as i16);
            Ok([fly(ticks, [4, 4, 2])?, fly(ticks, seconds)?])
        })
        .collect::<anyhow::Result<_>>()?;
    let rates: Vec<f64> = TICKS.iter().map(|ticks| closed_loop.rate_hz() / f64::from(*ticks)).collect();
    let kinds = [(0, "steps", "r = 4, 4, 2 ticks"), (1, "seconds", "r = 0.6, 0.6, 0.3 s")];
    for (way, kind, words) in kinds {
        for (rate, found) in rates.iter().zip(&found) {
            let text = format!(
                "predecessor's loop, ridge on 12 inputs at {rate:.1} Hz, {words}: mean reduction over validation strokes"
            );
            let found = Finding::new(SECTION, &format!("predecessor_{rate:.0}_hz_{kind}"), &[9, 23, 29], &text, found[way], "%");
            let table = "Predecessor's loop, ridge on 12 inputs: mean reduction by sub-rate and r";
            study.find(found.cell(table, words, &format!("{rate:.1} Hz")));
        }
    }
    study.draw(Figure {
        section: SECTION.into(),
        name: "degrees_by_rate".into(),
        title: "Predecessor's loop: r is a time, not a number of ticks; worse than -100 % is drawn as -100 %".into(),
        x: Axis::logarithmic("sub-rate [Hz]"),
        y: Axis::linear("mean reduction [%]"),
        curves: kinds
            .map(|(way, _, words)| {
                Curve::line_and_dots(words, rates.iter().zip(&found).map(|(rate, found)| (*rate, found[way].max(-100.0))))
            })
            .into(),
    });
    let found: Vec<f64> = DEGREES.par_iter().map(|&r| fly(DIVISOR, [r, r, (r / 2).max(1)])).collect::<anyhow::Result<_>>()?;
    for (degree, found) in DEGREES.iter().zip(&found) {
        let degrees = format!("r = {degree}, {degree}, {}", (degree / 2).max(1));
        let text = format!("predecessor's loop, ridge on 12 inputs at 6.67 Hz, {degrees}: mean reduction");
        let found = Finding::new(SECTION, &format!("predecessor_degree_{degree}"), &[9, 23], &text, *found, "%");
        study.find(found.cell(
            "Predecessor's loop, ridge on 12 inputs at 6.67 Hz: mean reduction by r",
            "mean reduction",
            &degrees,
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_span_the_same_time_at_every_rate_and_fit_the_preview() {
        for divisor in DIVISORS {
            let recipe = windowed(&Recipe::long(), divisor, WINDOW[1]);
            let span = (recipe.window[1] + 1 - recipe.window[0]) * divisor as i16;
            assert!(span < PREVIEW as i16 && recipe.window[0] < 0 && recipe.window[1] > 0);
            assert!(recipe.features().len() <= impromptu_firmware::model::MAX_FEATURES);
            let ahead = f64::from(recipe.window[1] * divisor as i16) / 100.0;
            assert!((ahead - WINDOW[1]).abs() <= 0.31, "{divisor}: {ahead} s");
        }
    }
}
