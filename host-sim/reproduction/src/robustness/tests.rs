//! The whole study with a small recipe; a Monte Carlo run that is cut, shared out and merged.

use std::path::{Path, PathBuf};

use impromptu_firmware::model::Model;
use impromptu_report::render_study;
use impromptu_sim::{condition::Condition, flights::Loop, plant::Vehicle};
use impromptu_training::{
    FlightSet, LaneRecipe, Recipe, Rows, describe, feedforward, observer::Observer, supervised::TrainingSettings,
};

use super::{
    CASES, DEVIATIONS, PARAMETERS, Settings, WINDS,
    control_weight::CONTROL_WEIGHTS,
    draw::{DrawSettings, Ranges},
    draws::fly_draws,
    handover::KINDS,
    ledger::{Header, LedgerError, Shard, merge},
    run,
};
use crate::checks::assert_readable;

struct Silent;

impl Observer for Silent {
    fn stage(&self, _: &str) {}
    fn steps(&self, _: u64, _: u64) {}
}

/// Few flights, few epochs, one lane to choose from.
fn small() -> Recipe {
    let full = Recipe::long();
    Recipe {
        training_flights: full.training_flights.iter().map(|of| FlightSet { flights: 30, ..*of }).collect(),
        network: TrainingSettings { epochs: 8, ..full.network },
        weight_decays: vec![0.03],
        shares: vec![1.0],
        fine_tuning: TrainingSettings { epochs: 1, ..full.fine_tuning },
        lane: LaneRecipe { control_weights: vec![6e-3], velocity_weights: vec![0.05], fast_limits: vec![0.1], ..full.lane },
        validation_strokes: 4,
        ..full
    }
}

#[test]
fn the_study_tells_every_case_deviation_vehicle_and_control_weight() {
    let folder = tempfile::tempdir().unwrap();
    let settings = Settings {
        seed: 1,
        loops: vec![lab()],
        strokes: 6,
        draws: 3,
        draw_strokes: 2,
        guard_flights: 4,
        ranges: Ranges::default(),
        recipe: small(),
        out: folder.path().to_owned(),
    };
    let study = run(&settings, "host-sim study robustness", &Silent).unwrap();
    let value = |name: &str| {
        let name = format!("crazyflie_stock_lab_{name}");
        study.value(&name).unwrap_or_else(|| panic!("no number {name}"))
    };
    assert_readable(&study);
    let curves = |name: &str| {
        let name = format!("crazyflie_stock_lab_{name}");
        let figure = study.figures.iter().find(|figure| figure.name == name).unwrap_or_else(|| panic!("no figure {name}"));
        &figure.curves
    };

    // Whatever is off, the lanes help, and the feedback lane sees what the network cannot.
    let cases = CASES.iter().map(|case| case.name).chain(["nominal", "delay_plus_20_ms"]).map(str::to_owned);
    let deviations = PARAMETERS.iter().flat_map(|of| ["minus_30", "plus_30"].map(|by| format!("{}_{by}", of.name)));
    for case in cases.chain(deviations) {
        let (both, network) = (value(&format!("{case}_both_mean")), value(&format!("{case}_network_mean")));
        assert!(both > 0.0 && both > network, "{case}: {both} {network}");
    }
    for way in ["both", "network"] {
        let nominal = value(&format!("nominal_{way}_mean"));
        let curves = curves(&format!("deviations_{way}"));
        assert_eq!(curves.len(), PARAMETERS.len());
        for curve in curves {
            assert_eq!(curve.points.len(), DEVIATIONS.len());
            assert!(curve.points.contains(&(0.0, nominal)), "{}: {:?}, nominal {nominal}", curve.label, curve.points);
        }
    }
    assert!(curves("wind").iter().all(|curve| curve.points.len() == WINDS.len()));
    curves("draws");

    // The guard leaves what is healthy alone, and trips where positions are frozen.
    let trips = |kind: &str| value(&format!("guard_{kind}_network_trips")) + value(&format!("guard_{kind}_feedback_trips"));
    assert!(KINDS.iter().all(|kind| value(&format!("guard_{}_flights", kind.name)) == 4.0));
    assert!(trips("nominal") == 0.0 && trips("frozen") > 0.0, "{} {}", trips("nominal"), trips("frozen"));

    // Margins are bought with reduction, and no lane is better than the one that knows everything.
    let figures = ["control_weight", "delay_margin", "modulus_margin", "margins"].map(curves);
    assert!(figures.iter().flat_map(|curves| curves.iter()).all(|curve| !curve.points.is_empty()));
    let at = |control_weight: f64, name: &str| {
        value(&format!("control_weight_{control_weight:.1e}_{name}").replace('.', "_").replace("e-", "e_minus_"))
    };
    for pair in CONTROL_WEIGHTS.windows(2) {
        for margin in ["delay_margin", "gain_margin", "modulus_margin"] {
            assert!(at(pair[0], margin) <= at(pair[1], margin), "{margin} at {pair:?}");
        }
        assert!(at(pair[0], "limit") > at(pair[1], "limit"), "limit at {pair:?}");
    }
    for control_weight in CONTROL_WEIGHTS {
        assert!(at(control_weight, "limit") > at(control_weight, "nominal_mean"), "{control_weight}");
    }
    let [cheap, dear] =
        [CONTROL_WEIGHTS[2], CONTROL_WEIGHTS[CONTROL_WEIGHTS.len() - 1]].map(|control_weight| at(control_weight, "nominal_mean"));
    assert!(cheap > dear, "{cheap} {dear}");
    assert!(render_study(&study).unwrap().contains("What robustness costs"));
}

