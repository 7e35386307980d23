//! From flights to a model and back into the air, on files.

use impromptu_firmware::model::Model;
use impromptu_model_export::{Description, FloatNetwork, Precision, encode, rows};

use crate::program::Folder;

/// Logs in `logs`, dithered ones in `dithered`.
fn collected(condition: &str) -> Folder {
    let folder = Folder::new();
    let run =
        folder.fine(&format!("collect --condition {condition} --signal strokes spline --flights 3 --seconds 12 --out logs"));
    assert!(run.stdout.contains("logs/1-strokes-0001.csv") && run.stderr.contains("seed 1"), "{}{}", run.stdout, run.stderr);
    folder.fine(&format!("collect --condition {condition} --dither 0.01 --flights 2 --seconds 45 --out dithered"));
    folder
}

fn train(folder: &Folder, more: &str) -> serde_json::Value {
    let logs = folder.files("logs", ".csv").join(" ");
    folder.fine(&format!("train --log {logs} --recipe recipe.toml --format json {more}")).json()
}

#[test]
fn collect_train_fly_evaluate() {
    let folder = collected("clean");
    let dithered = folder.files("dithered", ".csv").join(" ");
    let flags = format!("--dithered {dithered} --vehicle crazyflie --condition clean --name net");
    let trained = train(&folder, &format!("{flags} --out models"));
    assert!(trained["feedback_lane"].is_string() && trained["refusal"].is_null(), "{trained}");
    assert_eq!(folder.files("models", "").len(), 4);

    // The same seed gives the same bytes, another one others.
    train(&folder, &format!("{flags} --out again"));
    train(&folder, &format!("{flags} --out other --seed 2"));
    for file in ["net.impromptu", "net.safetensors", "net.json", "net.rows.csv"] {
        assert_eq!(folder.read(&format!("models/{file}")), folder.read(&format!("again/{file}")), "{file}");
    }
    assert_ne!(folder.read("models/net.impromptu"), folder.read("other/net.impromptu"));

    // The exporter makes the same model from the float network, its description and the rows.
    let network = FloatNetwork::read(&folder.path("models/net.safetensors")).unwrap();
    let description = Description::from_json(&String::from_utf8(folder.read("models/net.json")).unwrap()).unwrap();
    let rows = rows::read(&folder.path("models/net.rows.csv"), description.features.len()).unwrap();
    let exported = encode(&description, Some(&network), Precision::Int8, &rows).unwrap();
    assert!(exported == folder.read("models/net.impromptu"));
    assert!(folder.read("models/net.rows.csv").starts_with(b"desired.position.x@-"));

    let model = "--model models/net.impromptu --condition clean --format json";
    let flown = folder.fine(&format!("fly {model} --trajectory figure8 --log figure8.csv")).json();
    assert_eq!(flown["flights"][1]["method"], "full_int8");
    assert!(flown["flights"][1]["reduction"].as_f64().unwrap() > 50.0, "{flown}");
    let bypassed = folder.fine(&format!("fly {model} --trajectory figure8 --lanes none")).json();
    assert_eq!(bypassed["flights"][0]["rms_cm"], bypassed["flights"][1]["rms_cm"]);
    // What is written can be learned from.
    assert!(String::from_utf8(folder.read("figure8.csv")).unwrap().starts_with("time_s,desired_x_m"));

    let evaluated = folder.fine(&format!("evaluate {model} --strokes 3 --seed 5")).json();
    let methods: Vec<&str> = evaluated["table"].as_array().unwrap().iter().map(|row| row["method"].as_str().unwrap()).collect();
    assert_eq!(methods, ["baseline", "net_int8", "feedback", "full_int8"]);
    assert!(evaluated["table"][3]["reduction_mean"].as_f64().unwrap() > 50.0, "{evaluated}");
    assert_eq!((evaluated["seed"].as_u64(), evaluated["table"][0]["seed"].as_u64()), (Some(5), Some(5)));

    let whole = folder.read("models/net.impromptu");
    folder.write("short.impromptu", &whole[..whole.len() / 2]);
    let mut bent = whole.clone();
    bent[whole.len() / 2] ^= 4;
    folder.write("bent.impromptu", bent);
    for file in ["short.impromptu", "bent.impromptu"] {
        folder.refused(&format!("fly --trajectory circle --model {file} --log figure8.csv"), &[file, "refused"]);
    }
}

