//! What a step test tells before anything is trained: the gates of Insight 1b.
//!
//! *in* the paper's systems, driven by steps of random height, with noise; *out* rows 8 to 10; *never* a property that is read
//! from the model instead of the log; *source* Zhou 2017, section III; row 10: an even number of unstable zeros shows no
//! reversal, hence identified zeros.

use crate::siso::{Plant as _, fixtures::PERIOD};
use anyhow::Context as _;
use impromptu_diagnosis::{Record, Settings, diagnose};
use impromptu_report::{Axis, Curve, Figure, study::Study};
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::{Distribution as _, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{
    exact::finding_in,
    systems::{System, systems},
};

const SECTION: &str = "Step tests";
const SAMPLES: usize = 3_000;
const NOISE: f64 = 0.05;
/// Samples of the drawn response.
const DRAWN: usize = 60;

pub(super) fn add(study: &mut Study, seed: u64) -> anyhow::Result<()> {
    let mut curves = Vec::new();
    for system in systems() {
        let settings = Settings { sub_rate_hz: Some(1.0 / PERIOD), seed, ..Settings::default() };
        let found = diagnose(&record(&system, seed)?, &settings).with_context(|| system.title)?;
        let properties = &found.properties;
        let model = &system.model;
        let mut find = |name: &str, rows: &[u8], what: &str, value: f64, unit: &str| {
            study.find(finding_in(SECTION, &system, name, rows, what, value, unit));
        };
        find("step_degree", &[9], "relative degree from the log, samples", properties.strict_degree.value as f64, "");
        find("step_gain_low", &[16, 24], "DC gain from the log, lower end of the interval", properties.gain.low, "");
        find("step_gain_high", &[16, 24], "DC gain from the log, upper end", properties.gain.high, "");
        find("step_reversal", &[10], "samples for which the response has the wrong sign", properties.reversal_ticks as f64, "");
        let largest = properties.zeros.iter().max_by(|a, b| a.magnitude.value.total_cmp(&b.magnitude.value));
        let (low, high) = largest.map_or((0.0, 0.0), |zero| (zero.magnitude.low, zero.magnitude.high));
        find("step_zero_low", &[8, 10], "largest zero from the log, magnitude, lower end", low, "");
        find("step_zero_high", &[8, 10], "largest zero from the log, magnitude, upper end", high, "");
        study.note(SECTION, &format!("{}: {}", system.title, found.verdict_text()));
        let mut sum = 0.0;
        let response = std::iter::once(0.0).chain(model.markov(DRAWN).into_iter().map(|value| {
            sum += value;
            sum
        }));
        // On one scale: S2 starts 175 times as far on the wrong side as it ends on the right one.
        let share = 1.0 / model.dc_gain().abs();
        curves.push(Curve::line_and_dots(
            system.title,
            response.enumerate().map(|(sample, value)| {
                (sample as f64 * PERIOD, (value * share).signum() * (1.0 + (value * share).abs()).log10())
            }),
        ));
    }
    study.draw(Figure {
        section: SECTION.into(),
        name: "step_responses".into(),
        title: "Step responses in units of the DC gain's magnitude: S2 starts far on the wrong side".into(),
        x: Axis::linear("time [s]"),
        y: Axis::linear("sign(y) log10(1 + |y / K0|)"),
        curves,
    });
    Ok(())
}

/// Steps of random height and length through a system, with white noise on what is measured.
fn record(system: &System, seed: u64) -> anyhow::Result<Record> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut reference = Vec::new();
    while reference.len() < SAMPLES {
        let (height, held) = (random.random_range(-1.0..1.0), random.random_range(5..60));
        reference.extend(std::iter::repeat_n(height, held));
    }
    let mut state = vec![0.0; system.model.order()];
    let mut measured = Vec::with_capacity(reference.len());
    for input in &reference {
        let white: f64 = StandardNormal.sample(&mut random);
        measured.push(system.model.output(&state) + NOISE * white);
        system.model.advance(&mut state, *input);
    }
    let time: Vec<f64> = (0..reference.len()).map(|sample| sample as f64 * PERIOD).collect();
    Ok(Record::new(&time, &reference, &measured)?)
}
