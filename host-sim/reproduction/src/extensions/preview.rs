//! Row 31.

use impromptu_report::{
    Axis, Curve, Figure,
    study::{Asked, Finding, Study},
};

use crate::siso::{
    Window,
    extensions::{
        mean_and_worst,
        preview::{self, Scheme, Signal},
    },
    fixtures,
};

use super::summary::summary;

const SECTION: &str = "Beyond the paper: the non-minimum-phase loop S2 with a window of the desired output";
/// Preview that is reported in full, s.
const LONG: f64 = 30.0;
const PREVIEWS: [f64; 9] = [0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 40.0];

pub(super) fn add(study: &mut Study, each: u64, seed: u64) -> anyhow::Result<()> {
    let system = fixtures::non_minimum_phase();
    let signals = preview::signals(each, seed);
    let runs = preview::training_runs(seed);
    let learn = |seconds: f64| {
        preview::learn(&runs, seconds).ok_or_else(|| anyhow::anyhow!("the runs do not determine a window of {seconds} s"))
    };
    let plain = preview::fly("y_d as reference", &Window { taps: vec![(0, 1.0)] }, &signals, 0.0);
    let nothing = preview::fly("reference 0", &Window { taps: Vec::new() }, &signals, 0.0);
    let fixed = preview::fly("y_d / DC gain", &Window::static_inverse(&system), &signals, 0.0);
    let zero_phase = preview::fly("zero-phase tracking", &Window::zero_phase(&system), &signals, 0.0);
    let long = learn(LONG)?;
    let learned = preview::fly("learned window, 30 s", &long, &signals, LONG);
    let unprepared = preview::fly("learned window, 30 s, loop starts with the trajectory", &long, &signals, 0.0);
    study.note(
        SECTION,
        "The exact inverse of S2 is unstable. A window of y_d alone (half a second of past, the rest preview, 4 to 2 samples a \
         second) is bounded by \
         construction. It is learned as the paper trains, u regressed on the outputs of logged runs, with random multisines of \
         0.01-1 Hz; none of the \
         signals below was in training. Reductions are against y_d as reference. That is a poor baseline here (DC gain -2.57, \
         wrong sign): \
         a reference of zero and y_d over the DC gain stand beside it, and the reduction against the best of the three is the \
         one to quote. The loop \
         starts before the trajectory, as long as the preview reaches; without that the start of the trajectory is lost.",
    );
    for kind in kinds(&signals) {
        let key: String = kind.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' }).collect();
        let key = format!("preview_{}", key.trim_matches('_'));
        for (name, scheme) in [
            ("plain", &plain),
            ("nothing", &nothing),
            ("static", &fixed),
            ("zero_phase", &zero_phase),
            ("learned", &learned),
            ("unprepared", &unprepared),
        ] {
            for (suffix, of, value) in summary(of_kind(&signals, scheme, kind), "mean", "worst") {
                let text = format!("{kind}: {}, RMS, {of}", scheme.name);
                let found = Finding::new(SECTION, &format!("{key}_{name}{suffix}"), &[31], &text, value, "");
                study.find(found.cell(&format!("RMS of y - y_d, {of} signal of a kind"), kind, &scheme.name));
            }
        }
    }
    let against = |scheme: &Scheme, baselines: &[&Scheme]| {
        // The worst reduction is the least one.
        let losses = (0..signals.len()).map(|index| {
            let baseline = baselines.iter().map(|baseline| baseline.errors[index]).fold(f64::INFINITY, f64::min);
            -100.0 * (1.0 - scheme.errors[index] / baseline)
        });
        summary(losses, "mean", "worst signal").map(|(suffix, of, loss)| (suffix, of, -loss))
    };
    for (name, baselines, text) in [
        ("plain", &[&plain][..], "y_d as reference"),
        ("best", &[&plain, &nothing, &fixed][..], "the best of y_d, y_d / DC gain and no reference"),
    ] {
        for (key, scheme) in [("learned", &learned), ("unprepared", &unprepared)] {
            let what = format!("{}: reduction against {text}", scheme.name);
            for (suffix, of, value) in against(scheme, baselines) {
                let name = format!("preview_reduction_{key}_{name}{suffix}");
                let found = Finding::new(SECTION, &name, &[31], &format!("{what}, {of}"), value, "%");
                let found = found.cell("Reduction", &format!("against {text}, {of}"), &scheme.name);
                let asked = key == "learned" && !suffix.is_empty();
                study.find(if asked { found.asked(Asked::AtLeast(0.0)) } else { found });
            }
        }
    }
    let largest = signals.iter().map(largest_value).fold(0.0, f64::max);
    study.find(
        Finding::new(
            SECTION,
            "preview_largest_reference",
            &[31],
            "largest |u| of the learned window on any signal",
            learned.largest_reference,
            "",
        )
        .asked(Asked::AtMost(learned.gain * largest)),
    );
    study.find(Finding::new(SECTION, "preview_gain", &[31], "\u{3a3}|weight| of the learned window, 30 s", learned.gain, ""));
    draw(study, &signals, &plain, &learn)
}