#[test]
fn without_dither_the_model_has_no_feedback_lane_and_says_why() {
    let folder = collected("lab");
    let trained = train(&folder, "--delay-ms 30 --out models");
    assert!(trained["refusal"].as_str().unwrap().contains("add a dither"), "{trained}");
    let bytes = folder.read("models/model.impromptu");
    let model = Model::from_bytes(&bytes).unwrap();
    assert!(model.feedback().is_none() && model.card().provenance.remarks.contains("no feedback lane"));
    assert_eq!(model.card().timing.measurement_delay_ticks, 3.0);

    let trained = train(&folder, "--vehicle crazyflie --out models");
    assert!(trained["refusal"].as_str().unwrap().contains("no independent excitation"), "{trained}");
    let run = folder.fine("fly --model models/model.impromptu --trajectory circle --format json");
    assert_eq!(run.json()["flights"][1]["method"], "net_int8");
    assert!(run.stderr.contains("has no feedback lane"), "{}", run.stderr);
    folder.refused(
        "fly --model models/model.impromptu --trajectory circle --lanes feedback",
        &["model.impromptu", "--lanes network"],
    );
}

#[test]
fn without_a_vehicle_both_lanes_and_the_monitor_come_from_the_logs() {
    let folder = Folder::new();
    folder.fine("collect --condition lab --dither 0.01 --flights 4 --seconds 60 --out dithered");
    let logs = folder.files("dithered", ".csv").join(" ");
    folder.fine("trajectory figure8 --speed 4 --output fast.csv");
    let run = folder.fine(&format!("train --log {logs} --recipe recipe.toml --test figure8 fast.csv --out models --format json"));
    let trained = run.json();
    // Attitude is in the logs, and fresher than the position, which is 24 ms old.
    let age = run.stderr.split("what is measured is ").nth(1).and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    assert!(age.is_some_and(|age| (age - 24.0).abs() <= 6.0), "{}", run.stderr);
    assert!(trained["refusal"].is_null() && (trained["minutes"].as_f64().unwrap() - 4.17).abs() < 0.05, "{trained}");
    // A figure of eight as wide as what was flown, and one that is four times as fast.
    assert!(
        trained["coverage"][0]["handed_over_percent"].as_f64().unwrap()
            < trained["coverage"][1]["handed_over_percent"].as_f64().unwrap()
    );
    let bytes = folder.read("models/model.impromptu");
    let model = Model::from_bytes(&bytes).unwrap();
    assert!(model.card().provenance.remarks.ends_with("4.2 min of flight"), "{}", model.card().provenance.remarks);
    assert!(model.feedback().is_some_and(|lane| lane.axes().len() == 3) && model.monitor().is_some());
    let flown = folder.fine("evaluate --model models/model.impromptu --strokes 5 --seed 3 --format json").json();
    let [network, both] = [1, 3].map(|row: usize| flown["table"][row]["reduction_mean"].as_f64().unwrap());
    assert!(both > 90.0 && both > network, "{flown}");
}

#[test]
fn a_machine_is_logged_trained_and_moved() {
    let folder = Folder::new();
    folder.fine("machine gantry --out gantry");
    let logs = folder.files("gantry", ".csv").join(" ");
    // The drive's acceleration is in the logs: the age of what is measured is found.
    let run = folder.fine(&format!("train --loop gantry/gantry.toml --log {logs} --name gantry --out models --format json"));
    assert!(run.stderr.contains("ms old (±") && (run.json()["age_ms"].as_f64().unwrap() - 5.0).abs() < 3.0, "{}", run.stderr);
    let moved = folder.fine("machine gantry --motions 3 --model models/gantry.impromptu --format json").json();
    for axis in moved["axes"].as_array().unwrap() {
        assert!(axis["reduction_percent"][1].as_f64().unwrap() > 90.0, "{moved}");
    }
    folder.refused("machine servo --model models/gantry.impromptu", &["gantry.impromptu"]);
    assert_eq!(folder.run("machine crane").code, 2);
}

