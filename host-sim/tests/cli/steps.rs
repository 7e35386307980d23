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
fn without_a_vehicle_or_without_dither_the_model_has_no_feedback_lane_and_says_why() {
    let folder = collected("lab");
    let trained = train(&folder, "--delay-ms 30 --out models");
    assert!(trained["refusal"].as_str().unwrap().contains("--vehicle"), "{trained}");
    let bytes = folder.read("models/model.impromptu");
    let model = Model::from_bytes(&bytes).unwrap();
    assert!(model.feedback().is_none() && model.card().provenance.remarks.contains("--vehicle"));
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
