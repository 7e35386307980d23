//! Bytes to and from the firmware.

use std::{io, time::Duration};

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
