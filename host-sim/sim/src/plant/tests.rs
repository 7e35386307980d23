//! What the plant promises beside the reference's equations.

use super::*;

/// Eight different flights, none of them calm.
fn flights() -> (States, [Batch; 4], Disturbance) {
    let mut states = States::splat(&State::at_rest([0.0; 3]));
    let mut commands = [[0.0; BATCH]; 4];
    let mut disturbance = Disturbance::default();
    for member in 0..BATCH {
        let k = member as f64;
        let state = State {
            position: [k, -k, 0.5 * k],
            velocity: [1.0 - 0.3 * k, 0.2 * k, 0.1],
            attitude: [0.9, 0.1 * k - 0.3, 0.2, -0.05 * k],
            body_rates: [0.5 * k, 1.0 - k, 2.0],
            rotor_speeds: [900.0, 1000.0 + 20.0 * k, 1100.0, 950.0],
        };
        states.set_member(member, &state);
        disturbance.set_member(member, [0.4 * k, -1.0, 0.2], [0.01, 0.02 * k, -0.3]);
        for (rotor, command) in commands.iter_mut().enumerate() {
            command[member] = 1000.0 + 40.0 * k - 30.0 * rotor as f64;
        }
    }
    (states, commands, disturbance)
}

fn varied() -> [Variation; BATCH] {
    std::array::from_fn(|member| Variation {
        payload_factor: 1.0 + 0.02 * member as f64,
        thrust_factor: 1.0 - 0.03 * member as f64,
        drag_factor: 1.0 + 0.5 * member as f64,
        motor_lag_factor: 1.0 + 0.1 * member as f64,
    })
}

/// The three built-in vehicles take the three forms of the equations.
fn plants() -> impl Iterator<Item = Plant> {
    Vehicle::names().map(|name| Plant::new(&Vehicle::named(name).unwrap(), varied()))
}

/// Bites where the compiler makes vectors of the loop over the members: in optimised builds.
#[test]
fn every_instruction_set_gives_the_same_bits() {
    let forms: Vec<Form> = plants().map(|plant| plant.form).collect();
    assert_eq!(forms, [Form::Planar, Form::PlanarWithLift, Form::Full]);
    for plant in plants() {
        let (start, commands, disturbance) = flights();
        let run = |arch| {
            let mut states = start;
            for _ in 0..500 {
                plant.step_with(arch, &mut states, &commands, &disturbance, 0.002);
            }
            states
        };
        let portable = run(Arch::Scalar);
        assert!(portable.position.as_flattened().iter().all(|value| value.is_finite()));
        assert_eq!(run(plant.arch), portable);
        #[cfg(target_arch = "x86_64")]
        if let Some(narrower) = pulp::x86::V3::try_new() {
            assert_eq!(run(Arch::V3(narrower)), portable);
        }
    }
}

#[test]
fn a_flight_does_not_depend_on_its_place_or_on_the_others() {
    let vehicle = Vehicle::named("crazyflie-brushless").unwrap();
    let plant = Plant::new(&vehicle, [varied()[5]; BATCH]);
    let (start, commands, disturbance) = flights();
    let mut together = start;
    let mut alone = States::splat(&start.member(5));
    let same_commands = commands.map(|command| [command[5]; BATCH]);
    let mut same_disturbance = Disturbance::default();
    for member in 0..BATCH {
        let wind = gather(&disturbance.wind_velocity, 5);
        same_disturbance.set_member(member, wind, gather(&disturbance.acceleration, 5));
    }
    for _ in 0..200 {
        plant.step(&mut together, &commands, &disturbance, 0.002);
        plant.step(&mut alone, &same_commands, &same_disturbance, 0.002);
    }
    assert_eq!(alone, States::splat(&together.member(5)));
}

#[test]
fn the_planar_form_is_the_full_one_simplified() {
    for name in ["crazyflie", "crazyflie-brushless"] {
        let mut vehicle = Vehicle::named(name).unwrap();
        // Uneven arms, so that no sum over the rotors vanishes.
        for (rotor, shift) in vehicle.rotors.iter_mut().zip([0.001, 0.004, -0.002, 0.003]) {
            rotor.position[0] += shift;
            rotor.position[1] -= 0.5 * shift;
        }
        let simple = Plant::new(&vehicle, varied());
        assert_ne!(simple.form, Form::Full);
        let full = Plant { form: Form::Full, ..simple.clone() };
        let (states, commands, disturbance) = flights();
        let (a, b) = (simple.derivative(&states, &commands, &disturbance), full.derivative(&states, &commands, &disturbance));
        for (a, b) in a.body_rates.as_flattened().iter().zip(b.body_rates.as_flattened()) {
            assert!((a - b).abs() <= 1e-12 * b.abs().max(1.0), "{a} {b}");
        }
        for (a, b) in a.velocity.as_flattened().iter().zip(b.velocity.as_flattened()) {
            assert!((a - b).abs() <= 1e-12 * b.abs().max(1.0), "{a} {b}");
        }
    }
}

