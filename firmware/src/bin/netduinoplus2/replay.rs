//! Reads the input tick by tick, computes, writes the output and keeps account of the cost.
//!
//! Only one record of each file is in memory at a time, so the length of a run is not limited by the 128 KiB of RAM.

use core::fmt;

use nalgebra::{UnitQuaternion, Vector3};
use semihosting::{
    fs::File,
    io::{Read, Write},
};

use crate::{
    instruments::{InstructionCounter, StackGauge, StageCost},
    rotation,
};

/// Bytes of one input record: body rate x, y, z (rad/s) as little-endian f32.
const INPUT_RECORD: usize = 12;
/// Bytes of one output record: attitude w, x, y, z as little-endian f32.
const OUTPUT_RECORD: usize = 16;

/// Why a run was given up.
pub(crate) enum ReplayError {
    /// The board does not run as it must; what to do.
    Board(&'static str),
    /// A file could not be opened, read or written.
    File(&'static str, semihosting::io::Error),
    /// The length of the input is not a multiple of a record.
    Length(u64),
}

impl fmt::Display for ReplayError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Board(reason) => formatter.write_str(reason),
            Self::File(name, error) => {
                write!(formatter, "{name} in the folder where the emulator was started: {error}")
            }
            Self::Length(length) => write!(formatter, "input.bin has {length} bytes, not a multiple of {INPUT_RECORD}"),
        }
    }
}

/// What a run cost; displayed as a JSON object.
pub(crate) struct Report {
    ticks: u64,
    step: StageCost,
    stack_used: u32,
    stack_size: u32,
}

impl fmt::Display for Report {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { ticks, step, stack_used, stack_size } = self;
        write!(
            formatter,
            "{{\"board\":\"netduinoplus2\",\"ticks\":{ticks},\"instructions\":{{\"step\":{step}}},\
             \"stack_used_bytes\":{stack_used},\"stack_size_bytes\":{stack_size}}}"
        )
    }
}

/// Replays `input.bin` into `output.bin`.
pub(crate) fn run() -> Result<Report, ReplayError> {
    let counter = InstructionCounter::new().map_err(ReplayError::Board)?;
    let mut input = File::open(c"input.bin").map_err(|error| ReplayError::File("input.bin", error))?;
    let length = input.metadata().map_err(|error| ReplayError::File("input.bin", error))?.len();
    if length % INPUT_RECORD as u64 != 0 {
        return Err(ReplayError::Length(length));
    }
    let ticks = length / INPUT_RECORD as u64;
    let mut output = File::create(c"output.bin").map_err(|error| ReplayError::File("output.bin", error))?;

    let stack = StackGauge::paint();
    let mut attitude = UnitQuaternion::identity();
    let mut step = StageCost::default();
    for _ in 0..ticks {
        let mut record = [0; INPUT_RECORD];
        input.read_exact(&mut record).map_err(|error| ReplayError::File("input.bin", error))?;
        let rate = Vector3::from(floats(&record));
        let instructions;
        (attitude, instructions) = counter.measure(|| rotation::step(&attitude, &rate));
        step.add(instructions);

        let [x, y, z, w] = attitude.coords.into();
        let mut record = [0; OUTPUT_RECORD];
        for (bytes, value) in record.as_chunks_mut().0.iter_mut().zip([w, x, y, z]) {
            *bytes = f32::to_le_bytes(value);
        }
        output.write_all(&record).map_err(|error| ReplayError::File("output.bin", error))?;
    }
    Ok(Report { ticks, step, stack_used: stack.high_water(), stack_size: stack.size() })
}

/// The little-endian numbers of a record.
fn floats<const N: usize>(record: &[u8]) -> [f32; N] {
    let mut values = [0.0; N];
    for (value, bytes) in values.iter_mut().zip(record.as_chunks().0) {
        *value = f32::from_le_bytes(*bytes);
    }
    values
}
