//! What is true of the quadrotor study however few its flights.

use std::sync::LazyLock;

use super::*;
use crate::checks::{assert_readable, unanswered};

/// One quick run for all.
pub(crate) static QUICK: LazyLock<Study> = LazyLock::new(|| run(&QuadrotorSettings::quick(), "quick", &|_| {}).unwrap());

fn value(name: &str) -> f64 {
    QUICK.value(name).unwrap_or_else(|| panic!("no number is named `{name}`"))
}

#[test]
fn twelve_inputs_reduce_the_error_by_80_percent_and_the_delay_on_every_axis() {
    assert!(value("table_1_12_mean") >= 80.0, "{}", value("table_1_12_mean"));
    assert!(value("table_1_36_mean") > 0.0);
    for axis in ["x", "y", "z"] {
        assert!(value(&format!("delay_{axis}_12_inputs")).abs() < 0.25 * value(&format!("delay_{axis}_baseline")));
    }
}

#[test]
fn differences_and_their_reference_point_decide_more_than_the_kind_of_map() {
    let choices = ["in_yd_out_yd", "in_yd_out_y", "in_y_out_yd", "in_y_out_y"];
    let reductions = choices.map(|choice| value(&format!("{choice}_ridge")));
    let spread = reductions.iter().fold(f64::MIN, |most, value| most.max(*value))
        - reductions.iter().fold(f64::MAX, |least, value| least.min(*value));
    assert!(spread > 20.0, "{reductions:?}");
    assert!(value("in_yd_out_yd_network") > value("no_difference_network") + 10.0);
}

#[test]
fn rows_of_a_poor_training_signal_are_fitted_best_and_flown_worst() {
    assert!(value("signal_tones_rows") > value("signal_multisine_rows"));
    assert!(value("signal_tones_network_y") < 0.0 && value("signal_multisine_network_y") > value("signal_tones_network_y"));
    assert!(value("signal_multisine_ridge_y") > 90.0);
}

#[test]
fn a_gain_of_one_half_leaves_difference_learning_a_bias_that_absolute_heights_remove() {
    assert!((value("fig_4_baseline") - 0.5).abs() < 0.01);
    assert!(value("fig_4_difference_worst") > 10.0);
    assert!(value("fig_4_absolute_z_worst") < 0.5 * value("fig_4_difference_worst"));
}

#[test]
fn an_interpolated_network_may_run_slowly_and_r_is_a_time() {
    assert!(value("rate_5_hz_interpolated") > value("rate_5_hz_held") + 5.0);
    assert!((value("rate_5_hz_interpolated") - value("rate_50_hz_interpolated")).abs() < 2.0);
    assert!(value("preview_400_ms_clean") > value("preview_0_ms_clean") + 10.0);
    assert!(value("predecessor_33_hz_steps") < 0.0 && value("predecessor_33_hz_seconds") > 90.0);
}

#[test]
fn unseen_strokes_are_flown_better_than_by_any_method_that_learns_nothing() {
    assert!(value("predecessor_network_12_mean") > 43.0);
    assert!(value("predecessor_network_12_mean") > value("predecessor_shifted_mean"));
    assert_eq!(value("bypass_difference"), 0.0);
    assert!(value("crazyflie_both_worst") > 90.0);
    let order = ["both", "network", "flatness", "shifted"].map(|name| value(&format!("crazyflie_{name}_mean")));
    assert!(order.is_sorted_by(|better, worse| better > worse), "{order:?}");
    assert!(value("crazyflie_trials_mean") > value("crazyflie_shifted_mean"));
}

#[test]
fn every_number_and_figure_has_a_name_of_its_own_and_a_row_of_the_paper() {
    let figures = assert_readable(&QUICK);
    assert!(QUICK.findings.iter().all(|finding| !finding.rows.is_empty()));
    assert_eq!(unanswered(&QUICK, ROWS), Vec::<u8>::new());
    for name in ["fig_3_path", "fig_4", "signals", "sub_rates", "previews", "sizes", "crazyflie_trials", "crazyflie_distribution"]
    {
        assert!(figures.contains(&name), "no figure {name}");
    }
}
