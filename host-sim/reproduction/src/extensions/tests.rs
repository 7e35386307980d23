use std::sync::LazyLock;

use crate::{
    checks::unanswered,
    siso::extensions::flights::{Flight, PERIOD},
};
use impromptu_diagnosis::{Gate, Record, Settings as Diagnosing, assess};

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

/// The stock controller has an integrator: its gain is one, whatever a linear model of a few flights makes of it.
#[test]
fn no_gate_refuses_the_logs_of_a_real_loop() {
    let flights = logs::load(None).unwrap();
    let judged = |what: &str, flights: &[&Flight], axis: usize| {
        let records = flights.iter().map(|flight| {
            let time: Vec<f64> = (0..flight.position[axis].len()).map(|row| row as f64 * PERIOD).collect();
            Record::new(&time, &flight.reference[axis], &flight.position[axis]).unwrap()
        });
        let found = assess(&Record::joined(records).unwrap(), &Diagnosing::default()).unwrap();
        assert!(found.gates.failures(true).is_empty(), "{what}, axis {axis}: {:?}, {:?}", found.gates, found.properties.gain);
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
