//! Thirty strokes that nobody trained on, by every method.
//!
//! *in* the predecessor's loop, and a Crazyflie in the lab; *out* mean, worst and distribution of the reductions; *never* a
//! choice made on these strokes; *source* Li et al., ICRA 2017 (43 % over 30 hand-drawn trajectories).

use impromptu_firmware::adapter::Lanes;
use impromptu_report::{
    Axis, Curve, Figure,
    study::{Asked, Finding, Study},
};
use impromptu_sim::{
    flights::{Loop, reduction},
    trajectory::{STROKE_SPEED, stroke, strokes},
};
use impromptu_training::{Purpose, Recipe, build, derived};

use super::{
    addon::{Course, NETWORK},
    crazyflie::Crazyflie,
    ground::Ground,
    predecessor::SPEED,
    references::{IterativeLearning, best_shift, shifted},
    table::Networks,
};

/// Flights of a method: name, words, errors in m.
type Flown = (&'static str, &'static str, Vec<f64>);

/// The paper's loop and networks.
pub(super) fn predecessor(ground: &Ground<'_>, networks: &Networks, study: &mut Study) -> anyhow::Result<()> {
    let section = "Strokes: the predecessor's loop";
    let closed_loop = &ground.closed_loop;
    let seed = derived(ground.settings.seed, Purpose::Test);
    let test: Vec<_> = (0..ground.settings.strokes as u64)
        .map(|index| stroke(seed, index).scaled(SPEED / STROKE_SPEED).sampled(closed_loop.rate_hz()))
        .collect::<Result<_, _>>()?;
    let course = Course::new(closed_loop, test, seed)?;
    let mut flown: Vec<Flown> = vec![("baseline", "doing nothing", course.baseline.clone())];
    without_model(ground.settings.trials, closed_loop, &ground.validation, &course, section, study, &mut flown)?;
    let mut fly = |name, words, file: &[u8]| -> anyhow::Result<()> {
        flown.push((name, words, course.errors(closed_loop, file, NETWORK)?));
        Ok(())
    };
    fly("flatness", "flatness feed-forward", &networks.twelve.feedforward_file(closed_loop)?)?;
    fly("ridge_12", "ridge, 12 inputs", &networks.twelve_file(closed_loop, &networks.twelve.maps.ridge)?)?;
    fly("network_36", "network, 36 inputs", &networks.thirty_six.network_file(closed_loop)?)?;
    fly("network_12", "network, 12 inputs", &networks.twelve_file(closed_loop, &networks.twelve.maps.network)?)?;
    report(
        study,
        section,
        "predecessor",
        &course,
        &flown,
        &["shifted", "flatness", "network_36", "network_12", "ridge_12", "trials"],
    );
    Ok(())
}

/// This project's add-on.
pub(super) fn crazyflie(ground: &Ground<'_>, crazyflie: &Crazyflie, study: &mut Study) -> anyhow::Result<()> {
    let section = "Strokes: a Crazyflie in the lab";
    let (settings, closed_loop) = (ground.settings, &crazyflie.lab);
    let recipe = Recipe { validation_speeds: vec![1.0], shares: vec![1.0], ..crazyflie.recipe.clone() };
    let built = build(&recipe, closed_loop, settings.seed, &mut |_| {})?;
    let seed = derived(settings.seed, Purpose::Test);
    let course = Course::new(closed_loop, strokes(seed, settings.strokes, 1.0, closed_loop.rate_hz())?, seed)?;
    let mut flown: Vec<Flown> = vec![("baseline", "doing nothing", course.baseline.clone())];
    without_model(settings.trials, closed_loop, &crazyflie.lab_course, &course, section, study, &mut flown)?;
    let models = &built.models;
    for (name, words, file, lanes) in [
        ("flatness", "flatness feed-forward", &models.feedforward, NETWORK),
        ("ridge", "ridge on the window", &models.ridge, NETWORK),
        ("network", "network lane (int8)", &models.int8, NETWORK),
        ("both", "both lanes (int8)", &models.int8, Lanes::BOTH),
    ] {
        flown.push((name, words, course.errors(closed_loop, file, lanes)?));
    }
    let switched_off = course.errors(closed_loop, &models.int8, Lanes::NONE)?;
    let difference = switched_off.iter().zip(&course.baseline).map(|(off, baseline)| (off - baseline).abs()).fold(0.0, f64::max);
    let what = "largest difference between a flight with both lanes switched off and the baseline's";
    study.find(Finding::new(section, "bypass_difference", &[1, 2], what, difference, "m").asked(Asked::AtMost(0.0)));
    study.note(
        section,
        "Features are computed by the firmware's adapter in every flight and by the same function from the logs for training; \
         `host-sim fly --pil` flies the same strokes through the firmware on the emulated microcontroller, bit for bit.",
    );
    if let Err(reason) = &built.lane {
        study.note(section, &format!("No feedback lane: {reason}."));
    }
    report(study, section, "crazyflie", &course, &flown, &["both", "shifted", "network", "ridge", "flatness", "trials"]);
    Ok(())
}

