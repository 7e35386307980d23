use impromptu_diagnosis::{Settings, add_on::AddOn, assess, diagnose, prediction::root_mean_square, properties::Interval};
use impromptu_sim::trajectory::Trajectory;

use super::*;

/// The trajectory that the add-on makes of a desired one, axis by axis: its taps lie `divisor` ticks apart, at every tick anew.
fn adapted(desired: &Trajectory, add_ons: &[(AddOn, usize); 3]) -> Trajectory {
    let mut samples = desired.samples.clone();
    for (axis, (add_on, divisor)) in add_ons.iter().enumerate() {
        for phase in 0..*divisor {
            let wanted: Vec<f64> = desired.samples.iter().skip(phase).step_by(*divisor).map(|at| at.position[axis]).collect();
            let places = samples.iter_mut().skip(phase).step_by(*divisor);
            places.zip(add_on.references(&wanted)).for_each(|(sample, reference)| sample.position[axis] = reference);
        }
        let positions: Vec<f64> = samples.iter().map(|sample| sample.position[axis]).collect();
        let last = positions.len() - 1;
        for (tick, sample) in samples.iter_mut().enumerate() {
            let (before, after) = (tick.saturating_sub(1), (tick + 1).min(last));
            sample.velocity[axis] = (positions[after] - positions[before]) * desired.rate_hz / (after - before) as f64;
        }
    }
    Trajectory { samples, ..desired.clone() }
}

/// The prediction is about a linear window that was trained on the test's logs: here it is, and it flies other tones on the
/// vehicle itself. 95 % are promised; what was chosen was chosen on other seeds.
#[test]
fn what_is_predicted_for_a_vehicle_is_what_it_then_flies() {
    let flown: Vec<(Interval, f64)> =
        [("crazyflie", "lab", 11), ("crazyflie", "clean", 12), ("crazyflie-brushless", "rough", 13)]
            .into_iter()
            .flat_map(|(vehicle, condition, seed)| predicted_and_flown(vehicle, condition, seed))
            .collect();
    let covered = flown.iter().filter(|(predicted, measured)| predicted.contains(*measured)).count();
    assert!(covered + 1 >= flown.len(), "{covered} of {}: {flown:#?}", flown.len());
    assert!(flown.iter().all(|(predicted, _)| predicted.high - predicted.low < 40.0), "{flown:#?}");
}

/// Predicted and flown reduction, %, axis by axis.
fn predicted_and_flown(vehicle: &str, condition: &str, seed: u64) -> [(Interval, f64); 3] {
    let closed_loop = closed_loop(vehicle, "stock", condition).unwrap();
    let age_s = closed_loop.condition.measurement_delay_s;
    let recipe = Recipe::long();
    let logs = Test::Multisine.fly(&closed_loop, &recipe, 100 * seed).unwrap();
    let settings = Settings { seed, ..Settings::default() };
    let records: [Record; 3] = std::array::from_fn(|axis| of_logs(&logs, axis, age_s).unwrap());
    let found = records.each_ref().map(|record| diagnose(record, &settings).unwrap());
    let add_ons: [(AddOn, usize); 3] = std::array::from_fn(|axis| {
        let (prediction, record) = (&found[axis].prediction, assess(&records[axis], &settings).unwrap().record);
        let add_on = AddOn::fit(&record.segments, prediction.window, prediction.features).unwrap();
        (add_on, (found[axis].rate_hz / found[axis].sub_rate_hz).round() as usize)
    });
    let flight_set = FlightSet { flights: 3, seconds: SECONDS, ..recipe.lane.dithered_flights };
    let desired: Vec<Trajectory> =
        flight_set.motions(9000 * seed).iter().map(|motion| motion.sampled(closed_loop.rate_hz()).unwrap()).collect();
    let errors = |with: bool| -> [f64; 3] {
        let flown: Vec<Trajectory> =
            desired.iter().map(|desired| if with { adapted(desired, &add_ons) } else { desired.clone() }).collect();
        let plan = |(trajectory, seed)| FlightPlan { log: true, ..FlightPlan::new(trajectory, seed) };
        let plans: Vec<FlightPlan<'_>> = flown.iter().zip(7000 * seed..).map(plan).collect();
        let mut logs: Vec<FlightLog> = closed_loop.fly(&plans).unwrap().into_iter().filter_map(|record| record.log).collect();
        for (log, desired) in logs.iter_mut().zip(&desired) {
            log.rows.iter_mut().enumerate().for_each(|(tick, row)| row.desired = desired.sample_at(tick as i64));
        }
        std::array::from_fn(|axis| {
            let record = of_logs(&logs, axis, age_s).unwrap().slower(add_ons[axis].1);
            root_mean_square(record.segments.iter().flat_map(|segment| {
                let errors = segment.reference.iter().zip(&segment.measured).map(|(desired, measured)| desired - measured);
                errors.skip(40).collect::<Vec<_>>()
            }))
        })
    };
    let (without, with) = (errors(false), errors(true));
    std::array::from_fn(|axis| (found[axis].prediction.reduction_percent, 100.0 * (1.0 - with[axis] / without[axis])))
}