/// A model that needs no training: flatness feed-forward.
fn model(closed_loop: &Loop) -> Vec<u8> {
    let rows = Rows { calibration: Vec::new(), envelope: Vec::new(), label_range: [1.0; 6], data_crc: 0, count: 0 };
    let description = describe(&Recipe::long(), closed_loop, &rows, None, "flatness", "", 1);
    feedforward(&closed_loop.settings, description).unwrap()
}

fn lab() -> Loop {
    Loop::new(Vehicle::named("crazyflie").unwrap(), "stock", Condition::named("lab").unwrap()).unwrap()
}

/// Flies a shard of seven draws into a file.
fn fly(folder: &Path, name: &str, seed: u64, shard: Shard) -> Result<PathBuf, String> {
    let closed_loop = lab();
    let bytes = model(&closed_loop);
    let model = Model::from_bytes(&bytes).unwrap();
    let settings = DrawSettings::new(&closed_loop, &model, seed, 7, 2, Ranges::default());
    let path = folder.join(name);
    match fly_draws(&Header { settings, shard }, &closed_loop, &model, &path, &|_, _| {}) {
        Ok(_) => Ok(path),
        Err(error) => Err(error.to_string()),
    }
}

fn shards(folder: &Path, of: u32) -> Vec<PathBuf> {
    (1..=of).map(|part| fly(folder, &format!("{part}-of-{of}"), 1, Shard { part, of }).unwrap()).collect()
}

#[test]
fn merged_shards_are_the_single_run_byte_by_byte_in_any_order() {
    let folder = tempfile::tempdir().unwrap();
    let single = std::fs::read(fly(folder.path(), "single", 1, Shard::WHOLE).unwrap()).unwrap();
    let mut files = shards(folder.path(), 3);
    files.reverse();
    let (merged, content) = merge(&files).unwrap();
    assert!(merged == single);
    assert_eq!(content.draws.len(), 7);
    // On one thread too.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let alone = pool.install(|| fly(folder.path(), "alone", 1, Shard::WHOLE)).unwrap();
    assert!(std::fs::read(alone).unwrap() == single);
}

#[test]
fn a_run_that_was_cut_anywhere_goes_on_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = fly(folder.path(), "whole", 1, Shard::WHOLE).unwrap();
    let whole = std::fs::read(&path).unwrap();
    let header = whole.iter().position(|&byte| byte == b'\n').unwrap() + 1;
    for kept in [0, 20, header - 1, header, header + 30, whole.len() - 1] {
        std::fs::write(&path, &whole[..kept]).unwrap();
        fly(folder.path(), "whole", 1, Shard::WHOLE).unwrap();
        assert!(std::fs::read(&path).unwrap() == whole, "cut after {kept} bytes");
    }
}

