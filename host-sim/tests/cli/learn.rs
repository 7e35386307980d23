//! What learning in flight would have left of the flights of real logs, and what is refused.

use crate::program::Folder;

/// Flights of a Crazyflie (BSD-3-Clause, see `reproduction/data/nanobench`), in a drawn order.
const FLIGHTS: [&str; 8] = [
    "B8_star_medium_rep1",
    "B7_oval_slow_rep2",
    "B9_trefoil_slow_rep1",
    "B3_figure8_slow_rep1",
    "B10_lissajous_fast_rep1",
    "B5_helix_fast_rep1",
    "B2_circle_slow_rep1",
    "B5_helix_medium_rep1",
];

/// Copies the flights into the folder; returns their names for a command line.
fn nanobench(folder: &Folder) -> String {
    let source = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("reproduction/data/nanobench");
    FLIGHTS
        .map(|name| {
            let name = format!("{name}.csv");
            folder.write(&name, std::fs::read(source.join(&name)).unwrap());
            name
        })
        .join(" ")
}

#[test]
fn the_errors_of_real_flights_would_have_melted() {
    let folder = Folder::new();
    let logs = nanobench(&folder);
    let found = folder.fine(&format!("learn --log {logs} --format json")).json();
    assert_eq!(found["kind"], "prediction by replay, nothing was flown");
    assert_eq!((&found["axes"], found["unit"].as_str()), (&serde_json::json!(["x", "y"]), Some("cm")));
    let flights = found["flights"].as_array().unwrap();
    let number = |flight: &serde_json::Value, name: &str| flight[name].as_f64().unwrap();
    assert_eq!((flights.len(), number(&flights[0], "reduction_percent")), (8, 0.0));
    for flight in &flights[5..] {
        assert!(number(flight, "predicted") < 0.35 * number(flight, "recorded") && number(flight, "recorded") > 20.0, "{flight}");
    }
    assert!(number(&flights[7], "learned_before_min") > 2.0 && number(&found, "learned_min") > 2.4, "{found}");
    let later = |name: &str| found["summaries"][1][name].as_f64().unwrap();
    assert!(later("predicted") < 0.25 * later("recorded"), "{found}");
    for error in found["otherwise"].as_array().unwrap() {
        assert!(error.as_f64().unwrap() < 0.35 * later("recorded"), "{found}");
    }
    let run = folder.fine(&format!("learn --log {logs} --out page"));
    for part in [
        "PREDICTION by replay, nothing was flown",
        "Response: second order",
        "50.0 ticks a second",
        "flights 6 to 8",
        "min of flight",
    ] {
        assert!(run.stdout.contains(part), "`{part}` is missing in {}", run.stdout);
    }
    assert!(run.stderr.contains("figure: page") && run.stderr.contains("learned: page"), "{}", run.stderr);
    let learned = folder.read("page/learn.learned");
    let kept = impromptu_firmware::learning::Kept::read(&learned).unwrap();
    assert!(kept.rate_hz == 50.0 && kept.axes().all(|axis| axis.learned_s > 60.0), "{kept:?}");
    let page = String::from_utf8(folder.read("page/learn.html")).unwrap();
    assert!(page.contains("nothing was flown") && page.contains("<svg") && page.contains(FLIGHTS[0]), "{page}");
    let given = folder.fine(&format!("learn --log {logs} --axis x --frequency 3 --damping 0.7 --delay-ms 100")).stdout;
    assert!(given.contains("RMS error of x with") && given.contains("3.00 rad/s, damping 0.70, delay 100 ms"), "{given}");
}

#[test]
fn columns_are_named_where_they_are_not_known_and_asked_for_where_two_could_be_meant() {
    let folder = Folder::new();
    let logs = nanobench(&folder);
    let renamed = FLIGHTS[..3].iter().map(|name| {
        let text = String::from_utf8(folder.read(&format!("{name}.csv"))).unwrap();
        let (header, rows) = text.split_once('\n').unwrap();
        let twice: String = rows.lines().map(|row| format!("{row},{}\n", row.split(',').nth(1).unwrap())).collect();
        folder.write(&format!("two-{name}.csv"), format!("{header},est_stateEstimate_x\n{twice}"));
        folder.write(&format!("other-{name}.csv"), format!("seconds,east,north,east_goal,north_goal\n{rows}"));
        name.to_string()
    });
    let names: Vec<String> = renamed.collect();
    let list = |kind: &str| names.iter().map(|name| format!("{kind}-{name}.csv")).collect::<Vec<_>>().join(" ");
    let run = folder.run(&format!("learn --log {}", list("two")));
    assert_eq!((run.code, run.stdout.as_str()), (2, ""), "{}", run.stderr);
    for part in ["two-B8_star_medium_rep1.csv", "`px` and `est_stateEstimate_x`", "--columns t,sp_ctrltarget_x,px"] {
        assert!(run.stderr.contains(part), "`{part}` is missing in {}", run.stderr);
    }
    let settled = format!("learn --log {} --columns t,sp_ctrltarget_x,px t,sp_ctrltarget_y,py --format json", list("two"));
    let known =
        folder.fine(&format!("learn --log {} --format json", logs.split(' ').take(3).collect::<Vec<_>>().join(" "))).json();
    assert_eq!(folder.fine(&settled).json()["flights"][2]["predicted"], known["flights"][2]["predicted"]);
    let columns = "--columns seconds,east_goal,east seconds,north_goal,north";
    let other = folder.fine(&format!("learn --log {} {columns} --format json", list("other"))).json();
    let (other, known) = (&other["flights"][2]["predicted"], &known["flights"][2]["predicted"]);
    assert!((100.0 * other.as_f64().unwrap() - known.as_f64().unwrap()).abs() < 1e-6, "{other} {known}");
    assert_eq!(folder.run("learn --log a.csv --columns t,x").code, 2);
}

