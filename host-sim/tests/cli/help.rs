//! What a new user reads first works as it stands: examples, manual, completions, the list of tools.

use std::process::Command;

use crate::program::Folder;

const PROGRAM: &str = env!("CARGO_BIN_EXE_host-sim");

/// Commands whose first example takes minutes, or needs what only the demo makes (`demo` runs it with a small configuration).
const LONG: [&str; 2] = ["study", "report"];

/// Names of all commands, as the program lists them.
fn commands(folder: &Folder) -> Vec<String> {
    let help = folder.fine("--help").stdout;
    let list = help.split("Commands:\n").nth(1).unwrap().split("\n\n").next().unwrap();
    let names = list.lines().filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    names.filter(|name| !name.is_empty() && *name != "help").map(str::to_owned).collect()
}

/// As in a fresh clone, in which only the folder of real logs is there.
#[cfg(unix)]
#[test]
fn the_first_example_of_every_command_runs_as_it_stands() {
    let folder = Folder::new();
    let commands = commands(&folder);
    assert!(commands.len() >= 14, "{commands:?}");
    std::fs::create_dir_all(folder.path("host-sim/reproduction")).unwrap();
    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/reproduction/data");
    std::os::unix::fs::symlink(data, folder.path("host-sim/reproduction/data")).unwrap();
    let programs = std::path::Path::new(PROGRAM).parent().unwrap().as_os_str();
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let paths = std::env::join_paths(std::iter::once(programs.into()).chain(std::env::split_paths(&paths))).unwrap();
    for name in commands.iter().filter(|name| !LONG.contains(&name.as_str())) {
        let help = folder.fine(&format!("{name} --help")).stdout;
        let examples = help.split("Examples:\n").nth(1).unwrap_or_else(|| panic!("{name}: no example"));
        let example = examples.lines().next().unwrap().trim();
        assert!(example.contains(&format!("host-sim {name}")), "{name}: {example}");
        let output = Command::new("sh").args(["-c", example]).current_dir(folder.path("")).env("PATH", &paths).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{example}: {said}");
        assert!(!said.contains("\\u{a}"), "two lines in one: {said}");
    }
}

#[test]
fn every_command_has_its_page_of_the_manual() {
    let folder = Folder::new();
    folder.fine("manual --out manual");
    let pages = folder.files("manual", ".1");
    for name in commands(&folder) {
        assert!(pages.contains(&format!("manual/host-sim-{name}.1")), "{name}: {pages:?}");
    }
    let page = String::from_utf8(folder.read("manual/host-sim-study-lti.1")).unwrap();
    assert!(page.contains(".TH HOST-SIM-STUDY-LTI") && page.contains("host\\-sim\\-study\\-lti"), "{page}");
}

#[test]
fn shells_complete_every_command() {
    let folder = Folder::new();
    let commands = commands(&folder);
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = folder.fine(&format!("completions {shell}")).stdout;
        for name in &commands {
            assert!(script.contains(name.as_str()), "{shell}: {name}");
        }
    }
    let run = folder.run("completions tcsh");
    assert!(run.code == 2 && run.stderr.contains("bash"), "{}", run.stderr);
}

#[test]
fn the_doctor_tells_of_every_tool_what_for_and_how_to_get_it() {
    let folder = Folder::new();
    let rows = folder.fine("doctor --format json").json();
    let rows = rows.as_array().unwrap();
    let cargo = rows.iter().find(|row| row["tool"] == "cargo").unwrap();
    assert!(cargo["found"].as_str().unwrap().starts_with("cargo 1."), "{cargo}");
    for row in rows {
        assert!(!row["needed_for"].as_str().unwrap().is_empty() && !row["get"].as_str().unwrap().is_empty(), "{row}");
    }
    assert!(folder.fine("doctor").stdout.contains("needed for"));
}
