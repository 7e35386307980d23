//! What holds for the text of the project, whatever it computes.
//!
//! - [`columns`]: no line and no file too long to read;
//! - [`packages`]: what is published stands on its own.

mod columns;
mod packages;

use std::{
    fs,
    path::{Path, PathBuf},
};

/// The folder of the workspace.
pub(crate) fn workspace() -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).canonicalize().unwrap()
}

/// Files below `folder` whose names end with one of `extensions`, with their text; nothing that was built or only lies about.
pub(crate) fn texts(folder: &Path, extensions: &[&str]) -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
        if path.is_dir() {
            if !["target", "out", "corpus", "artifacts", "coverage", ".git"].contains(&name.as_str()) {
                found.extend(texts(&path, extensions));
            }
        } else if extensions.iter().any(|extension| name.ends_with(extension)) {
            found.push((path.clone(), fs::read_to_string(&path).unwrap()));
        }
    }
    found.sort();
    found
}
