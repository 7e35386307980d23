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

/// Compares as [`compare`] does, but the whole numbers in one column of a table may differ by a relative tolerance.
///
/// # Errors
/// With every line that differs by more.
pub fn compare_within(name: &str, text: &str, column: usize, tolerance: f64) -> Result<()> {
    if updating() {
        return compare(name, text);
    }
    let golden = read(name)?;
    let line = |(golden, found)| if alike(golden, found, column, tolerance) { golden } else { found };
    let settled: Vec<&str> =
        golden.lines().zip(text.lines()).map(line).chain(text.lines().skip(golden.lines().count())).collect();
    compare(name, &(settled.join("\n") + "\n"))
}

/// Whether two lines differ in nothing but a whole number in a column, by a relative tolerance at most.
fn alike(golden: &str, found: &str, column: usize, tolerance: f64) -> bool {
    let [golden, found]: [Vec<&str>; 2] = [golden, found].map(|line| line.split_whitespace().collect());
    let same = |index| golden[index] == found[index] || index == column && near(golden[index], found[index], tolerance);
    golden.len() == found.len() && (0..golden.len()).all(same)
}

/// Whether two whole numbers differ by a relative tolerance at most.
pub fn near(golden: &str, found: &str, tolerance: f64) -> bool {
    match [golden, found].map(str::parse::<u32>) {
        [Ok(golden), Ok(found)] => f64::from(golden.abs_diff(found)) <= tolerance * f64::from(golden),
        _ => false,
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
    fn one_column_may_differ_a_little() {
        assert!(alike("net  kernel 10000 x", "net kernel 10001 x", 2, 1e-4));
        for other in ["net kernel 10002 x", "net kernel 10001 y", "net kernel 10001", "net kernels 10000 x"] {
            assert!(!alike("net kernel 10000 x", other, 2, 1e-4), "{other}");
        }
        assert!(!alike("net kernel 10000 x", "net kernel 10001 x", 1, 1e-4));
    }

    #[test]
    fn differences_show_both_sides() {
        assert_eq!(differences("a\nb\n", "a\nc\n"), "- b\n+ c\n");
        assert_eq!(differences("a\n", "a\n"), "");
        assert!(!differences("a\nb\n", "b\na\n").is_empty());
    }
}
