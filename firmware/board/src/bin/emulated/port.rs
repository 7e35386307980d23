//! The link's bytes: in lockstep with the host, or over the serial port.
//!
//! **Lockstep** (`to_firmware` and `from_firmware` are in the emulator's folder, as FIFOs): in each control tick the firmware reads one batch
//! and writes one, each a length (u32, little-endian) and so many bytes. Semihosting takes no virtual time: for the firmware the plant is
//! a peripheral that answers at once, and every run is the same. A length of 2^32 - 1 ends the flight.
//!
//! **Serial** (else): USART1. A tick is flown when a new attitude has arrived.

use impromptu_firmware::exchange::ByteRing;
use semihosting::{
    fs::File,
    io::{Read, Write},
    process,
};
use stm32f4::stm32f405::USART1;

/// Length of a batch that ends the flight.
const END: u32 = u32::MAX;

/// How bytes come and go in lockstep.
pub(crate) struct Lockstep {
    from_host: File,
    to_host: File,
}

impl Lockstep {
    /// Opens both FIFOs, if they are there; waits until the host has opened the first for writing.
    pub(crate) fn open() -> Option<Self> {
        let from_host = File::open(c"to_firmware").ok()?;
        let to_host = File::create(c"from_firmware").ok()?;
        Some(Self { from_host, to_host })
    }

    /// Gives the bytes of one batch to `on_bytes`, piece by piece.
    pub(crate) fn receive(&mut self, mut on_bytes: impl FnMut(&[u8])) {
        let mut bytes = [0; 256];
        let mut length = [0; 4];
        self.fill(&mut length);
        let mut left = u32::from_le_bytes(length);
        if left == END {
            process::exit(0);
        }
        while left > 0 {
            let Some(piece) = bytes.get_mut(..left.min(256) as usize) else { return };
            self.fill(piece);
            on_bytes(piece);
            left -= piece.len() as u32;
        }
    }

    /// Writes one batch.
    pub(crate) fn send(&mut self, bytes: &[u8]) {
        let length = (bytes.len() as u32).to_le_bytes();
        if self.to_host.write_all(&length).and_then(|()| self.to_host.write_all(bytes)).is_err() {
            process::exit(2);
        }
    }

    /// Reads exactly so many bytes; a host that is gone ends the flight.
    fn fill(&mut self, bytes: &mut [u8]) {
        if self.from_host.read_exact(bytes).is_err() {
            process::exit(2);
        }
    }
}

/// Turns the serial port on: receiver with interrupt, transmitter.
pub(crate) fn start_serial(port: &USART1) {
    port.cr1().write(|w| w.ue().enabled().re().enabled().te().enabled().rxneie().enabled());
}

/// The byte that the serial port received.
pub(crate) fn read_serial(port: &USART1, received: &ByteRing<2048>) -> Option<u8> {
    let byte = port.dr().read().bits() as u8;
    received.put(byte).then_some(byte)
}

/// Sends bytes over the serial port; QEMU's takes them at once.
pub(crate) fn write_serial(port: &USART1, bytes: &[u8]) {
    for byte in bytes {
        port.dr().write(|w| w.dr().set(u16::from(*byte)));
    }
}
