//! Every entry of the flight stack under any numbers.
//!
//! *in* states, setpoints and settings, some of which no vehicle has; *out* the same flight without them; *never* a number that
//! is not finite; *source* proptest's draws.

use nalgebra::{Quaternion, UnitQuaternion};
use proptest::prelude::*;

use super::*;
use crate::{
    course::{Course, Now, Refusal},
    settings::tests::{GOOD, numbers},
    types::Setpoint,
};

/// A number of any kind, in most draws a vehicle's.
fn number() -> impl Strategy<Value = f32> {
    prop_oneof![
        12 => -3.0f32..3.0,
        1 => any::<u32>().prop_map(f32::from_bits),
        1 => prop::sample::select(vec![f32::MAX, f32::MIN, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e-44, 3.3e38, -3.3e38]),
    ]
}

fn vector() -> impl Strategy<Value = Vector3<f32>> {
    prop::array::uniform3(number()).prop_map(Vector3::from)
}

prop_compose! {
    fn state()(position in vector(), velocity in vector(), rates in vector(), rise in number(), scale in number()) -> State {
        // Of unit length in most draws.
        let w = if scale.abs() < 2.9 { 0.6 } else { scale };
        let attitude = UnitQuaternion::new_unchecked(Quaternion::new(w, 0.8, 0.0, 0.0));
        State { position, velocity, attitude, rates, vertical_acceleration: rise }
    }
}

prop_compose! {
    fn setpoint()(position in vector(), velocity in vector(), acceleration in vector(), yaw in number()) -> Setpoint {
        Setpoint { position, velocity, acceleration, yaw }
    }
}

fn integrating() -> Settings {
    let mut settings = GOOD;
    (settings.position.ki, settings.position.integral_limit) = ([1.0; 3], 1.0);
    settings
}

/// The answers of a flight: motors and reference, as bits.
fn answer(flight: &mut Flight<'_>, tick: u32, state: &State) -> Vec<u32> {
    let (command, _) = flight.control(Tick(tick), state);
    let Reference { position, velocity, yaw } = *flight.reference();
    let numbers = command.fractions().into_iter().chain(position.iter().copied()).chain(velocity.iter().copied()).chain([yaw]);
    numbers.map(f32::to_bits).collect()
}

#[test]
fn huge_numbers_of_both_signs_in_one_tick_are_a_missed_sample() {
    let level = State { position: Vector3::new(0.0, 0.0, 1.5), ..State::ORIGIN };
    let hover = Setpoint { position: level.position, ..Setpoint::ORIGIN };
    let (mut flight, mut other) = (Flight::new(&integrating()).unwrap(), Flight::new(&integrating()).unwrap());
    for tick in 0..190 {
        if tick == 20 {
            assert!(!flight.push_setpoint(&Setpoint { position: Vector3::new(3.3e38, 0.0, 1.5), ..hover }));
        }
        assert!(flight.push_setpoint(&hover) && other.push_setpoint(&hover));
    }
    for tick in 0..400 {
        let far = State { position: Vector3::new(-3.3e38, 0.0, 1.5), ..level };
        let found = answer(&mut flight, tick, if tick == 100 { &far } else { &level });
        assert_eq!(found, answer(&mut other, tick, &level), "tick {tick}");
    }
}

