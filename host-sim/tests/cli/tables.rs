//! Help, lists, trajectories and stored results.

use crate::program::Folder;

#[test]
fn help_names_every_command_and_the_columns_of_a_log() {
    let folder = Folder::new();
    let help = folder.fine("--help");
    for command in ["collect", "learn", "train", "fly", "evaluate", "report", "trajectory"] {
        assert!(help.stdout.contains(&format!("\n  {command} ")), "{command}");
        let own = folder.fine(&format!("{command} --help")).stdout;
        assert!(own.contains("Example") && own.contains("--seed"), "{command}");
    }
    let train = folder.fine("train --help").stdout;
    for column in ["time_s", "desired_vx_m_s", "reference_z_m", "measured_vy_m_s", "true_x_m", "--dithered", "NED"] {
        assert!(train.contains(column), "{column}");
    }
}

#[test]
fn wrong_arguments_have_a_code_of_their_own() {
    let folder = Folder::new();
    for words in ["flye", "--seed x", "fly", "fly --trajectory circle --speed 0", "fly --trajectory circle --lanes network"] {
        let run = folder.run(words);
        assert_eq!((run.code, run.stdout.as_str()), (2, ""), "{words}: {}", run.stderr);
        assert!(!run.stderr.is_empty());
    }
}

#[test]
fn a_written_trajectory_can_be_flown() {
    let folder = Folder::new();
    assert!(folder.fine("trajectory --list").stdout.contains("figure8\n"));
    folder.fine("trajectory circle --speed 1.5 --output circle.csv");
    let run = folder.fine("trajectory circle --speed 1.5 --quiet");
    assert_eq!((run.stdout.as_bytes(), run.stderr.as_str()), (&folder.read("circle.csv")[..], ""));
    assert!(run.stdout.starts_with("t,x,y,z,yaw\n0,"));
    let named = folder.fine("fly --trajectory circle --speed 1.5 --condition clean --format json").json();
    let filed = folder.fine("fly --trajectory circle.csv --condition clean --format json").json();
    let error = |flown: &serde_json::Value| flown["flights"][0]["rms_cm"].as_f64().unwrap();
    assert!((error(&named) - error(&filed)).abs() < 0.02 * error(&named), "{named} {filed}");
}

#[test]
fn a_report_is_made_again_from_stored_results() {
    let folder = Folder::new();
    folder.write(
        "results.json",
        r#"{"title": "Stored", "command": "host-sim", "seed": 3, "software_version": "0", "flights": [], "models": [],
        "timings": [], "notes": [], "per_flight": [], "table": [{"vehicle": "crazyflie", "gains": "stock", "condition": "lab",
        "speed": 1.0, "method": "baseline", "rms_cm_mean": 9.5, "reduction_mean": 0.0, "reduction_worst": 0.0, "seed": 3}]}"#,
    );
    assert!(folder.fine("report results.json --out again").stdout.contains("Stored"));
    assert!(String::from_utf8(folder.read("again/report.html")).unwrap().contains("Stored"));
    assert!(folder.read("again/table.csv").starts_with(b"vehicle,gains,condition"));
    assert_eq!(folder.fine("report results.json --out again --format json").json()["table"][0]["rms_cm_mean"], 9.5);
    folder.write("broken.json", r#"{"title": "Broken"}"#);
    folder.refused("report broken.json --out again", &["broken.json", "`command`", "line 1"]);
}
