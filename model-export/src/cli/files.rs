//! Files that the arguments name, and those beside them.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// A whole file; the error names it.
pub(super) fn read(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).with_context(|| path.display().to_string())
}

/// `NAME.safetensors` to `NAME.extension`.
pub(super) fn beside(network: &Path, extension: &str) -> PathBuf {
    network.with_extension(extension)
}
