//! Files with what was learned.
//!
//! *in* a path; *out* its bytes, or a file of them, whole or not at all; *never* a file that is half of one and half of another.

use std::path::Path;

use anyhow::{Context as _, Result};
use impromptu_files::{reading, replacement::replace};

use super::Invocation;

/// What was kept in a file.
pub(super) fn kept(path: &Path) -> Result<Vec<u8>> {
    reading::read(path, reading::DOCUMENT).with_context(|| path.display().to_string())
}

/// Keeps what was learned in a file.
pub(super) fn keep(path: &Path, learned: &[u8], invocation: &Invocation) -> Result<()> {
    replace(path, learned).with_context(|| path.display().to_string())?;
    invocation.console.note(&format!("learned: {}", path.display()));
    Ok(())
}
