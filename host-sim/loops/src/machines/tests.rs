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
