//! Files of others and places that are no files: nothing is lost, nothing hangs, nothing is obeyed.

use std::{
    fs,
    os::unix::fs::{FileTypeExt as _, PermissionsExt as _, symlink},
    process::{Command, Stdio},
};

use impromptu_model_export::{Description, FloatNetwork, rows};

use crate::program::Folder;

/// Results with one flight, texts and positions as given.
fn results(text: &str, positions: &str) -> String {
    let text = serde_json::to_string(text).unwrap();
    let flight =
        format!("\"vehicle\": {text}, \"gains\": {text}, \"condition\": {text}, \"speed\": 1.0, \"method\": \"baseline\"");
    format!(
        "{{\"title\": {text}, \"command\": {text}, \"seed\": 1, \"software_version\": {text}, \"models\": [], \"timings\": [],
        \"notes\": [{text}],
        \"table\": [{{{flight}, \"rms_cm_mean\": -1e308, \"reduction_mean\": 0, \"reduction_worst\": 0, \"seed\": 1}}],
        \"per_flight\": [{{{flight}, \"trajectory\": {text}, \"rms_cm\": 1e308, \"reduction\": 0, \"seed\": 1}}],
        \"flights\": [{{{flight}, \"trajectory\": {text}, \"rate_hz\": 100.0, \"scored\": {{\"start\": 0, \"end\": 4}},
        \"desired\": {positions}, \"flown\": {positions}, \"reference\": {positions}}}]}}"
    )
}

#[test]
fn a_report_of_insane_positions_ends_and_hostile_texts_are_seen() {
    let folder = Folder::new();
    let text = "=1+1\u{1b}[2K\r\u{202e}\nSafe to fly";
    for positions in [
        "[[1e308,-1e308,1e308],[-1e308,1e308,-1e308],[0,0,0],[1e308,1e308,1e308]]",
        "[[1e12,0,0],[1e12,1e-9,0],[1e12,0,1e-300],[1e12,0,0]]",
        "[[5e-324,0,0],[0,5e-324,0],[0,0,0],[0,0,0]]",
    ] {
        folder.write("results.json", results(text, positions));
        let run = folder.fine("report results.json --out page");
        let html = String::from_utf8(folder.read("page/report.html")).unwrap();
        let csv = String::from_utf8(folder.read("page/table.csv")).unwrap();
        for shown in [&run.stdout, &run.stderr, &html, &csv] {
            assert!(!shown.chars().any(|c| (c.is_control() && c != '\n') || c == '\u{202e}'), "{shown}");
            assert!(!shown.lines().any(|line| line.starts_with("Safe to fly")), "{shown}");
        }
        assert!(csv.lines().nth(1).unwrap().starts_with("'=1+1\\u{1b}[2K"), "{csv}");
    }
    // The same document on stdout: harmless to a terminal, the same to a program.
    let json = folder.fine("report results.json --out page --format json");
    assert!(!json.stdout.contains(['\u{1b}', '\u{202e}']));
    assert_eq!(json.json()["title"], text);
}

#[test]
fn settings_that_nothing_has_are_refused_with_value_and_range() {
    let folder = Folder::new();
    let flights = |signal: &str, seconds: &str, shortest: &str| {
        format!(
            "[[recipe.training_flights]]\nsignal = \"{signal}\"\nflights = 1\nseconds = {seconds}\nmax_speed = 1.0\n\
             max_acceleration = 2.0\nshortest_s = {shortest}\n"
        )
    };
    for (text, named) in [
        (flights("multisine", "20.0", "0.0"), ["shortest_s: 0 is not from", "0.05 to 10"]),
        (flights("spline", "20.0", "0.0"), ["shortest_s: 0 is not from", "0.05 to 60"]),
        (flights("multisine", "0.0", "0.5"), ["seconds: 0 is not from", "6 to 3590"]),
        (flights("spline", "1e12", "0.5"), ["seconds: 1000000000000 is not from", "6 to 3590"]),
        ("[recipe.network]\nhidden = [1000000]".into(), ["`hidden` is [1000000]", "1 to 256"]),
        ("speeds = [1e308]".into(), ["speeds[0]: 1", "is not from 0.05 to 20"]),
    ] {
        folder.write("demo.toml", text);
        folder.refused("collect --config demo.toml --out logs", &["demo.toml", named[0], named[1]]);
    }
    let condition = "name = \"own\"\nmeasurement_delay_s = 1e12\ncommand_delay_s = 0.0\n";
    folder.write("own.toml", condition);
    let named = ["--condition", "`measurement_delay_s` is 1000000000000", "from 0 to 0.5 (s)"];
    folder.refused("fly --trajectory circle --condition own.toml", &named);
}

