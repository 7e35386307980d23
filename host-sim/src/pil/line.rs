//! Bytes to and from the firmware: in lockstep through two FIFOs, or over the emulated serial port.

use std::{
    fs::{File, OpenOptions},
    io::{self, ErrorKind, Read, Write},
    os::unix::{fs::OpenOptionsExt, net::UnixStream},
    path::Path,
    thread,
    time::{Duration, Instant},
};

use rustix::fs::{CWD, FileType, Mode, OFlags, fcntl_setfl, mknodat};

/// Names of the FIFOs in the emulator's folder.
const TO_FIRMWARE: &str = "to_firmware";
const FROM_FIRMWARE: &str = "from_firmware";
/// Length of a batch that ends the flight.
const END: u32 = u32::MAX;

/// A line to the firmware.
pub trait Line {
    /// Sends bytes and gives those that came back. In lockstep this is one control tick.
    ///
    /// # Errors
    /// If the line broke.
    fn exchange(&mut self, bytes: &[u8]) -> io::Result<Vec<u8>>;

    /// Gives what has come since, for at most `patience`; nothing in lockstep, where all came at once.
    ///
    /// # Errors
    /// If the line broke.
    fn wait(&mut self, patience: Duration) -> io::Result<Vec<u8>>;

    /// Ends the firmware, if the line can.
    fn end(&mut self) {}
}

impl Line for Box<dyn Line> {
    fn exchange(&mut self, bytes: &[u8]) -> io::Result<Vec<u8>> {
        self.as_mut().exchange(bytes)
    }

    fn wait(&mut self, patience: Duration) -> io::Result<Vec<u8>> {
        self.as_mut().wait(patience)
    }

    fn end(&mut self) {
        self.as_mut().end();
    }
}

/// Makes the FIFOs of a lockstep line.
///
/// # Errors
/// If the folder cannot hold them.
pub(super) fn make_fifos(folder: &Path) -> io::Result<()> {
    for name in [TO_FIRMWARE, FROM_FIRMWARE] {
        // Those of an emulator that ended may hold bytes.
        let _ = std::fs::remove_file(folder.join(name));
        mknodat(CWD, folder.join(name), FileType::Fifo, Mode::RUSR | Mode::WUSR, 0)?;
    }
    Ok(())
}

/// Each control tick of the firmware waits for a batch and answers with one: a length (u32, little-endian) and so many bytes.
#[derive(Debug)]
pub struct Lockstep {
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

/// The emulated serial port as a socket.
#[derive(Debug)]
pub struct Serial {
    socket: UnixStream,
}

impl Serial {
    /// Connects to the emulator's socket.
    ///
    /// # Errors
    /// If it does not appear in time, or `alive` gives an error.
    pub(super) fn open(socket: &Path, patience: Duration, mut alive: impl FnMut() -> io::Result<()>) -> io::Result<Self> {
        let start = Instant::now();
        loop {
            match UnixStream::connect(socket) {
                Ok(socket) => return Ok(Self { socket }),
                Err(_) if start.elapsed() < patience => {
                    alive()?;
                    thread::sleep(Duration::from_millis(5));
                }
                Err(error) => return Err(error),
            }
        }
    }
}

impl Line for Serial {
    fn exchange(&mut self, bytes: &[u8]) -> io::Result<Vec<u8>> {
        self.socket.write_all(bytes)?;
        Ok(Vec::new())
    }

    fn wait(&mut self, patience: Duration) -> io::Result<Vec<u8>> {
        self.socket.set_read_timeout(Some(patience))?;
        let mut bytes = vec![0; 4096];
        match self.socket.read(&mut bytes) {
            Ok(0) => Err(ErrorKind::UnexpectedEof.into()),
            Ok(count) => {
                bytes.truncate(count);
                Ok(bytes)
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => Ok(Vec::new()),
            Err(error) => Err(error),
        }
    }
}
