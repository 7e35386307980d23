//! Each machine from its logs to a model, which flies motions that nobody trained on.

use impromptu_firmware::{Lanes, model::Model};

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
    let model = Model::from_bytes(model).unwrap();
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

#[test]
fn machines_are_trained_from_their_logs_and_flown() {
    for machine in Machine::ALL {
        let trained = trained(machine, &logs(machine), &[]);
        let network = reductions(machine, &trained.model, Lanes { network: true, feedback: false }, 5);
        let both = reductions(machine, &trained.model, Lanes::BOTH, 5);
        for axis in &trained.axes {
            eprintln!("{} {axis:?}", machine.name());
        }
        eprintln!("{}: {network:.1?} {both:.1?} {} bytes {:?}", machine.name(), trained.model.len(), trained.notes);
    }
}

#[test]
fn the_age_of_what_a_machine_measures_is_found() {
    for machine in Machine::ALL {
        let logs = logs(machine);
        let first: Vec<&AxisLog> = logs.iter().map(|axes| &axes[0]).collect();
        let signals: Vec<_> =
            first.iter().map(|log| (&log.signals, machine.description().axes[0].fresh.clone().unwrap().kind)).collect();
        let found = estimated(&signals, first[0].rate_hz, time_constant_s(&first).unwrap());
        eprintln!("{}: {found:?}", machine.name());
        assert!(found.is_some_and(|age| (age.seconds - 0.005).abs() < 0.006), "{found:?}");
    }
}

#[test]
fn one_axis_is_trained_and_the_others_are_left_alone() {
    let trained = trained(Machine::Gantry, &logs(Machine::Gantry), &["y"]);
    assert_eq!((trained.axes.len(), trained.description.outputs.len(), trained.description.outputs[0].channel), (1, 1, 1));
    let model = Model::from_bytes(&trained.model).unwrap();
    let desired = motion(Machine::Gantry, 20.0, 5);
    let [alone, with] = [None, Some((&model, Lanes::BOTH))].map(|model| flown(Machine::Gantry, &desired, model, 5).unwrap());
    assert!(with[1] < 0.3 * alone[1] && (with[0] - alone[0]).abs() < 0.05 * alone[0], "{alone:?} {with:?}");
}
