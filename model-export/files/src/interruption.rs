//! What is removed when a signal ends the program.
//!
//! *in* temporary files and folders while they exist; *out* none of them after Ctrl-C, SIGTERM or SIGHUP, and the end that the
//! signal stands for; *never* an end in the middle of a set of files that take their places: it waits for the last of them.
//! What SIGKILL or a power cut leaves is a hidden file that nothing reads.

use std::{
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
};

static TEMPORARY: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Holds an interruption off as long as it lives, and knows what is temporary.
pub(crate) struct Held(MutexGuard<'static, Vec<PathBuf>>);

/// Holds an interruption off.
pub(crate) fn hold() -> Held {
    Held(TEMPORARY.lock().unwrap_or_else(PoisonError::into_inner))
}

impl Held {
    pub(crate) fn add(&mut self, path: &Path) {
        self.0.push(path.to_owned());
    }

    pub(crate) fn remove(&mut self, path: &Path) {
        self.0.retain(|known| known != path);
    }
}

/// A folder that is removed at the end, and by an interruption.
#[derive(Debug)]
pub struct TemporaryFolder(tempfile::TempDir);

impl TemporaryFolder {
    /// A new folder where the system keeps such.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn new() -> std::io::Result<Self> {
        let mut held = hold();
        let folder = tempfile::Builder::new().prefix("impromptu-").tempdir()?;
        held.add(folder.path());
        Ok(Self(folder))
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        self.0.path()
    }
}

impl Drop for TemporaryFolder {
    fn drop(&mut self) {
        hold().remove(self.0.path());
    }
}

/// From now on an interruption removes what is temporary before it ends the program. A program calls it once, at its start.
///
/// # Errors
/// If the system refuses; the program can go on, it then only leaves its temporary files behind.
#[cfg(unix)]
pub fn clean_up_when_interrupted() -> std::io::Result<()> {
    use signal_hook::{
        consts::{SIGHUP, SIGINT, SIGTERM},
        iterator::Signals,
        low_level::emulate_default_handler,
    };
    let mut signals = Signals::new([SIGHUP, SIGINT, SIGTERM])?;
    std::thread::Builder::new().name("interruption".into()).spawn(move || {
        for signal in signals.forever() {
            // Never given back: nothing temporary is made any more, nothing takes its place.
            let held = hold();
            for path in held.0.iter() {
                // Nothing can be done about what cannot be removed.
                let _ = if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) };
            }
            let _ = emulate_default_handler(signal);
        }
    })?;
    Ok(())
}

/// From now on an interruption removes what is temporary: not on this system.
///
/// # Errors
/// None.
#[cfg(not(unix))]
pub fn clean_up_when_interrupted() -> std::io::Result<()> {
    Ok(())
}
