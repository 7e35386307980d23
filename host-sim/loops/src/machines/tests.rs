//! Each machine from its logs to a model, which flies motions that nobody trained on.

use impromptu_firmware::{Lanes, model::LargestModel};

use super::{Machine, flown, logged, motion};
use crate::{
    age::estimated,
    prepared::time_constant_s,
    reading::AxisLog,
    training::{Settings, Trained, train},
};

/// Logs of a machine: three of its motions, a minute each, with dither.
fn logs(machine: Machine) -> Vec<Vec<AxisLog>> {
    (0..4).map(|seed| logged(machine, &motion(machine, 60.0, 100 + seed), true, 200 + seed)).collect()
}

fn trained(machine: Machine, logs: &[Vec<AxisLog>], axes: &[&str]) -> Trained {
    let settings = Settings {
        age_s: 0.005,
        seed: 1,
        name: machine.name().into(),
        known: None,
        axes: axes.iter().map(|axis| (*axis).to_owned()).collect(),
        draws: 2,
        force: false,
    };
    train(&machine.description(), logs, &settings).unwrap()
}

/// Mean and worst reduction over unseen motions, %, of the whole distance.
fn reductions(machine: Machine, model: &[u8], lanes: Lanes, motions: u64) -> [f64; 2] {
    let model = LargestModel::sized(model).unwrap();
    let found: Vec<f64> = (0..motions)
        .map(|seed| {
            let desired = motion(machine, 20.0, 900 + seed);
            let distance = |errors: Vec<f64>| errors.iter().map(|error| error * error).sum::<f64>().sqrt();
            let baseline = distance(flown(machine, &desired, None, seed).unwrap());
            100.0 * (1.0 - distance(flown(machine, &desired, Some((&model, lanes)), seed).unwrap()) / baseline)
        })
        .collect();
    [found.iter().sum::<f64>() / found.len() as f64, found.iter().copied().fold(f64::INFINITY, f64::min)]
}

/// Least mean and worst reduction, %, by the network lane and by both.
fn asked(machine: Machine) -> [[f64; 2]; 2] {
    match machine {
        Machine::Servo => [[92.0, 88.0], [98.0, 97.0]],
        Machine::Gantry => [[96.0, 95.0], [98.0, 97.0]],
        Machine::Gimbal => [[95.0, 94.0], [99.0, 98.0]],
        Machine::Arm => [[77.0, 74.0], [96.0, 93.0]],
        Machine::Drawn(_) => [[0.0; 2]; 2],
    }
}

#[test]
fn machines_are_trained_from_their_logs_and_flown() {
    for machine in Machine::ALL {
        let trained = trained(machine, &logs(machine), &[]);
        let network = Lanes { network: true, feedback: false };
        for (lanes, [mean, worst]) in [network, Lanes::BOTH].into_iter().zip(asked(machine)) {
            let found = reductions(machine, &trained.model, lanes, 5);
            assert!(found[0] >= mean && found[1] >= worst, "{machine:?} {lanes:?}: {found:.1?}");
        }
        assert!(trained.axes.iter().all(|fit| fit.lane.is_some()), "{machine:?}");
        assert!(trained.description.monitor.is_some() && (3.9..4.1).contains(&trained.minutes), "{}", trained.minutes);
    }
}

#[test]
fn logs_without_dither_give_the_network_lane_alone_and_say_why() {
    let logs: Vec<_> =
        (0..4).map(|seed| logged(Machine::Servo, &motion(Machine::Servo, 60.0, 100 + seed), false, seed)).collect();
    let trained = trained(Machine::Servo, &logs, &[]);
    let fit = &trained.axes[0];
    assert!(fit.refusal.as_deref().is_some_and(|why| why.contains("add a dither")), "{fit:?}");
    assert!(trained.description.feedback_lane.is_none() && trained.description.monitor.is_none());
    let found = reductions(Machine::Servo, &trained.model, Lanes::BOTH, 5);
    assert!(found[0] > 88.0, "{found:.1?}");
}

