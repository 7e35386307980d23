//! Files of the host, through semihosting.

use core::fmt;

use embedded_io::{ErrorType, Read, Write};
use impromptu_twins::{Counts, Failure, Memory};
use semihosting::fs::File;

/// Words of a stream or a model file: what the memory of the machine allows.
const WORDS: usize = if cfg!(small) { 1536 } else { 64 * 1024 };

/// A file of the host.
struct HostFile(File);

/// What semihosting says of a failure is not more than that.
#[derive(Debug)]
struct HostError;

impl fmt::Display for HostError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("the host refuses")
    }
}

impl core::error::Error for HostError {}

impl embedded_io::Error for HostError {
    fn kind(&self) -> embedded_io::ErrorKind {
        embedded_io::ErrorKind::Other
    }
}

impl ErrorType for HostFile {
    type Error = HostError;
}

impl Read for HostFile {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, HostError> {
        semihosting::io::Read::read(&mut self.0, bytes).map_err(|_| HostError)
    }
}

impl Write for HostFile {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, HostError> {
        semihosting::io::Write::write(&mut self.0, bytes).map_err(|_| HostError)
    }

    fn flush(&mut self) -> Result<(), HostError> {
        Ok(())
    }
}

/// Runs `cases.bin` into `outputs.bin`, between markers for the instruction counter: SEV, which does nothing on a single core.
pub(crate) fn run() -> Result<Counts, Reason> {
    let mut cases = HostFile(File::open(c"cases.bin").map_err(|_| Reason::File("cannot open cases.bin"))?);
    let mut outputs = HostFile(File::create(c"outputs.bin").map_err(|_| Reason::File("cannot create outputs.bin"))?);
    let mut memory = Memory::<WORDS>::new();
    impromptu_twins::run(&mut cases, &mut outputs, &mut memory, cortex_m::asm::sev).map_err(Reason::Case)
}

/// Why not every case was run.
pub(crate) enum Reason {
    File(&'static str),
    Case(Failure),
}

impl fmt::Display for Reason {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(reason) => formatter.write_str(reason),
            Self::Case(failure) => failure.fmt(formatter),
        }
    }
}
