//! Files of others, read within a limit.
//!
//! *in* a path; *out* a regular file of at most so many bytes; *never* an endless device, a folder, a pipe that nobody writes to,
//! or more memory than the limit; *source* none.

use std::{
    fs::File,
    io::{self, Read},
    path::Path,
};

/// Largest table of numbers, bytes: an hour of flight at 1 kHz with all columns is 1.5 GB of text less than half as dense.
pub const TABLE: u64 = 1 << 30;
/// Largest model file, float network or document, bytes.
pub const DOCUMENT: u64 = 256 << 20;
/// Largest file of settings, bytes.
pub const SETTINGS: u64 = 1 << 20;

/// Opens a file that is to be read; what comes from it ends with an error beyond `limit` bytes.
///
/// A pipe that is handed over open (`/dev/stdin`, `/dev/fd/63` of `<(…)`) is read as far as the limit goes; a pipe by name, a
/// device and a folder are refused.
///
/// # Errors
/// If it cannot be opened, is no file, or is larger than the limit.
pub fn open(path: &Path, limit: u64) -> io::Result<Bounded> {
    // Looked at before it is opened: opening a pipe by name waits until somebody writes to it.
    let kind = std::fs::metadata(path)?;
    let handed_over = is_pipe(&kind) && (path.starts_with("/dev") || path.starts_with("/proc/self/fd"));
    if kind.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a folder, give a file"));
    }
    if !kind.is_file() && !handed_over {
        return Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "is no regular file (a device, pipe or socket); copy it to a file first",
        ));
    }
    if kind.is_file() && kind.len() > limit {
        return Err(beyond(limit));
    }
    Ok(Bounded { file: File::open(path)?, left: limit, limit })
}

/// A whole file of at most `limit` bytes.
///
/// # Errors
/// As [`open`].
pub fn read(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path, limit)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// A whole text of at most `limit` bytes.
///
/// # Errors
/// As [`open`], or if it is not UTF-8.
pub fn read_text(path: &Path, limit: u64) -> io::Result<String> {
    let mut text = String::new();
    open(path, limit)?.read_to_string(&mut text)?;
    Ok(text)
}

/// A file that refuses to give more than its limit.
#[derive(Debug)]
pub struct Bounded {
    file: File,
    left: u64,
    limit: u64,
}

impl Read for Bounded {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.left == 0 {
            // The end exactly at the limit is an end.
            return if self.file.read(&mut [0])? == 0 { Ok(0) } else { Err(beyond(self.limit)) };
        }
        let most = usize::try_from(self.left).unwrap_or(usize::MAX).min(buffer.len());
        let count = self.file.read(&mut buffer[..most])?;
        self.left -= count as u64;
        Ok(count)
    }
}

fn beyond(limit: u64) -> io::Error {
    io::Error::new(io::ErrorKind::FileTooLarge, format!("is larger than {} MiB, the most that is read", limit >> 20))
}

#[cfg(unix)]
fn is_pipe(kind: &std::fs::Metadata) -> bool {
    std::os::unix::fs::FileTypeExt::is_fifo(&kind.file_type())
}

#[cfg(not(unix))]
fn is_pipe(_: &std::fs::Metadata) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_up_to_its_limit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        std::fs::write(&path, [7; 100]).unwrap();
        assert_eq!(read(&path, 100).unwrap(), [7; 100]);
        assert!(read(&path, 99).unwrap_err().to_string().contains("larger than"));
        // A file that grows while it is read is bounded as well.
        let mut growing = open(&path, 100).unwrap();
        std::fs::write(&path, [7; 200]).unwrap();
        assert!(growing.read_to_end(&mut Vec::new()).unwrap_err().to_string().contains("larger than"));
        assert!(read(folder.path(), 1).unwrap_err().to_string().contains("folder"));
    }

    #[cfg(unix)]
    #[test]
    fn what_never_ends_or_never_begins_is_refused() {
        for device in ["/dev/zero", "/dev/random", "/dev/full"] {
            assert!(read(Path::new(device), TABLE).unwrap_err().to_string().contains("no regular file"), "{device}");
        }
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        assert!(read(&pipe, TABLE).unwrap_err().to_string().contains("no regular file"));
    }
}
