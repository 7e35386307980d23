//! The loops that fly a Crazyflie: over strokes, with delay, turned, and with an add-on's interface in between.

use impromptu_sim::{
    condition::Condition,
    controller::Controller,
    flights::Loop,
    plant::Vehicle,
    trajectory::{Trajectory, hover, strokes},
};

const FEED_FORWARD: Controller = Controller::Mellinger { feed_forward: true };

/// A Crazyflie flown by a loop under a condition of that name.
fn flown_by(controller: Controller, condition: &str) -> Loop {
    let vehicle = Vehicle::named("crazyflie").unwrap();
    Loop::new(vehicle, "stock", Condition::named(condition).unwrap()).unwrap().flown_by(controller).unwrap()
}

/// Six strokes.
fn six() -> Vec<Trajectory> {
    strokes(1, 6, 1.0, 100.0).unwrap()
}

/// Mean of the RMS errors over trajectories, cm.
fn centimetres(quadrotor: &Loop, trajectories: &[Trajectory]) -> f64 {
    let errors = quadrotor.errors(trajectories, None, 1.0, 7).unwrap();
    100.0 * errors.iter().sum::<f64>() / errors.len() as f64
}

#[test]
fn each_loop_tracks_strokes_as_it_did() {
    let strokes = six();
    for (controller, expected) in
        [(Controller::Pid, 36.05), (Controller::Mellinger { feed_forward: false }, 5.43), (FEED_FORWARD, 1.42)]
    {
        let found = centimetres(&flown_by(controller, "lab"), &strokes);
        assert!((found / expected - 1.0).abs() < 0.03, "{}: {found} cm instead of {expected}", controller.name());
    }
}

#[test]
fn the_flight_stacks_own_loop_is_as_it_was_before_there_were_others() {
    let strokes = six();
    let quadrotor = flown_by(Controller::Se3, "lab");
    for (delay, expected) in [(0.0, 10.417_853_194_164_374), (0.02, 10.857_263_804_423_141)] {
        let found = centimetres(&quadrotor.delayed(delay), &strokes);
        assert!((found - expected).abs() < 1e-9, "{delay} s: {found}");
    }
}

#[test]
fn what_is_fed_forward_arrives_with_the_command_and_late_if_that_is_late() {
    let strokes = six();
    let quadrotor = flown_by(FEED_FORWARD, "lab");
    let found = [0.0, 0.01, 0.02].map(|delay| centimetres(&quadrotor.delayed(delay), &strokes));
    assert!(found.is_sorted() && found[2] > 1.15 * found[0] && found[2] < 2.0, "{found:?}");
}

#[test]
fn a_vehicle_that_looks_elsewhere_flies_as_well() {
    for controller in Controller::ALL {
        let quadrotor = flown_by(controller, "clean");
        let ahead = &six()[..1];
        let mut turned = ahead.to_vec();
        turned.iter_mut().flat_map(|trajectory| &mut trajectory.samples).for_each(|sample| sample.yaw = 2.5);
        let [ahead, turned] = [ahead, &turned].map(|trajectories| centimetres(&quadrotor, trajectories));
        assert!((turned / ahead - 1.0).abs() < 0.01, "{}: {ahead} {turned}", controller.name());
    }
}

#[test]
fn hover_stands_still_but_for_what_the_pids_integral_still_has_to_learn() {
    let hover = [hover(10.0).sampled(100.0).unwrap()];
    for (controller, most) in [(Controller::Pid, 2.0), (FEED_FORWARD, 1e-3)] {
        let found = centimetres(&flown_by(controller, "clean"), &hover);
        assert!(found < most, "{}: {found} cm", controller.name());
    }
}

#[test]
fn a_loop_has_a_name_by_which_its_gains_go() {
    for controller in Controller::ALL {
        assert_eq!(Controller::named(controller.name()), Some(controller));
        let quadrotor = flown_by(controller, "lab");
        let gains = if controller == Controller::Se3 { "stock" } else { controller.name() };
        assert_eq!((quadrotor.controller, quadrotor.gains.as_str()), (controller, gains));
        assert_eq!(quadrotor.settings.check(), Ok(()));
    }
    assert_eq!(Controller::named("lqr"), None);
}

#[test]
fn a_vehicle_that_is_no_crazyflie_is_refused_with_what_is_different() {
    let refusal = |name: &str, controller| {
        let quadrotor = Loop::new(Vehicle::named(name).unwrap(), "stock", Condition::named("lab").unwrap()).unwrap();
        quadrotor.flown_by(controller).map(|_| ()).map_err(|error| error.to_string())
    };
    let message = refusal("hummingbird", Controller::Pid).unwrap_err();
    assert_eq!(
        message,
        "controller `pid` has a Crazyflie 2.x's gains, vehicle `hummingbird` is none: its mass is 0.5 kg, not 0.02 to 0.042"
    );
    let message = refusal("crazyflie-brushless", FEED_FORWARD).unwrap_err();
    assert!(message.contains("`mellinger_feed_forward`") && message.contains("its mass is 0.044 kg"), "{message}");
    assert_eq!(refusal("hummingbird", Controller::Se3), Ok(()));
    // A Crazyflie of another weight is one; one with rotors that lift twice as much is none.
    let mut vehicle = Vehicle::named("crazyflie").unwrap();
    vehicle.mass = 0.034;
    assert_eq!(Controller::Pid.check(&vehicle), Ok(()));
    vehicle.thrust_coefficient *= 2.0;
    assert!(Controller::Pid.check(&vehicle).unwrap_err().to_string().contains("its share of all thrust in hover"));
}
