//! No line over 130 columns, comments and prose included, and no file of Rust over 400 lines.

use crate::{texts, workspace};

/// Most columns of a line.
const COLUMNS: usize = 130;
/// Most lines of a file.
const LINES: usize = 400;

#[test]
fn no_line_is_too_wide() {
    let top = workspace();
    let mut wide = Vec::new();
    for (path, text) in texts(&top, &[".rs", ".sh", ".toml", ".md"]) {
        let place = path.strip_prefix(&top).unwrap();
        // A row of a table in Markdown cannot be broken.
        let table = |line: &str| path.extension().is_some_and(|extension| extension == "md") && line.starts_with('|');
        for (number, line) in (1..).zip(text.lines()).filter(|(_, line)| line.chars().count() > COLUMNS && !table(line)) {
            wide.push(format!("{}:{number}: {} columns", place.display(), line.chars().count()));
        }
    }
    assert!(wide.is_empty(), "over {COLUMNS} columns:\n{}", wide.join("\n"));
}

#[test]
fn no_file_is_too_long() {
    let top = workspace();
    let files = texts(&top, &[".rs"]);
    assert!(files.len() > 100);
    let long: Vec<String> = files
        .iter()
        .map(|(path, text)| (path.strip_prefix(&top).unwrap(), text.lines().count()))
        .filter(|(_, lines)| *lines > LINES)
        .map(|(path, lines)| format!("{}: {lines} lines", path.display()))
        .collect();
    assert!(long.is_empty(), "over {LINES} lines:\n{}", long.join("\n"));
}
