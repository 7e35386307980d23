//! In lockstep: each control tick of the firmware waits for a batch of bytes and answers with one, through two FIFOs.

use std::{
    fs::{File, OpenOptions},
    io::{self, ErrorKind, Read, Write},
    os::unix::fs::OpenOptionsExt,
    path::Path,
    process::Command,
    thread,
    time::{Duration, Instant},
};

use rustix::fs::{OFlags, fcntl_setfl};

use crate::line::Line;

/// Names of the FIFOs in the emulator's folder.
const TO_FIRMWARE: &str = "to_firmware";
const FROM_FIRMWARE: &str = "from_firmware";
/// Length of a batch that ends the flight.
const END: u32 = u32::MAX;

/// Makes the FIFOs of a lockstep line, by the program `mkfifo` of every POSIX system: macOS has no call for it that needs no
/// `unsafe`.
///
/// # Errors
/// If the folder cannot hold them.
pub(super) fn make_fifos(folder: &Path) -> io::Result<()> {
    for name in [TO_FIRMWARE, FROM_FIRMWARE] {
        // Those of an emulator that ended may hold bytes.
        let _ = std::fs::remove_file(folder.join(name));
        let made = Command::new("mkfifo").args(["-m", "600"]).arg(folder.join(name)).output()?;
        if !made.status.success() {
            return Err(io::Error::other(String::from_utf8_lossy(&made.stderr).trim().to_owned()));
        }
    }
    Ok(())
}

/// Each control tick of the firmware waits for a batch and answers with one: a length (u32, little-endian) and so many bytes.
#[derive(Debug)]
pub(crate) struct Lockstep {
    to_firmware: File,
    from_firmware: File,
}

impl Lockstep {
    /// Waits until the firmware opens its ends, or `alive` gives an error.
    ///
    /// # Errors
    /// If the FIFOs cannot be opened in time.
    pub(super) fn open(folder: &Path, patience: Duration, mut alive: impl FnMut() -> io::Result<()>) -> io::Result<Self> {
        let nonblocking = i32::try_from(OFlags::NONBLOCK.bits()).unwrap_or_default();
        let from_firmware = OpenOptions::new().read(true).custom_flags(nonblocking).open(folder.join(FROM_FIRMWARE))?;
        let start = Instant::now();
        let to_firmware = loop {
            match OpenOptions::new().write(true).custom_flags(nonblocking).open(folder.join(TO_FIRMWARE)) {
                Ok(file) => break file,
                // Nobody reads yet.
                Err(error) if error.raw_os_error() == Some(rustix::io::Errno::NXIO.raw_os_error()) => {
                    alive()?;
                    if start.elapsed() > patience {
                        return Err(ErrorKind::TimedOut.into());
                    }
                    thread::sleep(Duration::from_millis(1));
                }
                Err(error) => return Err(error),
            }
        };
        let mut line = Self { to_firmware, from_firmware };
        // A first, empty batch: its answer tells that the firmware has opened the other FIFO too.
        line.to_firmware.write_all(&[0; 4])?;
        let mut first = [0];
        loop {
            match line.from_firmware.read(&mut first) {
                Ok(1) => break,
                // Nobody writes yet, or not yet anything.
                Ok(_) => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                Err(error) => return Err(error),
            }
            alive()?;
            if start.elapsed() > patience {
                return Err(ErrorKind::TimedOut.into());
            }
            thread::sleep(Duration::from_millis(1));
        }
        for file in [&line.to_firmware, &line.from_firmware] {
            fcntl_setfl(file, OFlags::empty())?;
        }
        let [second, third, fourth] = line.take()?;
        let rest = u32::from_le_bytes([first[0], second, third, fourth]);
        let mut answer = vec![0; rest as usize];
        line.from_firmware.read_exact(&mut answer)?;
        Ok(line)
    }

    fn take<const N: usize>(&mut self) -> io::Result<[u8; N]> {
        let mut bytes = [0; N];
        self.from_firmware.read_exact(&mut bytes)?;
        Ok(bytes)
    }
}

impl Line for Lockstep {
    fn exchange(&mut self, bytes: &[u8]) -> io::Result<Vec<u8>> {
        let mut batch = (bytes.len() as u32).to_le_bytes().to_vec();
        batch.extend(bytes);
        self.to_firmware.write_all(&batch)?;
        let mut answer = vec![0; u32::from_le_bytes(self.take()?) as usize];
        self.from_firmware.read_exact(&mut answer)?;
        Ok(answer)
    }

    fn wait(&mut self, _: Duration) -> io::Result<Vec<u8>> {
        Ok(Vec::new())
    }

    fn end(&mut self) {
        // The emulator ends by itself, or is ended.
        let _ = self.to_firmware.write_all(&END.to_le_bytes());
    }
}