/// Largest |y_d|.
fn largest_value(signal: &Signal) -> f64 {
    (0..6_000).map(|sample| signal.at(f64::from(sample) * fixtures::PERIOD).abs()).fold(0.0, f64::max)
}

fn kinds(signals: &[Signal]) -> Vec<&'static str> {
    let mut kinds: Vec<&str> = Vec::new();
    for signal in signals {
        if !kinds.contains(&signal.kind) {
            kinds.push(signal.kind);
        }
    }
    kinds
}

fn of_kind(signals: &[Signal], scheme: &Scheme, kind: &str) -> Vec<f64> {
    signals.iter().zip(&scheme.errors).filter(|(signal, _)| signal.kind == kind).map(|(_, error)| *error).collect()
}

/// What preview buys: for each kind of signals, and for the stable inverse cut off at the same length.
fn draw(
    study: &mut Study,
    signals: &[Signal],
    plain: &Scheme,
    learn: &dyn Fn(f64) -> anyhow::Result<Window>,
) -> anyhow::Result<()> {
    let system = fixtures::non_minimum_phase();
    let kinds = kinds(signals);
    let remaining = |scheme: &Scheme, kind: &str| {
        let (error, _) = mean_and_worst(of_kind(signals, scheme, kind));
        let (baseline, _) = mean_and_worst(of_kind(signals, plain, kind));
        100.0 * error / baseline
    };
    let mut curves: Vec<Curve> = kinds.iter().map(|kind| Curve::line_and_dots(kind, [])).collect();
    let mut cut: Vec<Curve> = kinds.iter().map(|kind| Curve::line_and_dots(kind, [])).collect();
    for seconds in PREVIEWS {
        let learned = preview::fly("learned", &learn(seconds)?, signals, seconds);
        for (curve, kind) in curves.iter_mut().zip(&kinds) {
            curve.points.push((seconds, remaining(&learned, kind)));
        }
        let samples = (seconds / fixtures::PERIOD).round() as usize;
        let truncated = Window::truncated_inverse(&system, samples).ok_or_else(|| anyhow::anyhow!("S2 has one unstable zero"))?;
        let truncated = preview::fly("cut off", &truncated, signals, seconds);
        for (curve, kind) in cut.iter_mut().zip(&kinds) {
            curve.points.push((seconds, remaining(&truncated, kind)));
        }
        let left = (0..signals.len()).map(|index| 100.0 * learned.errors[index] / plain.errors[index]);
        let name = format!("preview_{}_s_remaining", seconds.to_string().replace('.', "_"));
        let what = format!("learned window, {seconds} s of preview: error left of y_d as reference");
        for (suffix, of, value) in summary(left, "mean", "worst signal") {
            let found = Finding::new(SECTION, &format!("{name}{suffix}"), &[31], &format!("{what}, {of}"), value, "%");
            study.find(found.cell("Error left of y_d as reference", of, &format!("{seconds} s of preview")));
        }
    }
    for (name, title, curves) in [
        ("preview_learned", "Learned window: what the preview buys", curves),
        ("preview_cut_off", "Stable inverse cut off at the preview: e^(-T/5 s) is left", cut),
    ] {
        study.draw(Figure {
            section: SECTION.into(),
            name: name.into(),
            title: title.into(),
            x: Axis::linear("preview [s]"),
            y: Axis::logarithmic("error left of y_d as reference [%]"),
            curves,
        });
    }
    Ok(())
}
