//! `host-sim doctor`: which tools the README's commands need, which are there, and how to get the others.

use std::{ffi::OsStr, path::PathBuf, process::Command};

use anyhow::Result;
use clap::Args;
use serde::Serialize;

use super::{Invocation, output::table};

/// Arguments of `doctor`.
#[derive(Debug, Args)]
#[command(after_help = "\
Looks and changes nothing. The program itself needs none of what may be missing: each line says which command does. tests/run.sh
installs what it needs by itself on Debian and Ubuntu.

Examples:
  host-sim doctor
  host-sim doctor --format json")]
pub(super) struct Doctor {}

/// Where a tool is looked for.
#[derive(Clone, Copy)]
enum Tool {
    /// A program in PATH, and what makes it say its version.
    Program(&'static str, &'static str),
    /// A target of the Rust compiler in PATH.
    Target(&'static str),
}

/// A tool, which command needs it, and how one gets it.
struct Need {
    tool: Tool,
    needed_for: &'static str,
    get: &'static str,
}

const fn program(name: &'static str, needed_for: &'static str, get: &'static str) -> Need {
    Need { tool: Tool::Program(name, "--version"), needed_for, get }
}

const fn target(name: &'static str, needed_for: &'static str, get: &'static str) -> Need {
    Need { tool: Tool::Target(name), needed_for, get }
}

/// All that a command of the README calls.
const NEEDS: [Need; 20] = [
    program("cargo", "cargo run --release", "https://rustup.rs"),
    program("rustc", "cargo run --release", "https://rustup.rs"),
    program("rustup", "tests/run.sh adds targets with it", "https://rustup.rs"),
    program("cc", "cargo run --release links with it", "sudo apt-get install gcc libc6-dev"),
    program("c++", "tests/run.sh", "sudo apt-get install g++ libc6-dev"),
    program("qemu-system-arm", "cargo mcu, fly --pil, tests/run.sh", "sudo apt-get install qemu-system-arm"),
    program("arm-none-eabi-gcc", "tests/run.sh", "sudo apt-get install gcc-arm-none-eabi libnewlib-arm-none-eabi"),
    program("cargo-deny", "tests/run.sh", "cargo install --locked cargo-deny"),
    program("cargo-fuzz", "tests/run.sh", "cargo install --locked cargo-fuzz"),
    program("cmake", "tests/run.sh long", "sudo apt-get install cmake"),
    program("git", "tests/run.sh long", "sudo apt-get install git"),
    target("thumbv7em-none-eabihf", "cargo mcu, fly --pil, tests/run.sh", "rustup target add thumbv7em-none-eabihf"),
    target("thumbv6m-none-eabi", "tests/run.sh", "rustup target add thumbv6m-none-eabi"),
    target("thumbv7m-none-eabi", "tests/run.sh", "rustup target add thumbv7m-none-eabi"),
    target("thumbv7em-none-eabi", "tests/run.sh", "rustup target add thumbv7em-none-eabi"),
    target("thumbv8m.main-none-eabi", "tests/run.sh", "rustup target add thumbv8m.main-none-eabi"),
    target("thumbv8m.main-none-eabihf", "tests/run.sh", "rustup target add thumbv8m.main-none-eabihf"),
    target("riscv32imac-unknown-none-elf", "tests/run.sh", "rustup target add riscv32imac-unknown-none-elf"),
    target("wasm32-unknown-unknown", "tests/run.sh", "rustup target add wasm32-unknown-unknown"),
    target("x86_64-pc-windows-gnu", "tests/run.sh", "rustup target add x86_64-pc-windows-gnu"),
];

impl Tool {
    fn name(self) -> &'static str {
        match self {
            Self::Program(name, _) | Self::Target(name) => name,
        }
    }

    /// What was found, in a line; `None` if it is not there.
    fn found(self) -> Option<String> {
        match self {
            Self::Program(name, version) => {
                let place = in_path(name, &std::env::var_os("PATH")?)?;
                // A program that does not say its version is there all the same.
                let said = answer(&place, &[version]).and_then(|text| text.lines().next().map(str::to_owned));
                Some(said.unwrap_or_else(|| place.display().to_string()))
            }
            Self::Target(name) => {
                let folder = answer("rustc", &["--print", "target-libdir", "--target", name])?;
                PathBuf::from(folder.trim()).is_dir().then(|| "installed".into())
            }
        }
    }
}

/// What a program says, if it says it and ends well.
fn answer(program: impl AsRef<OsStr>, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program).args(arguments).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Where a program lies in a list of folders.
fn in_path(name: &str, folders: &OsStr) -> Option<PathBuf> {
    std::env::split_paths(folders)
        .map(|folder| folder.join(format!("{name}{}", std::env::consts::EXE_SUFFIX)))
        .find(|path| path.is_file())
}

/// A line of the answer.
#[derive(Debug, Serialize)]
struct Row {
    tool: &'static str,
    /// What was found; none if it is missing.
    found: Option<String>,
    needed_for: &'static str,
    /// How to get it.
    get: &'static str,
}

impl Doctor {
    pub(super) fn run(self, invocation: &Invocation) -> Result<()> {
        let rows: Vec<Row> = NEEDS
            .iter()
            .map(|need| Row { tool: need.tool.name(), found: need.tool.found(), needed_for: need.needed_for, get: need.get })
            .collect();
        invocation.format.print(&rows, || text(&rows))
    }
}

fn text(rows: &[Row]) -> String {
    let cells = |row: &Row| [row.tool.into(), row.found.clone().unwrap_or_else(|| "missing".into()), row.needed_for.into()];
    let mut text = table(["tool", "found", "needed for"], 3, rows.iter().map(cells));
    let missing: Vec<&Row> = rows.iter().filter(|row| row.found.is_none()).collect();
    if missing.is_empty() {
        return text + "\nnothing is missing\n";
    }
    text += "\nto get what is missing:\n";
    let mut told: Vec<&str> = Vec::new();
    for row in missing {
        if !told.contains(&row.get) {
            text += &format!("  {}\n", row.get);
            told.push(row.get);
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_told_with_how_to_get_it_once() {
        let row = |tool, found: Option<&str>, get| Row { tool, found: found.map(str::to_owned), needed_for: "a command", get };
        let rows =
            [row("cargo", None, "https://rustup.rs"), row("rustc", None, "https://rustup.rs"), row("cc", Some("cc 12"), "x")];
        let told = text(&rows);
        assert_eq!(told.matches("https://rustup.rs").count(), 1, "{told}");
        assert!(told.contains("missing") && !told.contains("nothing is missing") && told.ends_with("  https://rustup.rs\n"));
        assert!(text(&rows[2..]).ends_with("nothing is missing\n"));
    }

    #[test]
    fn a_program_is_found_in_the_first_folder_that_has_it() {
        let folders = tempfile::tempdir().unwrap();
        let [first, second] = ["first", "second"].map(|name| folders.path().join(name));
        for folder in [&first, &second] {
            std::fs::create_dir(folder).unwrap();
        }
        let list = std::env::join_paths([&first, &second]).unwrap();
        let name = format!("tool{}", std::env::consts::EXE_SUFFIX);
        assert_eq!(in_path("tool", &list), None);
        std::fs::write(second.join(&name), "").unwrap();
        assert_eq!(in_path("tool", &list), Some(second.join(&name)));
        std::fs::create_dir(first.join(&name)).unwrap();
        assert_eq!(in_path("tool", &list), Some(second.join(&name)), "a folder is no program");
    }
}