#[test]
fn the_age_of_what_a_machine_measures_is_found() {
    for machine in Machine::ALL {
        let logs = logs(machine);
        let first: Vec<&AxisLog> = logs.iter().map(|axes| &axes[0]).collect();
        let signals: Vec<_> =
            first.iter().map(|log| (&log.signals, machine.description().axes[0].fresh.clone().unwrap().kind)).collect();
        let found = estimated(&signals, first[0].rate_hz, time_constant_s(&first).unwrap());
        assert!(found.is_some_and(|age| (age.seconds - 0.005).abs() < 0.006), "{found:?}");
    }
}

#[test]
fn one_axis_is_trained_and_the_others_are_left_alone() {
    let trained = trained(Machine::Gantry, &logs(Machine::Gantry), &["y"]);
    assert_eq!((trained.axes.len(), trained.description.outputs.len(), trained.description.outputs[0].channel), (1, 1, 1));
    let model = LargestModel::sized(&trained.model).unwrap();
    let desired = motion(Machine::Gantry, 20.0, 5);
    let [alone, with] = [None, Some((&model, Lanes::BOTH))].map(|model| flown(Machine::Gantry, &desired, model, 5).unwrap());
    assert!(with[1] < 0.3 * alone[1] && (with[0] - alone[0]).abs() < 0.05 * alone[0], "{alone:?} {with:?}");
}

/// What was predicted of drawn machines, [mean, low, high], and the mean of what was flown, %; machines whose model runs at a
/// divided rate, which only an application can fly, are left out.
fn predicted_and_flown(seeds: std::ops::Range<u64>) -> Vec<(u64, [f64; 3], f64)> {
    seeds
        .filter_map(|seed| {
            let machine = Machine::Drawn(seed);
            let plant = machine.plant();
            let time = 1.0 / plant.frequency;
            let log = |log| logged(machine, &motion(machine, 300.0 * time, 100 * seed + log), true, 200 * seed + log);
            let logs: Vec<Vec<AxisLog>> = (0..4).map(log).collect();
            let settings = Settings {
                age_s: plant.age_s,
                seed,
                name: machine.name().into(),
                known: None,
                axes: Vec::new(),
                draws: 4,
                force: true,
            };
            let trained = train(&machine.description(), &logs, &settings).unwrap();
            if trained.divisor != 1 {
                return None;
            }
            let model = LargestModel::sized(&trained.model).unwrap();
            let flights = (0..6).map(|flight| {
                let desired = motion(machine, 150.0 * time, 900_000 + 10 * seed + flight);
                let alone = flown(machine, &desired, None, flight).unwrap()[0];
                100.0 * (1.0 - flown(machine, &desired, Some((&model, Lanes::BOTH)), flight).unwrap()[0] / alone)
            });
            Some((seed, trained.axes[0].reduction_percent, flights.sum::<f64>() / 6.0))
        })
        .collect()
}

/// How many are within their limits, of how many, and the median width of these, points.
fn covered(found: &[(u64, [f64; 3], f64)]) -> (usize, usize, f64) {
    let outside: Vec<_> = found.iter().filter(|(_, [_, low, high], flown)| !(low..=high).contains(&flown)).collect();
    let mut widths: Vec<f64> = found.iter().map(|(_, [_, low, high], _)| high - low).collect();
    widths.sort_by(f64::total_cmp);
    println!("outside: {outside:.1?}; median width {:.1}", widths[widths.len() / 2]);
    (found.len() - outside.len(), found.len(), widths[widths.len() / 2])
}

#[test]
fn predicted_limits_contain_what_is_flown() {
    let (inside, of, width) = covered(&predicted_and_flown(1..11));
    assert!(inside + 1 >= of && of >= 9 && width < 40.0, "{inside} of {of}, {width:.1}");
}

#[test]
#[ignore = "minutes: a hundred loops, of which the second half decided nothing"]
fn long_predicted_limits_contain_what_is_flown() {
    for seeds in [61..101, 1..61] {
        let (inside, of, width) = covered(&predicted_and_flown(seeds.clone()));
        println!("{seeds:?}: {inside} of {of}");
        assert!(inside as f64 >= 0.93 * of as f64 && width < 40.0, "{inside} of {of}, {width:.1}");
    }
}
