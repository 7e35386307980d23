//! Runs the program in a folder of its own.

use std::{
    path::{Path, PathBuf},
    process::{Command, Output},
};

use serde_json::Value;
use tempfile::TempDir;

/// A training of seconds: short flights, few epochs, one design.
const RECIPE: &str = "\
stride = 5
validation_strokes = 2
validation_speeds = [1.0]
[network]
hidden = [8]
epochs = 2
[fine_tuning]
hidden = [8]
epochs = 1
learning_rate = 1e-4
quantisation = {}
[lane]
control_weights = [3e-2]
velocity_weights = [0.2]
noise_factors = [4.0]
fast_limits = [0.05]
";

/// A folder that is removed at the end.
pub(crate) struct Folder(TempDir);

/// What a run left.
pub(crate) struct Run {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Folder {
    pub(crate) fn new() -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        folder.write("recipe.toml", RECIPE);
        folder
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), bytes).unwrap();
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// Names of the files in a folder of this one that end so, sorted.
    pub(crate) fn files(&self, folder: &str, ending: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.path(folder)).unwrap();
        let names = entries.map(|entry| format!("{folder}/{}", entry.unwrap().file_name().to_string_lossy()));
        let mut names: Vec<String> = names.filter(|name| name.ends_with(ending)).collect();
        names.sort();
        names
    }

    /// Runs the program in this folder; words are split at spaces.
    pub(crate) fn run(&self, words: &str) -> Run {
        run(self.0.path(), &words.split_whitespace().collect::<Vec<_>>())
    }

    /// [`Folder::run`], which must succeed.
    pub(crate) fn fine(&self, words: &str) -> Run {
        let run = self.run(words);
        assert_eq!(run.code, 0, "{words}: {}", run.stderr);
        run
    }

    /// [`Folder::run`], which must fail with one line that holds all of these, and nothing on stdout.
    pub(crate) fn refused(&self, words: &str, named: &[&str]) {
        let run = self.run(words);
        assert_eq!(run.code, 1, "{words}: {}{}", run.stdout, run.stderr);
        assert_eq!(run.stdout, "", "{words}");
        let message =
            run.stderr.lines().find(|line| line.starts_with("error: ")).unwrap_or_else(|| panic!("{words}: {}", run.stderr));
        for part in named {
            assert!(message.contains(part), "{words}: `{part}` is missing in: {message}");
        }
    }
}

impl Run {
    /// The one JSON document on stdout.
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|error| panic!("{error}: {}", self.stdout))
    }
}

fn run(folder: &Path, words: &[&str]) -> Run {
    let output: Output = Command::new(env!("CARGO_BIN_EXE_host-sim")).args(words).current_dir(folder).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    Run { code: output.status.code().unwrap_or(-1), stdout: text(output.stdout), stderr: text(output.stderr) }
}