/// Shifted references and iterative learning, both tuned on validation strokes.
fn without_model(
    trials: usize,
    closed_loop: &Loop,
    validation: &Course,
    course: &Course,
    section: &str,
    study: &mut Study,
    flown: &mut Vec<Flown>,
) -> anyhow::Result<()> {
    let shift = best_shift(closed_loop, validation)?;
    flown.push(("shifted", "references shifted by the best delay", shifted(closed_loop, course, shift)?));
    let mut chosen = (f64::INFINITY, IterativeLearning { gain: 0.5, smoothing_s: 0.2, delay_s: shift });
    for learning in IterativeLearning::candidates(shift) {
        let errors = learning.fly(closed_loop, validation, trials)?;
        let sum: f64 = errors[trials].iter().sum();
        if sum < chosen.0 {
            chosen = (sum, learning);
        }
    }
    let errors = chosen.1.fly(closed_loop, course, trials)?;
    study.note(
        section,
        &format!(
            "Best constant shift of the references on validation strokes: {shift:.2} s. Iterative learning repeats each stroke \
             {trials} times with other noise: gain {}, zero-phase filter {} s, both chosen on validation strokes. \
             All else flies a stroke once.",
            chosen.1.gain, chosen.1.smoothing_s
        ),
    );
    let prefix = if section.contains("predecessor") { "predecessor" } else { "crazyflie" };
    let by_trial: Vec<(f64, f64)> = errors.iter().map(|errors| reduction(&course.baseline, errors)).collect();
    study.draw(Figure {
        section: section.into(),
        name: format!("{prefix}_trials"),
        title: "Iterative learning: reduction by the number of trials before".into(),
        x: Axis::linear("trials before"),
        y: Axis::linear("reduction [%]"),
        curves: vec![
            Curve::line_and_dots("mean", by_trial.iter().enumerate().map(|(trial, found)| (trial as f64, found.0))),
            Curve::line_and_dots("worst", by_trial.iter().enumerate().map(|(trial, found)| (trial as f64, found.1.max(-100.0)))),
        ],
    });
    flown.push(("trials", "iterative learning, last trial", errors.into_iter().next_back().unwrap_or_default()));
    Ok(())
}

/// Mean, worst and centimetres of each method; the distribution of some.
fn report(study: &mut Study, section: &str, prefix: &str, course: &Course, flown: &[Flown], drawn: &[&str]) {
    for (name, words, errors) in flown {
        let (mean, worst) = reduction(&course.baseline, errors);
        let cm = 100.0 * errors.iter().sum::<f64>() / errors.len().max(1) as f64;
        let key = |what: &str| format!("{prefix}_{name}_{what}");
        let finding = |what: &str, text: &str, value, unit| {
            Finding::new(section, &key(what), &[28], &format!("{words}: {text}"), value, unit).cell(
                "Over the strokes",
                words,
                text,
            )
        };
        study.find(finding("error", "mean RMS error", cm, "cm"));
        if *name != "baseline" {
            let mean = finding("mean", "mean reduction", mean, "%");
            study.find(if name.starts_with("network") { mean.paper(43.0) } else { mean });
            study.find(finding("worst", "worst reduction", worst, "%"));
        }
    }
    let sorted = |errors: &[f64]| {
        let mut reductions = course.reductions(errors);
        reductions.sort_by(f64::total_cmp);
        let count = reductions.len().max(1) as f64;
        reductions.into_iter().enumerate().map(move |(index, value)| (100.0 * (index as f64 + 0.5) / count, value.max(-20.0)))
    };
    let curves = drawn.iter().filter_map(|wanted| flown.iter().find(|(name, ..)| name == wanted));
    study.draw(Figure {
        section: section.into(),
        name: format!("{prefix}_distribution"),
        title: "Distribution over the strokes, from the worst to the best; below -20 % drawn as -20 %".into(),
        x: Axis::linear("share of the strokes [%]"),
        y: Axis::linear("reduction [%]"),
        curves: curves.map(|(_, words, errors)| Curve::line(words, sorted(errors))).collect(),
    });
}
