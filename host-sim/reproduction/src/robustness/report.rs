//! Cases, deviations and control weights as findings, figures and words.
//!
//! *in* what was flown; *out* entries of a [`Study`]; *never* a percentage without the centimetres that it is of; *source* none.

use impromptu_report::{
    Axis, Curve, Figure,
    study::{Asked, Finding, Study},
};
use impromptu_sim::flights::Loop;

use super::{
    cases::{CASES, DEVIATIONS, PARAMETERS, WINDS},
    comparison::Comparison,
    control_weight::Design,
    deviations::Deviations,
    draw::{name, slug_of},
    gaussian,
    hover::linearise,
    settings::Settings,
};

const CASE_SECTION: &str = "Cases at test time only";
const DEVIATION_SECTION: &str = "Deviations at test time only";
const CONTROL_WEIGHT_SECTION: &str = "What robustness costs";
/// Reductions below this are drawn here, %: a lane that oscillates would leave the others no room.
const FLOOR: f64 = -20.0;

/// Lanes that fly, in names and in words, and their mean and worst reduction.
type Way = (&'static str, &'static str, fn(&Comparison) -> (f64, f64));
/// A margin in words, and where a design has it.
type Margin = (&'static str, fn(&Design) -> f32);

/// What the study does, in words.
pub(super) fn explain(study: &mut Study, settings: &Settings) {
    let text = format!(
        "Models of the nominal vehicle, {} strokes that nobody trained on. Vehicle, loop and air differ in the test flights \
         only: the \
         flight stack knows nothing of it, and reductions are against the baseline's flight of the same vehicle in the same air.",
        settings.strokes
    );
    study.note(CASE_SECTION, &text);
    study.note(
        CASE_SECTION,
        "Drag x4 needs corrections larger than the fast part of the feedback lane may give where errors are large already (its \
         clamp, halved at an \
         error of the lane's scale, 0.1 m); in some of these flights the guard hands a lane over besides. Wider clamps are \
         choices of the recipe: they cost \
         robustness against delay on some vehicles, which the validation flights tell.",
    );
    study.note(
        DEVIATION_SECTION,
        "One quantity off at a time. Mass and thrust leave a sag that the network lane cannot know of; the integral of the \
         feedback lane takes it \
         away as long as it is within its clamp. Wind blows along both horizontal axes, with Dryden gusts of its own strength \
         on top.",
    );
    let ranges = &settings.ranges;
    study.note(
        super::spread::SECTION,
        &format!(
            "{} vehicles a loop, each with {} strokes, drawn uniformly: mass x{:?}, thrust x{:?}, drag x{:?}, inertia x{:?}, \
             motor lag x{:?}, \
             {:?} s of further delay, wind of {:?} m/s from any side, all at once.",
            settings.draws,
            settings.draw_strokes,
            ranges.mass,
            ranges.thrust,
            ranges.drag,
            ranges.inertia,
            ranges.motor_lag,
            ranges.delay_s,
            ranges.wind
        ),
    );
    super::guard_table::explain(study, settings);
    study.note(
        CONTROL_WEIGHT_SECTION,
        "Each point is a lane designed at another control weight from the same logs, flown without the guard. The limit knows \
         plant, noise and disturbance \
         exactly and has the network's errors not to mend: it is what the error would be if only noise and disturbance were \
         left.",
    );
}

/// Bounds of the target table: vehicle, condition, case, mean, worst.
fn asked(closed_loop: &Loop, case: &str) -> (Option<f64>, Option<f64>) {
    let (stock, condition) = (closed_loop.gains == "stock", closed_loop.condition.name.as_str());
    match (condition, case) {
        _ if !stock => (None, None),
        ("lab", "nominal") => (Some(96.5), Some(93.0)),
        ("rough", "nominal") => (Some(93.5), Some(87.0)),
        ("lab" | "rough", "delay_plus_20_ms") => (None, Some(0.0)),
        ("lab", case) if closed_loop.vehicle.name == "crazyflie" => {
            (CASES.iter().find(|known| known.name == case).map(|known| known.asked), None)
        }
        _ => (None, None),
    }
}

pub(super) fn tell_cases(study: &mut Study, closed_loop: &Loop, flown: &[(&'static str, Comparison)]) {
    let (slug, loop_name) = (slug_of(closed_loop), name(closed_loop));
    for (case, comparison) in flown {
        let words = match *case {
            "nominal" => "nominal",
            "delay_plus_20_ms" => "delay of the whole loop +20 ms",
            case => CASES.iter().find(|known| known.name == case).map_or(case, |known| known.what),
        };
        let mut find = |name: &str, what: &str, value: f64, unit: &str, bound: Option<f64>| {
            let text = format!("{loop_name}, {words}: {what}");
            let finding = Finding::new(CASE_SECTION, &format!("{slug}_{case}_{name}"), &[], &text, value, unit);
            let finding = finding.cell(&loop_name, words, what);
            study.find(match bound {
                Some(bound) => finding.asked(Asked::AtLeast(bound)),
                None => finding,
            });
        };
        let (mean, worst) = comparison.both_lanes();
        let (mean_bound, worst_bound) = asked(closed_loop, case);
        let [baseline, network, both] = comparison.centimetres();
        find("both_mean", "reduction, both lanes", mean, "%", mean_bound);
        find("both_worst", "worst flight, both lanes", worst, "%", worst_bound);
        find("network_mean", "reduction, network lane alone", comparison.network_alone().0, "%", None);
        find("baseline_cm", "RMS error, baseline", baseline, "cm", None);
        find("network_cm", "RMS error, network lane alone", network, "cm", None);
        find("both_cm", "RMS error, both lanes", both, "cm", None);
        find("tripped", "flights in which the guard tripped a lane", comparison.tripped as f64, "", None);
        let reasons = comparison.trips_text();
        if !reasons.is_empty() {
            study.note(CASE_SECTION, &format!("{loop_name}, {words}: trips of the guard in all flights together: {reasons}."));
        }
    }
}

pub(super) fn draw_deviations(study: &mut Study, closed_loop: &Loop, flown: &Deviations) {
    let (slug, loop_name) = (slug_of(closed_loop), name(closed_loop));
    let ways: [Way; 2] =
        [("both", "both lanes", Comparison::both_lanes), ("network", "network lane alone", Comparison::network_alone)];
    for (way, words, reduction) in ways {
        let curves = PARAMETERS.iter().zip(&flown.parameters).map(|(parameter, flown)| {
            let points = DEVIATIONS.iter().zip(flown).map(|(deviation, flown)| (*deviation, reduction(flown).0.max(FLOOR)));
            Curve::line_and_dots(parameter.what, points)
        });
        study.draw(Figure {
            section: DEVIATION_SECTION.into(),
            name: format!("{slug}_deviations_{way}"),
            title: format!("{loop_name}, {words}: mean reduction (drawn from {FLOOR} % on)"),
            x: Axis::linear("deviation [%]"),
            y: Axis::linear("reduction [%]"),
            curves: curves.collect(),
        });
    }
    let winds = ways.map(|(_, words, reduction)| {
        Curve::line_and_dots(words, WINDS.iter().zip(&flown.winds).map(|(wind, flown)| (*wind, reduction(flown).0.max(FLOOR))))
    });
    study.draw(Figure {
        section: DEVIATION_SECTION.into(),
        name: format!("{slug}_wind"),
        title: format!("{loop_name}: mean reduction in wind with gusts (drawn from {FLOOR} % on)"),
        x: Axis::linear("mean wind [m/s]"),
        y: Axis::linear("reduction [%]"),
        curves: winds.to_vec(),
    });
    let mut find = |what: &str, key: &str, flown: &Comparison| {
        let [baseline, _, both] = flown.centimetres();
        for (way, words, value, unit) in [
            ("both_mean", "reduction, both lanes", flown.both_lanes().0, "%"),
            ("both_worst", "worst flight, both lanes", flown.both_lanes().1, "%"),
            ("network_mean", "reduction, network lane alone", flown.network_alone().0, "%"),
            ("baseline_cm", "RMS error, baseline", baseline, "cm"),
            ("both_cm", "RMS error, both lanes", both, "cm"),
            ("tripped", "flights in which the guard tripped a lane", flown.tripped as f64, ""),
        ] {
            let text = format!("{loop_name}, {what}: {words}");
            let found = Finding::new(DEVIATION_SECTION, &format!("{slug}_{key}_{way}"), &[], &text, value, unit);
            study.find(found.cell(&loop_name, what, words));
        }
    };
    for (parameter, flown) in PARAMETERS.iter().zip(&flown.parameters) {
        for (deviation, flown) in
            DEVIATIONS.iter().zip(flown).filter(|(deviation, _)| deviation.abs() == 10.0 || deviation.abs() == 30.0)
        {
            let sign = if *deviation < 0.0 { "minus" } else { "plus" };
            find(
                &format!("{} {deviation:+} %", parameter.what),
                &format!("{}_{sign}_{}", parameter.name, deviation.abs()),
                flown,
            );
        }
    }
    for (wind, flown) in WINDS.iter().zip(&flown.winds) {
        find(&format!("wind {wind} m/s with gusts"), &format!("wind_{}_dm_s", (wind * 10.0).round()), flown);
    }
}

/// Figures of a sweep; `baseline` are the errors of the nominal baseline's strokes, m.
pub(super) fn draw_control_weight(
    study: &mut Study,
    closed_loop: &Loop,
    designs: &[Design],
    baseline: &[f64],
) -> anyhow::Result<()> {
    let (slug, loop_name) = (slug_of(closed_loop), name(closed_loop));
    let labels = ["nominal", "+10 ms", "+20 ms"];
    // As if nothing but the limit's error were left of each stroke.
    let limit =
        |error: f64| 100.0 * baseline.iter().map(|baseline| 1.0 - error / baseline).sum::<f64>() / baseline.len().max(1) as f64;
    let reductions = |x: &dyn Fn(&Design) -> f64| -> Vec<Curve> {
        let points = |index: usize| designs.iter().map(move |design| (x(design), design.reductions[index].0.max(FLOOR)));
        labels.iter().enumerate().map(|(index, label)| Curve::line_and_dots(label, points(index))).collect()
    };
    let mut by_control_weight = reductions(&|design| design.control_weight);
    let limits = designs.iter().filter_map(|design| Some((design.control_weight, limit(design.limit?))));
    by_control_weight.push(Curve::line("linear-quadratic-Gaussian limit", limits));
    let figure = |name: &str, title: String, x: Axis, y: &str, curves: Vec<Curve>| Figure {
        section: CONTROL_WEIGHT_SECTION.into(),
        name: format!("{slug}_{name}"),
        title,
        x,
        y: Axis::linear(y),
        curves,
    };
    let control_weight = || Axis::logarithmic("control weight of the design [1]");
    let reduction = "mean reduction [%]";
    let drawn = format!("drawn from {FLOOR} % on");
    study.draw(figure(
        "control_weight",
        format!("{loop_name}: reduction by control weight, and the limit ({drawn})"),
        control_weight(),
        reduction,
        by_control_weight,
    ));
    // What has no margin in the identified loop is drawn at zero.
    let margin = |value: f32| f64::from(value).min(1e3);
    let by_delay = reductions(&|design| margin(design.margins.delay_ms));
    let axis = Axis::linear("delay margin of the identified loop [ms]");
    study.draw(figure("delay_margin", format!("{loop_name}: reduction by delay margin ({drawn})"), axis, reduction, by_delay));
    let by_modulus = reductions(&|design| margin(design.margins.modulus));
    let axis = Axis::linear("modulus margin of the identified loop [1]");
    study.draw(figure(
        "modulus_margin",
        format!("{loop_name}: reduction by modulus margin ({drawn})"),
        axis,
        reduction,
        by_modulus,
    ));
    let margins: [Margin; 3] = [
        ("delay margin [100 ms]", |design| design.margins.delay_ms / 100.0),
        ("gain margin [1]", |design| design.margins.gain),
        ("modulus margin [1]", |design| design.margins.modulus),
    ];
    let curves = margins.map(|(label, value)| {
        Curve::line_and_dots(label, designs.iter().map(|design| (design.control_weight, margin(value(design)))))
    });
    study.draw(figure("margins", format!("{loop_name}: margins by control weight"), control_weight(), "margin", curves.to_vec()));

    let mut find = |name: String, control_weight: &str, what: &str, value: f64, unit: &str| {
        let text = format!("{loop_name}, {control_weight}: {what}");
        study.find(Finding::new(CONTROL_WEIGHT_SECTION, &format!("{slug}_{name}"), &[], &text, value, unit).cell(
            &loop_name,
            control_weight,
            what,
        ));
    };
    for design in designs {
        let key = format!("control_weight_{:.1e}", design.control_weight).replace('.', "_").replace('-', "_minus_");
        let with = format!("control weight {:.1e}", design.control_weight);
        for (index, label) in labels.iter().enumerate() {
            let (mean, worst) = design.reductions[index];
            let delay = ["nominal", "plus_10_ms", "plus_20_ms"][index];
            find(format!("{key}_{delay}_mean"), &with, &format!("reduction, {label}"), mean, "%");
            find(format!("{key}_{delay}_worst"), &with, &format!("worst flight, {label}"), worst, "%");
        }
        find(format!("{key}_delay_margin"), &with, "delay margin", margin(design.margins.delay_ms), "ms");
        find(format!("{key}_gain_margin"), &with, "gain margin", margin(design.margins.gain), "");
        find(format!("{key}_modulus_margin"), &with, "modulus margin", margin(design.margins.modulus), "");
        if let Some(error) = design.limit {
            find(format!("{key}_limit"), &with, "reduction at the linear-quadratic-Gaussian limit", limit(error), "%");
            find(format!("{key}_limit_cm"), &with, "RMS error at the limit, hover", 100.0 * error, "cm");
        }
    }
    let mut jitter = 0.0;
    for axis in 0..3 {
        jitter += gaussian::baseline_variance(&linearise(closed_loop, axis)?).unwrap_or(f64::NAN);
    }
    find("hover_cm".into(), "baseline", "RMS error at hover, from the linear loop", 100.0 * jitter.sqrt(), "cm");
    Ok(())
}