proptest! {
    #[test]
    fn what_no_vehicle_has_changes_nothing(
        ticks in prop::collection::vec((state(), setpoint(), vector()), 1..60), index in 0usize..32, bad in number()
    ) {
        let (mut told, mut other) = (Flight::new(&integrating()).unwrap(), Flight::new(&integrating()).unwrap());
        let mut known = None;
        for (tick, (state, setpoint, dither)) in ticks.iter().enumerate() {
            let before = told.next_setpoint();
            let taken = told.push_setpoint(setpoint);
            prop_assert_eq!((taken, told.next_setpoint()), (setpoint.is_physical(), before + i32::from(taken)));
            if taken {
                other.push_setpoint(setpoint);
            }
            told.set_dither(*dither);
            if dither.iter().all(|x| x.abs() <= POSITION_LIMIT) {
                other.set_dither(*dither);
            }
            if state.is_physical() {
                known = Some(*state);
            }
            let found = answer(&mut told, tick as u32, state);
            prop_assert!(found.iter().all(|bits| f32::from_bits(*bits).is_finite()), "{:?}", told.reference());
            match known {
                Some(known) => prop_assert_eq!(found, answer(&mut other, tick as u32, &known)),
                None => prop_assert_eq!(&found[..4], &[0; 4], "motors off before there is a state"),
            }
            let mut settings = GOOD;
            *numbers(&mut settings)[index] = bad;
            if settings.check().is_err() {
                prop_assert!(!told.configure(&settings), "and the flight goes on");
            }
        }
    }

    #[test]
    fn halves_of_a_tick_are_as_careful(state in state(), setpoint in setpoint(), force in vector(), far in any::<i32>()) {
        let mut flight = Flight::new(&integrating()).unwrap();
        flight.push_setpoint(&setpoint);
        let (wanted, _) = flight.position_step(Tick(0), &state, &mut Job { ..Job::EMPTY }, |_| ());
        prop_assert_eq!(wanted.is_some(), state.is_physical());
        if let Some(wanted) = wanted {
            prop_assert!(wanted.force.iter().chain(wanted.attitude.iter()).all(|x| x.is_finite()));
        }
        let command = flight.attitude_step(&ThrustVector { force, ..ThrustVector::NONE }, &state);
        prop_assert!(command.fractions().iter().all(|x| (0.0..=1.0).contains(x)));
        // Trajectories may be cut and asked for anywhere.
        flight.replace_setpoints(far);
        let Setpoint { position, yaw, .. } = flight.setpoint(far);
        prop_assert!(position.iter().chain([&yaw]).all(|x| x.is_finite()));
    }

    #[test]
    fn what_is_replaced_leaves_what_was_before_it(count in 1i32..190, from in 1i32..200) {
        let at = |tick: i32| Setpoint { position: Vector3::new(tick as f32, 0.0, 1.0), ..Setpoint::ORIGIN };
        let mut flight = Flight::new(&GOOD).unwrap();
        (0..count).for_each(|tick| assert!(flight.push_setpoint(&at(tick))));
        flight.replace_setpoints(from);
        let kept = from.min(count);
        prop_assert_eq!(flight.next_setpoint(), kept);
        for tick in (kept - 30).max(0)..kept {
            prop_assert_eq!(flight.setpoint(tick), at(tick));
        }
    }

    /// Who pushes as many as are taken finds the present, and of a course 32 more ticks that a learner looks back at.
    #[test]
    fn what_is_to_be_flown_is_never_pushed_out(burst in 1usize..400, ticks in 1i32..300, directly in any::<bool>()) {
        let at = |tick: i32| Setpoint { position: Vector3::new(0.01 * tick as f32, 0.0, 1.0), ..Setpoint::ORIGIN };
        let (mut flight, mut course) = (Flight::new(&GOOD).unwrap(), Course::NONE);
        let every = GOOD.rates.position_divisor;
        for tick in 0..ticks {
            let now = Now { tick, flown: (tick > 0).then(|| tick - 1), period: 0.01 };
            for _ in 0..burst {
                let next = flight.next_setpoint();
                let taken = if directly {
                    flight.push_setpoint(&at(next))
                } else {
                    match course.append(&mut flight, &now, &at(next)) {
                        Ok(()) => true,
                        Err(Refusal::Full { expected }) => {
                            prop_assert_eq!(expected, next);
                            false
                        }
                        Err(other) => panic!("{other:?}"),
                    }
                };
                prop_assert_eq!(flight.next_setpoint(), next + i32::from(taken));
            }
            let behind = if directly { 0 } else { 32 };
            for flown in (tick - behind).max(0)..=tick.min(flight.next_setpoint() - 1) {
                prop_assert_eq!(flight.setpoint(flown), at(flown));
            }
            flight.control(Tick(tick as u32 * every), &State::ORIGIN);
        }
    }
}