#[test]
fn what_is_wrong_with_a_log_and_what_to_do_is_said() {
    let folder = Folder::new();
    nanobench(&folder);
    let good = "B2_circle_slow_rep1.csv";
    let text = String::from_utf8(folder.read(good)).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let edited = |line: usize, row: &str| {
        let mut lines = lines.clone();
        lines[line] = row;
        lines.join("\n")
    };
    folder.write("nan.csv", edited(40, "1.56,NaN,0,0,0"));
    folder.write("far.csv", edited(40, "1.56,3e6,0,0,0"));
    folder.write("short.csv", lines[..76].join("\n"));
    folder.write("gap.csv", [&lines[..100], &lines[140..]].concat().join("\n"));
    folder.write("column.csv", text.replacen("py", "north", 1).replacen("px", "east", 1));
    folder.write(
        "still.csv",
        lines[..1]
            .iter()
            .map(|line| (*line).to_owned())
            .chain((0..400).map(|row| format!("{},0,0,1,1", f64::from(row) * 0.04)))
            .collect::<Vec<_>>()
            .join("\n"),
    );
    let slow = lines[..1].iter().chain(lines[1..].iter().step_by(25));
    folder.write("slow.csv", slow.copied().collect::<Vec<_>>().join("\n"));
    let refused = |bad: &str, named: &[&str]| folder.refused(&format!("learn --log {good} {bad}"), named);
    refused("nan.csv", &["nan.csv, line 41", "`px`", "NaN", "drop or repair"]);
    refused("far.csv", &["far.csv, line 41", "`px`", "-1e5 to 1e5"]);
    refused("short.csv", &["short: 3.0 s are too short", "at least"]);
    refused("gap.csv", &["gap.csv", "row 99", "resample"]);
    refused("column.csv", &["column.csv", "`reference`", "t, east, north", "--columns"]);
    refused("slow.csv", &["slow.csv", "rows are too few"]);
    refused("absent.csv", &["absent.csv"]);
    folder.refused(&format!("learn --log still.csv {good}"), &["still: the reference does not move", "--frequency"]);
    folder.refused(&format!("learn --log {good}"), &["two sound flights"]);
    folder.refused(
        &format!("learn --log {good} {good} --frequency 200 --damping 0.7 --delay-ms 0"),
        &["200.00 rad/s", "25.0 rows a second", "log faster", "--frequency"],
    );
    assert!(!folder.path("out/learn.html").exists());
}

