//! Behaviour of whole designs on a synthetic loop.

mod refusals;

use std::sync::OnceLock;

use super::synthetic::{Flight, Log, fly};
use super::*;

/// Two axes of 1.5 minutes in `lab` conditions, pooled.
fn lab_data() -> &'static IdentificationData {
    static DATA: OnceLock<IdentificationData> = OnceLock::new();
    DATA.get_or_init(|| {
        let logs = [1, 101].map(|seed| fly(&Flight { seed, ..Flight::collecting() }));
        IdentificationData::collect(&[logs[0].axis(), logs[1].axis()], 45).unwrap()
    })
}

fn lab_design() -> LaneDesign {
    design(lab_data(), &DesignSettings::default()).unwrap()
}

/// Error with the lane over error without, both in the conditions of `flight`.
fn remaining(flight: Flight, gain: &LaneGain) -> f64 {
    let without = fly(&flight).error_rms();
    let with = fly(&Flight { lane: Some(gain.clone()), ..flight });
    with.error_rms() / without
}

fn hover() -> Flight {
    Flight { seconds: 40.0, seed: 5, ..Flight::lab() }
}

#[test]
fn default_design_divides_the_hover_error_by_four_and_bears_more_delay() {
    let gain = lab_design().gain;
    for (more_delay, most) in [(0.0, 0.27), (0.01, 0.28), (0.02, 0.30)] {
        let flight = Flight { more_delay, ..hover() };
        for flight in [flight.clone(), flight.rough()] {
            let remaining = remaining(flight, &gain);
            assert!(remaining < most, "{more_delay} s more delay leaves {remaining:.3}");
        }
    }
}

#[test]
fn design_beats_a_pd_on_the_reference() {
    assert!(remaining(hover(), &lab_design().gain) < 0.6 * remaining(hover(), &LaneGain::pd(1.0, 0.4)));
}

#[test]
fn more_control_weight_gives_a_larger_gain_margin_and_bears_gain_errors() {
    let settings = DesignSettings { control_weight: 1e-2, ..DesignSettings::default() };
    let gentle = design(lab_data(), &settings).unwrap();
    let margin = |design: &LaneDesign| design.assessment.margins.as_ref().unwrap().gain_up.unwrap();
    assert!(margin(&gentle) > 1.2 * margin(&lab_design()));
    for (gain, more_delay) in [(0.7, 0.0), (1.3, 0.0), (1.3, 0.02)] {
        let flight = Flight { gain, more_delay, ..hover() };
        assert!(remaining(flight, &gentle.gain) < 0.4, "gain {gain}");
    }
}

#[test]
fn integral_holds_a_constant_disturbance_beyond_the_fast_clamp() {
    // 0.6 m/s² need 9 cm of reference: more than the fast clamp, so the integral alone must hold them.
    let flight = Flight { push: -0.6, limits: [0.05, 0.3], seconds: 60.0, ..hover() };
    let log = fly(&Flight { lane: Some(lab_design().gain), ..flight });
    let settled = &log.error[2000..];
    let mean = settled.iter().sum::<f64>() / settled.len() as f64;
    assert!(mean.abs() < 1e-3, "{mean}");
}

#[test]
fn the_equation_is_solved_and_both_models_are_stable() {
    let design = lab_design();
    assert!(design.riccati_residual < 1e-9, "{}", design.riccati_residual);
    assert!(design.spectral_radius < 1.0);
    let margins = design.assessment.margins.expect("stable on the longer model");
    assert!(margins.delay_milliseconds.unwrap() > 20.0, "{margins:?}");
    assert_eq!(design.gain.coefficient_count(), 75);
    // The model explains all but the sensors' noise.
    assert!((design.residual[0] / 3e-4 - 1.0).abs() < 0.2 && (design.residual[1] / 1e-2 - 1.0).abs() < 0.2);
}

#[test]
fn a_memory_that_is_too_short_shows_on_the_longer_model() {
    let settings = DesignSettings { lags: 8, ..DesignSettings::default() };
    let short = design(lab_data(), &settings).unwrap();
    // On its own model it looks perfectly stable, and it makes flights far worse.
    assert!(short.spectral_radius < 0.999);
    assert!(short.assessment.margins.is_none_or(|margins| margins.modulus < 0.05));
    assert!(remaining(hover(), &short.gain) > 1.0);
}

fn short(flight: Flight) -> Flight {
    Flight { seconds: 45.0, ..flight }
}

fn collect(log: &Log) -> IdentificationData {
    IdentificationData::collect(&[log.axis()], 25).unwrap()
}

fn settings() -> DesignSettings {
    DesignSettings { margin_lags: 25, ..DesignSettings::default() }
}

fn noise_free(flight: Flight) -> Flight {
    Flight { noise: [0.0; 2], gusts: 0.0, ..flight }
}

#[test]
fn moving_the_whole_flight_changes_nothing() {
    let mut log = fly(&short(Flight::collecting()));
    let here = design(&collect(&log), &settings()).unwrap();
    for signal in [&mut log.measured_position, &mut log.reference_position] {
        signal.iter_mut().for_each(|position| *position += 64.0);
    }
    let there = design(&collect(&log), &settings()).unwrap();
    for (here, there) in here.gain.stored_coefficients().iter().zip(there.gain.stored_coefficients()) {
        assert!((here - there).abs() < 1e-4, "{here} {there}");
    }
}

#[test]
fn added_noise_minimises_the_error_that_noisy_copies_would_have() {
    let log = fly(&short(Flight::collecting()));
    let noise = [1e-3, 2e-2];
    let model = collect(&log).fit(10, noise, 1e-12).unwrap();
    let last = log.measured_position.len() - 1;
    let cost = |equation: &identification::OutputEquation| {
        let dot = |coefficients: &[f64], signal: &[f64], k: usize| -> f64 {
            coefficients.iter().enumerate().map(|(lag, c)| c * signal[k - lag]).sum()
        };
        let errors = (24..last).map(|k| {
            log.measured_position[k + 1]
                - dot(&equation.position, &log.measured_position, k)
                - dot(&equation.velocity, &log.measured_velocity, k)
                - dot(&equation.reference_position, &log.reference_position, k)
                - dot(&equation.reference_velocity, &log.reference_velocity, k)
        });
        let square = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
        errors.map(|error| error * error).sum::<f64>()
            + (last - 24) as f64 * (noise[0].powi(2) * square(&equation.position) + noise[1].powi(2) * square(&equation.velocity))
    };
    let least = cost(&model.position);
    for change in [-1e-3, 1e-3] {
        let mut positions = model.position.clone();
        positions.position[0] += change;
        positions.position[3] -= change;
        let mut reference = model.position.clone();
        reference.position[0] += change;
        reference.reference_position[2] -= change;
        let mut velocity = model.position.clone();
        velocity.velocity[1] += change;
        for changed in [positions, reference, velocity] {
            assert!(cost(&changed) > least);
        }
    }
}