#[test]
fn places_that_are_no_files_are_left_alone() {
    let folder = Folder::new();
    assert!(Command::new("mkfifo").arg(folder.path("pipe")).status().unwrap().success());
    fs::create_dir(folder.path("folder")).unwrap();
    folder.refused("fly --trajectory circle --log pipe", &["pipe", "no regular file"]);
    assert!(fs::metadata(folder.path("pipe")).unwrap().file_type().is_fifo());
    folder.refused("fly --trajectory circle --log folder", &["folder", "is a folder"]);
    folder.refused("fly --trajectory circle --log /dev/zero", &["/dev/zero", "no regular file"]);
    folder.refused("trajectory circle --output absent/file.csv", &["absent", "there is no folder"]);
    folder.fine("fly --trajectory circle --log /dev/null");
    assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
    let streamed = folder.fine("trajectory circle --output /dev/stdout");
    assert!(streamed.stdout.starts_with("t,x,y,z,yaw\n"));

    // A link stays and leads to the new content, which has the old mode.
    folder.write("target.csv", "old");
    fs::set_permissions(folder.path("target.csv"), fs::Permissions::from_mode(0o604)).unwrap();
    symlink("target.csv", folder.path("link.csv")).unwrap();
    folder.fine("trajectory circle --output link.csv");
    assert!(fs::symlink_metadata(folder.path("link.csv")).unwrap().is_symlink());
    assert!(folder.read("target.csv").starts_with(b"t,x,y,z,yaw\n"));
    assert_eq!(fs::metadata(folder.path("target.csv")).unwrap().permissions().mode() & 0o777, 0o604);
}

#[test]
fn no_output_is_an_input() {
    let folder = Folder::new();
    folder.fine("trajectory circle --output own.csv");
    fs::hard_link(folder.path("own.csv"), folder.path("hard.csv")).unwrap();
    symlink("own.csv", folder.path("soft.csv")).unwrap();
    let before = folder.read("own.csv");
    for output in ["own.csv", "./own.csv", "hard.csv", "soft.csv"] {
        folder.refused(&format!("trajectory own.csv --output {output}"), &[output, "same file as the input"]);
        folder.refused(&format!("fly --trajectory own.csv --log {output}"), &[output, "same file as the input"]);
        folder.refused(&format!("fly --trajectory circle --model own.csv --log {output}"), &[output, "same file as the input"]);
    }
    folder.write("demo.toml", "seed = 3\n");
    folder.refused("fly --trajectory circle --config demo.toml --log demo.toml", &["demo.toml", "same file as the input"]);
    folder.write("report.html", results("a", "[[0,0,0],[1,1,1]]"));
    folder.refused("report report.html --out .", &["report.html", "same file as the input"]);
    assert_eq!(folder.read("own.csv"), before);
}

#[test]
fn endless_inputs_are_refused() {
    let folder = Folder::new();
    let named = ["/dev/zero", "no regular file"];
    folder.refused("diagnose --log /dev/zero", &named);
    folder.refused("train --log /dev/zero /dev/zero", &named);
    folder.refused("fly --trajectory circle --model /dev/zero", &named);
    folder.refused("fly --trajectory circle --config /dev/zero", &named);
    folder.refused("report /dev/zero", &named);
    folder.refused("study merge /dev/zero", &named);
    symlink("/dev/zero", folder.path("endless.csv")).unwrap();
    folder.refused("fly --trajectory endless.csv", &["endless.csv", "no regular file"]);
}