#[test]
fn the_variations_and_the_disturbance_act_on_their_own_terms() {
    let vehicle = Vehicle::named("crazyflie").unwrap();
    let hover = (vehicle.mass * GRAVITY / (4.0 * vehicle.thrust_coefficient)).sqrt();
    let state = State { rotor_speeds: [hover; 4], ..State::at_rest([0.0; 3]) };
    let mut variations = [Variation::default(); BATCH];
    variations[1].payload_factor = 1.25;
    variations[2].thrust_factor = 0.9;
    variations[3].motor_lag_factor = 2.0;
    variations[4].drag_factor = 4.0;
    let mut disturbance = Disturbance::default();
    disturbance.set_member(5, [0.0; 3], [0.1, -0.2, 0.3]);
    for member in [0, 4] {
        disturbance.set_member(member, [2.0, 0.0, 0.0], [0.0; 3]);
    }
    let plant = Plant::new(&vehicle, variations);
    let commands = [[hover + 72.0; BATCH]; 4];
    let rate = plant.derivative(&States::splat(&state), &commands, &disturbance);
    let close = |found: f64, expected: f64| {
        assert!((found - expected).abs() < 1e-12, "{found} instead of {expected}");
    };
    close(rate.velocity[2][6], 0.0);
    close(rate.velocity[2][1], GRAVITY * (1.0 / 1.25 - 1.0));
    close(rate.velocity[2][2], -0.1 * GRAVITY);
    close(rate.rotor_speeds[0][3], 0.5 * rate.rotor_speeds[0][6]);
    // Blown along with the wind, four times as strongly with four times the drag.
    close(rate.velocity[0][0], 2.0 * 4.0 * hover * vehicle.rotor_drag / vehicle.mass);
    close(rate.velocity[0][4], 4.0 * rate.velocity[0][0]);
    for axis in 0..3 {
        close(rate.velocity[axis][5] - rate.velocity[axis][6], [0.1, -0.2, 0.3][axis]);
    }
}

#[test]
fn commands_outside_the_range_act_as_its_ends() {
    let vehicle = Vehicle::named("crazyflie").unwrap();
    let plant = Plant::new(&vehicle, [Variation::default(); BATCH]);
    let (start, _, disturbance) = flights();
    for (beyond, end) in [(1e9, vehicle.rotor_speed_max), (-5.0, 0.0)] {
        let (mut a, mut b) = (start, start);
        plant.step(&mut a, &[[beyond; BATCH]; 4], &disturbance, 0.002);
        plant.step(&mut b, &[[end; BATCH]; 4], &disturbance, 0.002);
        assert_eq!(a, b);
    }
}

#[test]
fn quaternions_stay_normalised_and_a_torque_free_body_keeps_its_momentum() {
    // Rotors and air switched off: only Euler's equations are left, on a body with three different principal moments.
    let mut vehicle = Vehicle::named("crazyflie-brushless").unwrap();
    vehicle.rotor_drag = 0.0;
    vehicle.inflow_drag = 0.0;
    vehicle.translational_lift = 0.0;
    let plant = Plant::new(&vehicle, [Variation::default(); BATCH]);
    let state = State { body_rates: [3.0, 0.1, 2.0], ..State::at_rest([0.0; 3]) };
    let mut states = States::splat(&state);
    let momentum = |state: &State| {
        let inertia = vehicle.inertia.matrix();
        let body = inertia * nalgebra::Vector3::from(state.body_rates);
        Rotation::new(&state.attitude).to_world(&body.into())
    };
    let before = momentum(&states.member(0));
    for _ in 0..5000 {
        plant.step(&mut states, &[[0.0; BATCH]; 4], &Disturbance::default(), 0.002);
    }
    let after = states.member(0);
    let length: f64 = after.attitude.iter().map(|value| value * value).sum();
    assert!((length - 1.0).abs() < 1e-15 * 4.0);
    for (a, b) in momentum(&after).iter().zip(before) {
        assert!((a - b).abs() < 1e-8 * 1e-4, "{a} {b}");
    }
}
