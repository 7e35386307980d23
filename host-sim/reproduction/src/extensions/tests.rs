use std::sync::LazyLock;

use crate::{
    checks::unanswered,
    siso::extensions::flights::{Flight, PERIOD},
};
use impromptu_diagnosis::{Gate, Record, Settings as Diagnosing, Verdict, assess, diagnose, record::Segment};
use rand::{RngExt as _, SeedableRng as _, seq::IndexedRandom as _};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;

/// One quick run for all.
pub(crate) static QUICK: LazyLock<Study> = LazyLock::new(|| {
    let mut study = Study::new("t", "host-sim study lti", 1);
    nonlinear::add(&mut study, &TRAINING(10, 40), 2, 1);
    regions::add(&mut study, &TRAINING(8, 40), 2, 1);
    preview::add(&mut study, 2, 1).unwrap();
    study
});

#[test]
fn the_extended_add_on_keeps_its_bounds_on_every_signal() {
    let study = &*QUICK;
    assert_eq!(unanswered(study, ROWS), Vec::<u8>::new());
    assert!(study.findings.iter().all(|finding| finding.meets() != Some(false)), "{:#?}", study.findings);
    let longest = study.value("preview_40_s_remaining").unwrap();
    assert!(longest < study.value("preview_5_s_remaining").unwrap());
    assert!(study.value("preview_5_s_remaining").unwrap() < study.value("preview_0_5_s_remaining").unwrap());
}

#[test]
fn the_logs_in_the_program_predict_a_gain_that_the_shift_nearly_has() {
    let mut study = Study::new("t", "host-sim study lti", 1);
    logs::add(&mut study, None).unwrap();
    assert_eq!(study.value("logs_flights"), Some(17.0));
    let [window, cautious] = ["window", "cautious"].map(|name| study.value(&format!("logs_reduction_{name}")).unwrap());
    assert!(window > 75.0 && cautious < window, "{window} {cautious}");
}

/// An axis of flights as one record.
fn record(flights: &[&Flight], axis: usize) -> Record {
    let records = flights.iter().map(|flight| {
        let time: Vec<f64> = (0..flight.position[axis].len()).map(|row| row as f64 * PERIOD).collect();
        Record::new(&time, &flight.reference[axis], &flight.position[axis]).unwrap()
    });
    Record::joined(records).unwrap()
}

/// The lag at which the measured value is most like the reference, s, between samples by a parabola.
fn most_alike(record: &Record) -> f64 {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let at = |lag: usize| -> f64 {
        let of = |segment: &Segment| -> [f64; 2] {
            let (u, y) = (mean(&segment.reference), mean(&segment.measured));
            let pairs = segment.reference.iter().zip(segment.measured.iter().skip(lag));
            let squares = pairs.map(|(reference, measured)| ((measured - y) - (reference - u)).powi(2));
            [squares.sum(), (segment.reference.len() - lag) as f64]
        };
        let [sum, count] = record.segments.iter().map(of).fold([0.0; 2], |all, one| [all[0] + one[0], all[1] + one[1]]);
        sum / count
    };
    let found: Vec<f64> = (0..150).map(at).collect();
    let best = (1..149).min_by(|&a, &b| found[a].total_cmp(&found[b])).unwrap();
    let [a, b, c] = [found[best - 1], found[best], found[best + 1]];
    (best as f64 + 0.5 * (a - c) / (a - 2.0 * b + c)) * record.period_s
}

/// Drawn subsets of three flights and more, which no verdict and no lag may depend on.
fn drawn_subsets(count: usize) {
    let flights = logs::load(None).unwrap();
    let flights: Vec<&Flight> = flights.iter().collect();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(20);
    let (mut untold, mut far) = (0, Vec::new());
    for draw in 0..count {
        let axis = draw % 2;
        let size = random.random_range(3..=flights.len());
        let chosen: Vec<&Flight> = flights.sample(&mut random, size).copied().collect();
        let record = record(&chosen, axis);
        let found = diagnose(&record, &Diagnosing::default()).unwrap();
        assert_ne!(found.verdict, Verdict::WillNot, "draw {draw}: {}", found.verdict_text());
        untold += usize::from(found.verdict == Verdict::CannotTell);
        let (lag, alike) = (found.properties.motion_lag_s, most_alike(&record));
        let away = (lag.value - alike).abs();
        println!("draw {draw}: {size} flights, axis {axis}: {}, lag {lag:?}, most alike {alike:.3}", found.verdict.words());
        if away > (0.05 * alike).max(1.0 / found.sub_rate_hz) {
            far.push(format!("draw {draw}, {size} flights, axis {axis}: {lag:?}, most alike at {alike:.3} s"));
        }
    }
    println!("{count} subsets: {untold} cannot tell, {} lags away", far.len());
    assert!(20 * far.len() <= count, "{far:#?}");
}

#[test]
fn twenty_drawn_subsets_of_real_flights_have_one_verdict() {
    drawn_subsets(20);
}

#[test]
#[ignore = "long"]
fn long_two_hundred_drawn_subsets_of_real_flights_have_one_verdict() {
    drawn_subsets(200);
}

/// The stock controller has an integrator: its gain is one, whatever a linear model of a few flights makes of it.
#[test]
fn no_gate_refuses_the_logs_of_a_real_loop() {
    let flights = logs::load(None).unwrap();
    let judged = |what: &str, flights: &[&Flight], axis: usize| {
        let found = assess(&record(flights, axis), &Diagnosing::default()).unwrap();
        assert!(
            !matches!(found.gates.unit_gain, Gate::Failed(_)),
            "{what}, axis {axis}: {:?}, {:?}",
            found.gates,
            found.properties.gain
        );
        found
    };
    for axis in [0, 1] {
        let all = judged("all", &flights.iter().collect::<Vec<_>>(), axis);
        assert!(
            all.gates.unit_gain == Gate::Passed && (0.4..0.6).contains(&(all.properties.lag_s.value + 0.05)),
            "{:?}",
            all.properties
        );
        for family in ["B10_lissajous", "B2_circle", "B3_figure8", "B7_oval", "B8_star"] {
            let of: Vec<&Flight> = flights.iter().filter(|flight| flight.family() == family).collect();
            judged(family, &of, axis);
        }
    }
}
