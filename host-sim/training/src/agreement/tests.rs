//! Every loop is told from the others, and none from itself.

use impromptu_sim::{controller::Controller, plant::Vehicle, rollout::Dither};
use proptest::prelude::*;

use super::*;
use crate::{FlightSet, Recipe, Signal};

fn closed_loop(vehicle: &str, gains: &str, condition: &str, controller: Controller) -> Loop {
    let condition = Condition::named(condition).unwrap();
    Loop::new(Vehicle::named(vehicle).unwrap(), gains, condition).unwrap().flown_by(controller).unwrap()
}

/// Logs of a loop whose thrust differs.
fn logs(flown: &Loop, thrust_factor: f64, set: FlightSet, dither: bool, seed: u64) -> Vec<FlightLog> {
    let motions = set.motions(seed);
    let trajectories: Vec<Trajectory> = motions.iter().map(|motion| motion.sampled(flown.rate_hz()).unwrap()).collect();
    let plans: Vec<FlightPlan<'_>> = trajectories
        .iter()
        .zip(seed..)
        .map(|(trajectory, seed)| FlightPlan {
            dither: dither.then_some(Dither { amplitude: 0.01, hold_s: 0.05 }),
            variation: Variation { thrust_factor, ..Variation::default() },
            log: true,
            ..FlightPlan::new(trajectory, seed)
        })
        .collect();
    flown.fly(&plans).unwrap().into_iter().filter_map(|record| record.log).collect()
}

const SE3: Controller = Controller::Se3;
const MELLINGER: [Controller; 2] = [Controller::Mellinger { feed_forward: false }, Controller::Mellinger { feed_forward: true }];

/// A loop that flew, one that is given, the thrust of the first, whether they are the same.
type Case = (Loop, Loop, f64, bool);

fn cases(conditions: &[&str], thrusts: &[f64]) -> Vec<Case> {
    let mut cases = Vec::new();
    for condition in conditions {
        let of = |vehicle: &str, gains: &str, controller| closed_loop(vehicle, gains, condition, controller);
        let vehicles = ["crazyflie", "crazyflie-brushless", "hummingbird"];
        for vehicle in vehicles {
            let right = of(vehicle, "stock", SE3);
            for thrust in thrusts {
                cases.push((right.clone(), right.clone(), *thrust, true));
                cases.push((right.delayed(0.02), right.clone(), *thrust, false));
                cases.push((right.clone(), right.delayed(0.02), *thrust, false));
            }
            cases.push((of(vehicle, "soft", SE3), right.clone(), 1.0, false));
            cases.push((right.clone(), of(vehicle, "soft", SE3), 1.0, false));
            cases.extend(
                vehicles
                    .iter()
                    .filter(|other| **other != vehicle)
                    .map(|other| (right.clone(), of(other, "stock", SE3), 1.0, false)),
            );
        }
        let controllers = [SE3, Controller::Pid, MELLINGER[0], MELLINGER[1]];
        for controller in controllers {
            let right = of("crazyflie", "stock", controller);
            for thrust in thrusts.iter().filter(|_| controller != SE3) {
                cases.push((right.clone(), right.clone(), *thrust, true));
                cases.push((right.delayed(0.02), right.clone(), *thrust, false));
            }
            cases.extend(
                controllers
                    .iter()
                    .filter(|other| **other != controller)
                    .map(|other| (right.clone(), of("crazyflie", "stock", *other), 1.0, false)),
            );
        }
    }
    cases
}

/// Flights of three minutes at most.
fn sets() -> [(FlightSet, bool); 2] {
    let usual = Recipe::default().lane.dithered_flights;
    let speed = |signal, flights, max_speed| FlightSet { signal, flights, max_speed, seconds: 45.0, ..usual };
    [(speed(Signal::Multisine, 4, usual.max_speed), true), (speed(Signal::Strokes, 12, 1.0), false)]
}

/// Whether every case is judged as it is; how close it was.
fn all_judged(cases: &[Case], seeds: std::ops::Range<u64>, print: bool) -> Vec<String> {
    let mut wrong = Vec::new();
    for (flown, given, thrust, same) in cases {
        for (set, dither) in sets() {
            // The multisine is more than Mellinger's loop survives.
            if set.signal == Signal::Multisine && MELLINGER.contains(&flown.controller) {
                continue;
            }
            for seed in seeds.clone() {
                let logs = logs(flown, *thrust, set, dither, seed);
                let found = agreement(given, &logs.iter().collect::<Vec<_>>()).unwrap();
                let refused = found.disagreement(given);
                let words = format!(
                    "{} {} {} {} x{thrust} given {} {} {} {} {:?}: d {:+.1}±{:.1} ms f {:+.1}±{:.1} % shares {:.3?}±{:.3?} {}",
                    flown.vehicle.name,
                    flown.gains,
                    flown.controller.name(),
                    flown.condition.name,
                    given.vehicle.name,
                    given.gains,
                    given.controller.name(),
                    given.condition.name,
                    set.signal,
                    1e3 * found.delay_s.value,
                    1e3 * found.delay_s.error,
                    1e2 * found.thrust.value,
                    1e2 * found.thrust.error,
                    found.shares_squared.map(|figure| figure.value.max(0.0).sqrt()),
                    found.shares_squared.map(|figure| figure.error),
                    refused.as_ref().map_or(String::new(), ToString::to_string)
                );
                if print {
                    println!("{}{words}", if refused.is_none() == *same { "" } else { "WRONG " });
                }
                if refused.is_none() != *same {
                    wrong.push(words);
                }
            }
        }
    }
    wrong
}

#[test]
#[ignore = "minutes: every vehicle, gains, controller and condition"]
fn long_loops_are_told_from_each_other_in_every_condition() {
    let wrong = all_judged(&cases(&Condition::NAMES, &[0.9, 1.0, 1.1]), 1..2, true);
    assert!(wrong.is_empty(), "{wrong:#?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    /// One drawn case of all, with any thrust that a battery leaves.
    #[test]
    fn a_loop_is_told_from_another_one_and_not_from_itself(
        condition in prop::sample::select(&Condition::NAMES[..]),
        which in any::<prop::sample::Index>(),
        thrust in 0.9f64..1.1,
        seed in 1u64..1_000_000,
    ) {
        let cases = cases(&[condition], &[thrust]);
        let wrong = all_judged(&[cases[which.index(cases.len())].clone()], seed..seed + 1, false);
        prop_assert!(wrong.is_empty(), "{wrong:#?}");
    }
}
