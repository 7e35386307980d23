//! Over the emulated serial port.

use std::{
    io::{self, ErrorKind, Read, Write},
    os::unix::net::UnixStream,
    path::Path,
    thread,
    time::{Duration, Instant},
};

use crate::line::Line;

/// The emulated serial port as a socket.
#[derive(Debug)]
pub(crate) struct Serial {
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
