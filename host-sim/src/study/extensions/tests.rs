use super::*;

#[test]
fn the_extended_add_on_keeps_its_bounds_on_every_signal() {
    let mut study = Study::new("t", "host-sim study lti", 1);
    preview::add(&mut study, 2, 1).unwrap();
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