#[test]
fn too_few_rows_are_refused_and_forced_ones_are_recorded() {
    let folder = Folder::new();
    folder.fine("fly --trajectory circle --log one.csv");
    folder.fine("fly --trajectory circle --log two.csv --seed 2");
    let text = String::from_utf8(folder.read("one.csv")).unwrap();
    folder.write("short.csv", text.lines().take(300).collect::<Vec<_>>().join("\n"));
    let train = "train --log short.csv two.csv --recipe recipe.toml";
    let run = folder.run(&format!("{train} --name few"));
    assert_eq!((run.code, run.stdout.as_str()), (1, ""), "{}", run.stderr);
    assert!(run.stderr.contains("rows to train on") && run.stderr.contains("are needed"), "{}", run.stderr);
    assert!(run.stderr.contains("--force"), "{}", run.stderr);
    assert!(!folder.path("out/few.impromptu").exists());
    let forced = folder.fine(&format!("{train} --name few --force --format json")).json();
    assert!(forced["overridden"].as_str().unwrap().contains("rows overridden by --force"), "{forced}");
    let description = String::from_utf8(folder.read("out/few.json")).unwrap();
    assert!(description.contains("rows overridden by --force"), "{description}");
    folder.refused(&format!("{train} --name few --force --out out/few.json"), &["--out"]);
}

/// Whether the files of a training belong together.
fn is_whole(folder: &Folder, name: &str) -> bool {
    let network = FloatNetwork::read(&folder.path(&format!("{name}.safetensors"))).unwrap();
    let description = String::from_utf8(folder.read(&format!("{name}.json"))).unwrap();
    let description = Description::from_json(&description).unwrap();
    let rows = rows::read(&folder.path(&format!("{name}.rows.csv")), description.features.len()).unwrap();
    description.tie.expect("a tie").differs(&network, &rows).is_none()
}

/// Killed as soon as files are staged: the old set or the new one is there, and a signal that can be caught leaves nothing else.
#[test]
fn a_training_that_is_killed_late_leaves_one_set() {
    let folder = Folder::new();
    folder.fine("collect --condition clean --signal strokes --flights 4 --out logs");
    let logs = folder.files("logs", ".csv").join(" ");
    let train = format!("train --log {logs} --delay-ms 0 --recipe recipe.toml --out models --quiet");
    folder.fine(&train);
    assert!(is_whole(&folder, "models/model"));
    let first = folder.read("models/model.impromptu");
    for (round, signal) in ["TERM", "INT", "KILL", "TERM"].into_iter().enumerate() {
        let seed = (round + 2).to_string();
        let mut child = Command::new(env!("CARGO_BIN_EXE_host-sim"))
            .args(train.split_whitespace())
            .args(["--seed", &seed])
            .current_dir(folder.path("."))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let staged = || folder.files("models", ".tmp").len() > round % 4;
        while child.try_wait().unwrap().is_none() && !staged() {
            std::thread::yield_now();
        }
        let _ = Command::new("kill").args([format!("-{signal}"), child.id().to_string()]).stderr(Stdio::null()).status();
        child.wait().unwrap();
        if signal == "KILL" {
            // What nothing can clean up is hidden, and does no harm.
            fs::read_dir(folder.path("models")).unwrap().flatten().for_each(|entry| {
                if entry.file_name().to_string_lossy().starts_with(".impromptu-") {
                    fs::remove_file(entry.path()).unwrap();
                }
            });
        } else {
            assert!(is_whole(&folder, "models/model"), "mixed after {signal}");
        }
        assert_eq!(folder.files("models", "").len(), 4, "something is left after {signal}");
    }
    folder.fine(&train);
    assert!(is_whole(&folder, "models/model") && folder.read("models/model.impromptu") == first);
}