/// What is learned in flight is flown, from nothing and on the way, with the loops that a vehicle may have.
#[test]
fn fly_and_evaluate_learn_in_flight() {
    let folder = Folder::new();
    let flown =
        folder.fine("fly --trajectory figure8 --learn 20 --controller pid --speed 0.7 --log pid.csv --format json").json();
    let flights = flown["flights"].as_array().unwrap();
    assert_eq!(flights[1]["method"], "learned");
    assert!(flights.len() == 2 && flights[1]["reduction"].as_f64().unwrap() > 80.0, "{flown}");
    // What was learned goes on after a power cut, for the same loop and model alone.
    let first = "fly --trajectory star --speed 0.7 --controller pid --format json --learn";
    folder.fine("fly --trajectory figure8 --learn 20 --controller pid --speed 0.7 --keep pid.learned");
    let with = |run: String| folder.fine(&run).json()["flights"][1]["reduction"].as_f64().unwrap();
    let (nothing, recalled) = (with(first.to_owned()), with(format!("{first} --recall pid.learned")));
    assert!(recalled > nothing + 5.0 && recalled > 85.0, "{nothing} {recalled}");
    let refused = folder.run(&format!("{first} 10 --recall pid.learned"));
    assert!(refused.code == 2 && refused.stderr.contains("leave out the SECONDS"), "{}", refused.stderr);
    let mut damaged = folder.read("pid.learned");
    damaged[50] ^= 1;
    folder.write("damaged.learned", &damaged);
    folder.refused(&format!("{first} --recall damaged.learned"), &["damaged.learned", "learn anew, then keep"]);
    folder.write("log.csv", b"time\n");
    folder.refused(&format!("{first} --recall log.csv"), &["log.csv", "nothing was kept here"]);
    // The log is that of the flight that learned.
    assert!(String::from_utf8(folder.read("pid.csv")).unwrap().starts_with("time_s,desired_x_m"));
    let evaluated = folder.fine("evaluate --learn 30 --strokes 4 --speed 1 --format json").json();
    let rows = evaluated["table"].as_array().unwrap();
    assert_eq!(rows.iter().map(|row| row["method"].as_str().unwrap()).collect::<Vec<_>>(), ["baseline", "learned"]);
    assert!(rows[1]["reduction_mean"].as_f64().unwrap() > 70.0, "{evaluated}");
    // The same seed gives the same bytes.
    assert_eq!(evaluated, folder.fine("evaluate --learn 30 --strokes 4 --speed 1 --format json").json());
    let refused = folder.run("fly --trajectory figure8 --learn 1e9");
    assert!(refused.code == 2 && refused.stderr.contains("whole seconds from 0 to 3600"), "{}", refused.stderr);
}

#[test]
fn the_study_of_learning_has_the_documented_rows() {
    let folder = Folder::new();
    let found = folder.fine("study learning --from-nothing --strokes 5 --format json").json();
    let rows = found["rows"].as_array().unwrap();
    assert!(rows.len() >= 25, "{}", rows.len());
    for row in rows {
        for key in ["vehicle", "loop", "condition", "start", "parts"] {
            assert!(row[key].is_string(), "{key}: {row}");
        }
        for key in ["rms_cm_mean", "reduction_mean", "reduction_worst"] {
            assert!(row[key].as_f64().unwrap().is_finite(), "{key}: {row}");
        }
        assert!(row["seconds"].is_u64() || row["seconds"] == "from_first_stroke", "{row}");
        assert!(row["seed"].as_u64() == Some(1) && row["start"] == "nothing", "{row}");
    }
    let loops: std::collections::BTreeSet<&str> = rows.iter().filter_map(|row| row["loop"].as_str()).collect();
    let expected = ["mellinger", "mellinger_feed_forward", "pd", "pid", "se3", "second_order"];
    assert_eq!(loops.into_iter().collect::<Vec<_>>(), expected);
    for machine in ["servo", "two_mass", "non_minimum_phase"] {
        assert!(rows.iter().any(|row| row["vehicle"] == machine), "{machine}");
    }
    let page = String::from_utf8(folder.read("out/study-learning.html")).unwrap();
    assert!(page.contains("The error melts") && page.contains("<svg"), "the first figure");
}

/// A minute of flight becomes a model, beside which learning goes on; what was learned beside a model is only a part of one.
#[test]
fn what_was_learned_in_flight_becomes_a_model() {
    let folder = Folder::new();
    folder.fine("fly --trajectory figure8 --learn 60 --keep own.learned");
    let made = folder.fine("train --learned own.learned --vehicle crazyflie --name flown --out models --format json").json();
    assert!(made["logs"] == 0 && made["feedback_lane"].is_string(), "{made}");
    let evaluated = folder.fine("evaluate --model models/flown.impromptu --strokes 6 --speed 1 --format json").json();
    let reduction = |method: &str| {
        let row = evaluated["table"].as_array().unwrap().iter().find(|row| row["method"] == method);
        row.unwrap_or_else(|| panic!("no {method} in {evaluated}"))["reduction_mean"].as_f64().unwrap()
    };
    assert!(reduction("ridge") > 85.0 && reduction("full_ridge") > 93.0, "{evaluated}");
    folder.fine("fly --trajectory figure8 --model models/flown.impromptu --learn 10 --keep more.learned");
    folder.refused("train --learned more.learned --vehicle crazyflie", &["more.learned", "beside another model"]);
    folder.refused("train --learned models/flown.impromptu --vehicle crazyflie", &["flown.impromptu", "nothing was kept here"]);
    folder.fine("fly --trajectory figure8 --learn 2 --keep little.learned");
    folder.refused("train --learned little.learned --vehicle crazyflie", &["little.learned", "in motion", "fly on"]);
    for wrong in ["train --learned own.learned", "train --learned own.learned --vehicle crazyflie --log log.csv", "train"] {
        let refused = folder.run(wrong);
        assert!(refused.code == 2, "{wrong}: {}", refused.stderr);
    }
}