#[test]
fn files_of_other_runs_are_refused_by_name_and_left_as_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = fly(folder.path(), "run", 1, Shard::WHOLE).unwrap();
    let before = std::fs::read(&path).unwrap();
    let message = fly(folder.path(), "run", 2, Shard::WHOLE).unwrap_err();
    assert!(message.contains("`seed` is 1 there and 2 here"), "{message}");
    let message = fly(folder.path(), "run", 1, Shard { part: 1, of: 2 }).unwrap_err();
    assert!(message.contains("`shard` is 1/1 there and 1/2 here"), "{message}");
    assert!(std::fs::read(&path).unwrap() == before);

    let foreign = folder.path().join("foreign");
    std::fs::write(&foreign, "my notes\n").unwrap();
    assert!(fly(folder.path(), "foreign", 1, Shard::WHOLE).unwrap_err().contains("line 1"));
    assert_eq!(std::fs::read_to_string(&foreign).unwrap(), "my notes\n");

    // A draw in the middle that is not what was written.
    let text = String::from_utf8(before).unwrap().replacen("\"draw\":2", "\"draw\":9", 1);
    std::fs::write(&path, text).unwrap();
    let message = fly(folder.path(), "run", 1, Shard::WHOLE).unwrap_err();
    assert!(message.contains("line 4: draw 2 is expected, 9 found"), "{message}");
}

#[test]
fn shards_that_do_not_make_one_run_are_not_merged() {
    let folder = tempfile::tempdir().unwrap();
    let files = shards(folder.path(), 3);
    assert!(matches!(merge(&[]), Err(LedgerError::Nothing)));
    let message = merge(&files[..1]).unwrap_err().to_string();
    assert!(message.contains("these are missing: 2, 3"), "{message}");
    let twice = [files[0].clone(), files[1].clone(), files[0].clone()];
    assert!(matches!(merge(&twice), Err(LedgerError::Duplicate { part: 1, .. })));
    let other = fly(folder.path(), "other-seed", 2, Shard { part: 3, of: 3 }).unwrap();
    let message = merge(&[files[0].clone(), files[1].clone(), other]).unwrap_err().to_string();
    assert!(message.contains("`seed` is 2 there and 1 here"), "{message}");
    let other = fly(folder.path(), "other-parts", 1, Shard { part: 3, of: 4 }).unwrap();
    let message = merge(&[files[0].clone(), files[1].clone(), other]).unwrap_err().to_string();
    assert!(message.contains("`shard` is 3/4 there and 3/3 here"), "{message}");

    let bytes = std::fs::read(&files[2]).unwrap();
    std::fs::write(&files[2], &bytes[..bytes.len() - 5]).unwrap();
    let message = merge(&files).unwrap_err().to_string();
    assert!(message.contains("part 3 of 3 holds 1 of its 2 draws") && message.contains("--shard 3/3"), "{message}");
}

/// Every name from a file that becomes a path is a plain file name.
#[test]
fn a_file_whose_loop_leads_out_of_a_folder_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = fly(folder.path(), "run", 1, Shard::WHOLE).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let nominal = "\"nominal\":\"crazyflie stock lab\"";
    assert!(text.contains(nominal));
    for name in ["x/../..", "/etc/x", "..\\\\x", "a\\u001b[2Jb", "a\\nb", &"x".repeat(300)] {
        std::fs::write(&path, text.replace(nominal, &format!("\"nominal\":\"{name}\""))).unwrap();
        let message = merge(std::slice::from_ref(&path)).unwrap_err().to_string();
        assert!(message.contains("line 1: `nominal`: ") && message.contains("no plain file name"), "{name}: {message}");
    }
    std::fs::write(&path, text.replace("\"mass\":[0.95,", "\"mass\":[-1e308,")).unwrap();
    let message = merge(std::slice::from_ref(&path)).unwrap_err().to_string();
    assert!(message.contains("`mass` is [") && message.contains("from 0.1 to 10"), "{message}");
}

#[test]
fn a_shard_is_a_part_of_a_whole() {
    assert_eq!("3/16".parse(), Ok(Shard { part: 3, of: 16 }));
    for text in ["0/16", "17/16", "3", "a/b", "1/0", "1/4000000000"] {
        assert!(text.parse::<Shard>().is_err(), "{text}");
    }
}
