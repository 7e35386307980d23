//! Files that the arguments name, and those beside them.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use impromptu_files::reading;
use impromptu_firmware::model::{file, trailer};

/// A whole file; the error names it.
pub(super) fn read(path: &Path) -> Result<Vec<u8>> {
    reading::read(path, reading::DOCUMENT).with_context(|| path.display().to_string())
}

/// `NAME.safetensors` to `NAME.extension`.
pub(super) fn beside(network: &Path, extension: &str) -> PathBuf {
    network.with_extension(extension)
}

/// A slip such as `--output notes.txt` must not cost the notes.
pub(super) fn refuse_foreign(path: &Path, force: bool) -> Result<()> {
    let is_model = |path: &Path| -> std::io::Result<bool> {
        let mut magic = Vec::new();
        std::io::Read::read_to_end(&mut std::io::Read::take(std::fs::File::open(path)?, 8), &mut magic)?;
        Ok(magic == file::MAGIC)
    };
    // A stream holds nothing that could be lost.
    if !force && path.is_file() && !is_model(path).with_context(|| path.display().to_string())? {
        bail!("{}: exists and is not a model file; give another --output, or --force to replace it", path.display());
    }
    Ok(())
}

/// The model file in bytes that may be signed.
pub(super) fn unsigned(bytes: &[u8]) -> &[u8] {
    trailer::split(bytes).map_or(bytes, |signed| signed.file)
}
