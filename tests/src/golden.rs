//! Golden texts: results that must not change unnoticed, in `tests/golden/`.
//!
//! Instruction counts, bytes and stacks belong to one compiler, which `rust-toolchain.toml` names and which each text names
//! again: with another one they are compared as well, and differ.

use std::{
    env, fs,
    io::{self, Write},
    path::Path,
};

use anyhow::{Context, Result, bail};

/// Set to 1, it makes the tests rewrite their golden texts instead of comparing them.
pub const UPDATE_VARIABLE: &str = "UPDATE_GOLDEN";

/// Whether the golden texts are to be rewritten.
pub fn updating() -> bool {
    env::var_os(UPDATE_VARIABLE).is_some_and(|value| value == "1")
}

/// Compares `text` with the golden text `name`.
///
/// # Errors
/// With every line that differs.
pub fn compare(name: &str, text: &str) -> Result<()> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden").join(name);
    if updating() {
        return fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()));
    }
    let golden = read(name)?;
    match differences(&golden, text) {
        differences if differences.is_empty() => Ok(()),
        differences => bail!("{} differs; {UPDATE_VARIABLE}=1 accepts the new text:\n{differences}", path.display()),
    }
}

/// The golden text `name`.
///
/// # Errors
/// If there is none.
pub fn read(name: &str) -> Result<String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden").join(name);
    fs::read_to_string(&path).with_context(|| format!("cannot read {}; {UPDATE_VARIABLE}=1 writes it", path.display()))
}

/// Says something on standard error also when the test passes.
pub fn announce(line: &str) {
    // Not `eprintln!`, which the test runner swallows. If nobody listens, nothing is lost.
    let _ = writeln!(io::stderr(), "\n{line}\n");
}

/// Lines that only one of the texts has.
fn differences(golden: &str, found: &str) -> String {
    let only = |sign: char, these: &str, others: &str| -> String {
        these.lines().filter(|line| !others.lines().any(|other| other == *line)).map(|line| format!("{sign} {line}\n")).collect()
    };
    let lines = only('-', golden, found) + &only('+', found, golden);
    if lines.is_empty() && golden != found { "the order of the lines\n".into() } else { lines }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_show_both_sides() {
        assert_eq!(differences("a\nb\n", "a\nc\n"), "- b\n+ c\n");
        assert_eq!(differences("a\n", "a\n"), "");
        assert!(!differences("a\nb\n", "b\na\n").is_empty());
    }
}
