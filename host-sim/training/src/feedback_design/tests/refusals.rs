//! Logs and settings that must not give a lane.

use super::*;

#[test]
fn logs_with_dither_pass_with_and_without_noise() {
    let flight = short(Flight::collecting());
    for flight in [noise_free(flight.clone()), flight.clone(), flight.rough()] {
        let log = fly(&flight);
        let mut axis = log.axis();
        axis.dither = Some(&log.dither);
        let data = IdentificationData::collect(&[axis], 25).unwrap();
        let design = design(&data, &settings()).unwrap();
        assert!((design.excitation.innovation - 0.01 / 5.0_f64.sqrt()).abs() < 5e-4);
        assert!((design.excitation.dither_share.unwrap() - 0.9).abs() < 0.1);
    }
}

#[test]
fn logs_without_dither_are_refused_with_and_without_noise() {
    let flight = Flight { dither: 0.0, ..short(Flight::collecting()) };
    let with_lane = |flight: Flight| Flight { lane: Some(LaneGain::pd(1.0, 0.4)), ..flight };
    for flight in [
        noise_free(flight.clone()),
        flight.clone(),
        flight.clone().rough(),
        // Feedback on noise moves the reference too, but does not tell cause from effect.
        with_lane(flight.clone()),
        with_lane(flight.clone().rough()),
    ] {
        let data = collect(&fly(&flight));
        let refusal = design(&data, &settings()).unwrap_err();
        assert!(matches!(refusal, DesignRefusal::NoExcitation { .. }), "{refusal}");
    }
    // Clamps make it a nonlinear function of the noise, which a linear prediction cannot explain: too weak all the same.
    let clamped = Flight { limits: [0.003, 0.01], ..with_lane(flight).rough() };
    let refusal = design(&collect(&fly(&clamped)), &settings()).unwrap_err();
    assert!(matches!(refusal, DesignRefusal::NoExcitation { .. } | DesignRefusal::WeakExcitation { .. }), "{refusal}");
}

#[test]
fn a_dither_too_weak_for_the_sensors_is_refused() {
    let flight = Flight { dither: 0.003, ..short(Flight::collecting()).rough() };
    let refusal = design(&collect(&fly(&flight)), &settings()).unwrap_err();
    assert!(matches!(refusal, DesignRefusal::WeakExcitation { .. }), "{refusal}");
}

#[test]
fn a_logged_dither_that_is_not_in_the_reference_is_refused() {
    let log = fly(&short(Flight::collecting()));
    let millimetres: Vec<f64> = log.dither.iter().map(|dither| dither * 1e3).collect();
    let opposite: Vec<f64> = log.dither.iter().map(|dither| -dither).collect();
    let nothing = vec![0.0; log.dither.len()];
    for dither in [&millimetres, &opposite, &nothing] {
        let mut axis = log.axis();
        axis.dither = Some(dither);
        let data = IdentificationData::collect(&[axis], 25).unwrap();
        let refusal = design(&data, &settings()).unwrap_err();
        assert!(matches!(refusal, DesignRefusal::DitherNotInReference { .. }), "{refusal}");
    }
}

#[test]
fn bad_logs_and_settings_are_refused_by_name() {
    let log = fly(&short(Flight::collecting()));
    let refusal = |axis: AxisLog| IdentificationData::collect(&[log.axis(), axis], 25).unwrap_err().to_string();
    let mut axis = log.axis();
    axis.reference_velocity = &log.reference_velocity[1..];
    assert!(refusal(axis).contains("log 1: `reference_velocity` has 4499 samples"));
    let mut broken = log.measured_velocity.clone();
    broken[17] = f64::NAN;
    let mut axis = log.axis();
    axis.measured_velocity = &broken;
    assert!(refusal(axis).contains("log 1: `measured_velocity` is not finite at tick 17"));
    let few = IdentificationData::collect(&[], 25).unwrap_err();
    assert!(matches!(few, DesignRefusal::TooFewRows { rows: 0, .. }));

    let data = collect(&log);
    let with = |change: fn(&mut DesignSettings)| {
        let mut settings = settings();
        change(&mut settings);
        design(&data, &settings).unwrap_err().to_string()
    };
    assert!(with(|settings| settings.control_weight = 0.0).contains("`control_weight`"));
    assert!(with(|settings| settings.velocity_weight = f64::NAN).contains("`velocity_weight`"));
    assert!(with(|settings| settings.margin_lags = 20).contains("`margin_lags`"));
    assert!(with(|settings| settings.margin_lags = 26).contains("lags"));
    assert!(with(|settings| settings.lags = 1).contains("`lags`"));
}
