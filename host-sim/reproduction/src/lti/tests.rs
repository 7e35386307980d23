use std::sync::LazyLock;

use crate::{
    checks::{assert_readable, unanswered},
    siso::{learning, levenberg_marquardt, samples::Sampling},
};

use super::{Settings, Study, run};

/// One quick run for all.
pub(crate) static QUICK: LazyLock<Study> = LazyLock::new(|| run(&quick()).unwrap());

/// Few rows and steps: what is asserted here does not need the last digits.
fn quick() -> Settings {
    let training = levenberg_marquardt::Settings { iterations: 30, units: 10, ..Default::default() };
    let sampling = Sampling { rows: 12, ..Default::default() };
    Settings { learning: learning::Settings { training, sampling, restarts: 1, ..Default::default() } }
}

#[test]
fn the_papers_rows_on_linear_systems_come_out_as_it_states_them() {
    let study = &*QUICK;
    let value = |name: &str| study.value(name).unwrap_or_else(|| panic!("no number {name}"));
    assert_eq!(unanswered(study, super::ROWS), Vec::<u8>::new());
    assert!(value("s1_state_space_tracking_rms_f64") < 1e-5 && value("s1_state_space_tracking_rms_int8") < 0.05);
    // S2: lost, although the module is learned.
    assert!(value("s2_state_space_tracking_rms_f64") > 1.0 && value("s2_exact_state_space_law_lost_f32") < 6_500.0);
    assert!(value("s2_inverse_is_stable") == 0.0 && value("s1_inverse_is_stable") == 1.0);
    // What the log tells of them, before anything is learned.
    assert_eq!([value("s1_step_degree"), value("s2_step_degree")], [1.0; 2]);
    assert!(value("s1_step_reversal") == 0.0 && (6.0..=12.0).contains(&value("s2_step_reversal")));
    assert!(value("s1_step_zero_high") < 1.0 && (value("s2_step_zero_low")..=value("s2_step_zero_high")).contains(&1.002));
    // State features correct an initial error within r samples; transfer-function features wait for the loop.
    assert!(value("state_space_exact_settling") <= 1.0 && value("transfer_function_exact_settling") >= 5.0);
    assert!((value("state_space_exact_disturbed") - 0.5).abs() < 1e-9);
    assert!((value("transfer_function_exact_disturbed") - 8.0 / 7.0).abs() < 1e-9);
    // Lemma 1.
    for name in ["unit_gain_state_space", "unit_gain_desired_only", "gain_0_7_desired_only", "gain_1_5_desired_only"] {
        assert!(value(&format!("{name}_lemma_error")) < 1e-6);
    }
    // It needs a loop that comes to rest, which the network's feedback decides.
    for name in ["unit_gain_state_space", "unit_gain_desired_only", "gain_0_7_desired_only", "gain_1_5_desired_only"] {
        assert!(value(&format!("{name}_pole")) < 1.0);
    }
    assert!(value("gain_0_7_state_space_pole") > 1.0 && value("gain_1_5_state_space_pole") > 1.0);
    for set in ["state_space", "desired_only"] {
        assert!(value(&format!("unit_gain_{set}_largest_error")) < 1e-3);
        assert!(value(&format!("gain_0_7_{set}_largest_error")) > 1.0 && value(&format!("gain_1_5_{set}_largest_error")) > 1.5);
    }
    assert!(value("translation_error") < 1e-9);
}

#[test]
fn every_number_and_figure_has_a_name_of_its_own_and_is_finite() {
    let figures = assert_readable(&QUICK);
    for name in
        ["s1_figure_2a", "s1_figure_2b", "s2_figure_2a", "s2_figure_2b", "exact_law_error", "disturbance_and_initial_error"]
    {
        assert!(figures.contains(&name), "no figure {name}");
    }
}

/// Asked are 1e-8 in f64 and 4e-7 in the firmware's f32 kernel; the paper has 2e-6, and 0.06 for S2.
#[test]
fn by_default_the_first_system_is_learned_as_closely_as_asked_and_the_second_one_as_in_the_paper() {
    let study = run(&Settings::default()).unwrap();
    let missed: Vec<_> = study.findings.iter().filter(|finding| finding.meets() == Some(false)).collect();
    assert!(missed.is_empty(), "{missed:#?}");
    let asked = study.findings.iter().filter(|finding| finding.asked.is_some()).count();
    let second = study.value("s2_state_space_model_rms_f64").unwrap();
    assert!(asked >= 4 && (0.02..0.2).contains(&second), "{asked} {second}");
}