/// A log of a servo of second order with dither on its reference, as somebody's program would write it.
fn servo_log(seed: u64) -> String {
    let mut state = seed | 1;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1u32 << 30) - 1.0
    };
    let (mut angle, mut speed, mut sign) = (0.0, 0.0, 1.0);
    let mut text = "t,angle_des_rad,angle_ref_rad,angle_rad\n".to_owned();
    for tick in 0..6_000 {
        let t = f64::from(tick) * 0.01;
        let phase = seed as f64;
        let desired = 0.5 * (1.1 * t + phase).sin() + 0.3 * (2.3 * t).sin() + 0.2 * (4.1 * t + phase).cos();
        if tick % 5 == 0 {
            sign = if random() > 0.0 { 0.01 } else { -0.01 };
        }
        text += &format!("{t:.2},{desired:.6},{:.6},{:.6}\n", desired + sign, angle + 5e-4 * random());
        for _ in 0..10 {
            speed += 0.001 * (60.0 * (desired + sign - angle) - 11.0 * speed);
            angle += 0.001 * speed;
        }
    }
    text
}

#[test]
fn any_loop_is_described_and_trained_from_its_logs() {
    let folder = Folder::new();
    (1..=4).for_each(|seed| folder.write(&format!("servo{seed}.csv"), servo_log(seed)));
    let logs = "servo1.csv servo2.csv servo3.csv servo4.csv";
    folder.fine("describe --log servo1.csv --name servo --output servo.toml");
    let described = String::from_utf8(folder.read("servo.toml")).unwrap();
    for line in ["reference = \"angle_ref_rad\"", "desired = \"angle_des_rad\"", "measured = \"angle_rad\"", "unit = \"rad\""] {
        assert!(described.contains(line), "{described}");
    }
    // The age of a measurement cannot be told from reference and position alone: it is asked for.
    let asked = folder.run(&format!("train --loop servo.toml --log {logs}"));
    assert_eq!(asked.code, 2, "{}", asked.stderr);
    assert!(asked.stderr.contains("--delay-ms") && asked.stderr.contains("10 ms wrong leave"), "{}", asked.stderr);
    let train = format!("train --loop servo.toml --log {logs} --delay-ms 0 --name servo --format json");
    let trained = folder.fine(&format!("{train} --out models")).json();
    let axis = &trained["axes"][0];
    assert!(axis["reduction_percent"][0].as_f64().unwrap() > 90.0 && axis["lane"].is_string(), "{trained}");
    assert_eq!(trained["minutes"].as_f64().unwrap().round(), 4.0);
    folder.fine(&format!("{train} --out again"));
    assert_eq!(folder.read("models/servo.impromptu"), folder.read("again/servo.impromptu"));
    let bytes = folder.read("models/servo.impromptu");
    let model = Model::from_bytes(&bytes).unwrap();
    assert_eq!((model.card().signals.reference.len(), model.card().signals.desired[0].unit), (1, "rad"));
    assert!(model.card().provenance.remarks.starts_with("4.0 min of logs"), "{}", model.card().provenance.remarks);

    folder.refused(&format!("{train} --axis pan"), &["--axis pan", "it has axis"]);
    folder.write("bad.toml", described.replace("measured = \"angle_rad\"", "measured = \"speed\""));
    folder.refused(&format!("train --loop bad.toml --delay-ms 0 --log {logs}"), &["`speed` is missing", "describe"]);
    folder.write("bad.toml", described.replace("[[axes]]", "axes = []\n[[other]]"));
    folder.refused(&format!("train --loop bad.toml --delay-ms 0 --log {logs}"), &["bad.toml"]);
    let open = folder.run("describe --log servo1.csv --columns t,angle_ref_rad");
    assert_eq!(open.code, 2, "{}", open.stderr);
    folder.write("two.csv", "t,x_ref,x_setpoint,x\n0,0,0,0\n");
    let open = folder.run("describe --log two.csv");
    assert!(open.code == 2 && open.stderr.contains("--columns"), "{}", open.stderr);
}
