//! How the emulated board is reached: the kinds of link, and what each needs of the system.
//!
//! *in* the emulator's folder; *out* the emulator's option, then an open line; *never* a silent attempt on a system that has
//! neither FIFOs nor Unix sockets.

use std::{io, path::Path, time::Duration};

use anyhow::Result;
use clap::ValueEnum;

use crate::line::Line;

/// How the firmware is reached.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum LinkKind {
    /// The plant is a peripheral that answers at once: every run is the same.
    #[default]
    Lockstep,
    /// The emulated serial port, as on the vehicle; slow, and not repeatable to the instruction.
    Uart,
}

#[cfg(unix)]
const SOCKET: &str = "serial";

/// Makes what the link needs in the folder, and gives the emulator's option for its serial port.
///
/// # Errors
/// If the folder cannot hold it.
#[cfg(unix)]
pub(crate) fn prepare(link: LinkKind, folder: &Path) -> Result<String> {
    use anyhow::Context as _;
    Ok(match link {
        LinkKind::Lockstep => {
            crate::lockstep::make_fifos(folder).context("cannot make FIFOs")?;
            "none".to_owned()
        }
        LinkKind::Uart => format!("unix:{},server=on,wait=on", folder.join(SOCKET).display()),
    })
}

/// Opens the line to an emulator that was started in the folder, or gives the error of `alive`.
///
/// # Errors
/// If the firmware does not open its end in time.
#[cfg(unix)]
pub(crate) fn open(
    link: LinkKind,
    folder: &Path,
    patience: Duration,
    alive: impl FnMut() -> io::Result<()>,
) -> io::Result<Box<dyn Line>> {
    use crate::{lockstep::Lockstep, serial::Serial};
    Ok(match link {
        LinkKind::Lockstep => Box::new(Lockstep::open(folder, patience, alive)?),
        LinkKind::Uart => Box::new(Serial::open(&folder.join(SOCKET), patience, alive)?),
    })
}

/// What to do on a system without FIFOs and Unix sockets.
#[cfg(not(unix))]
const ELSEWHERE: &str = "processor in the loop reaches the emulator through FIFOs or a Unix socket, which this system has not; \
                         run it on Linux or macOS, or on Windows in its Subsystem for Linux (wsl --install)";

/// Refuses.
///
/// # Errors
/// Always.
#[cfg(not(unix))]
pub(crate) fn prepare(_: LinkKind, _: &Path) -> Result<String> {
    anyhow::bail!(ELSEWHERE)
}

/// Refuses.
///
/// # Errors
/// Always.
#[cfg(not(unix))]
pub(crate) fn open(_: LinkKind, _: &Path, _: Duration, _: impl FnMut() -> io::Result<()>) -> io::Result<Box<dyn Line>> {
    Err(io::Error::new(io::ErrorKind::Unsupported, ELSEWHERE))
}
