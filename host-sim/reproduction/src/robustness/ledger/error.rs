//! Why draws are not written or not merged.

use std::path::PathBuf;

/// Why a file is not gone on with, or files are not merged.
#[derive(Debug, thiserror::Error)]
pub enum LedgerError {
    /// A file cannot be read or written.
    #[error("{}: {source}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A line that no run has written.
    #[error("{}, line {line}: {reason}; give another --out or remove the file", file.display())]
    Damaged {
        /// The file.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong.
        reason: String,
    },
    /// Draws of another run.
    #[error("{}: `{key}` is {found} there and {wanted} here; draws of different runs do not mix: give another --out or the same \
    settings", file.display())]
    Settings {
        /// The file.
        file: PathBuf,
        /// The setting that differs.
        key: String,
        /// Its value in the file.
        found: String,
        /// Its value here, or in the first file of a merge.
        wanted: String,
    },
    /// The same part twice.
    #[error("{} and {} both hold part {part}; give each part once", first.display(), second.display())]
    Duplicate {
        /// The part.
        part: u32,
        /// A file with it.
        first: PathBuf,
        /// Another one.
        second: PathBuf,
    },
    /// Parts that are in no file.
    #[error("of {of} parts these are missing: {missing}; fly them with --shard PART/{of}")]
    Missing {
        /// Number of parts.
        of: u32,
        /// Those missing, separated by commas.
        missing: String,
    },
    /// A part that was not flown to its end.
    #[error("{}: part {part} of {of} holds {found} of its {wanted} draws; the same command with --shard {part}/{of} goes on \
    with it", file.display())]
    Incomplete {
        /// The file.
        file: PathBuf,
        /// The part.
        part: u32,
        /// Number of parts.
        of: u32,
        /// Draws in the file.
        found: usize,
        /// Draws of the part.
        wanted: usize,
    },
    /// Nothing to merge.
    #[error("no files to merge; name the files of all parts")]
    Nothing,
}
