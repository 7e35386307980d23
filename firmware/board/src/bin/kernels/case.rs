//! One case after the other, from the file.
//!
//! A case is eight u32 and data, all little-endian: kind (0: int8, 1: int16, 2: float), words of inputs, words of outputs, finish (integers: 0
//! rectified codes, 1 tanh, 2 sums, 3 linear codes; float: 1 with ReLU, 2 with tanh), largest code, words of the stream, byte offset of the stream from a word, zero; then
//! inputs and stream. Kind 9 ends the file.

use core::fmt;

use impromptu_firmware::network::kernel::{self, Finish, Width, portable};
use semihosting::{
    fs::File,
    io::{Error, Read, Write},
};
use static_cell::StaticCell;

/// Most words of a case's inputs, outputs and stream.
const INPUTS: usize = 256;
const OUTPUTS: usize = 256;
const STREAM: usize = 8192;

/// The memory of a case.
struct Memory {
    inputs: [u32; INPUTS],
    outputs: [[u32; OUTPUTS]; 2],
    /// A word longer, for streams that do not start at one.
    stream: [[u8; 4]; STREAM + 1],
    bytes: [u8; 4 * INPUTS],
}

/// What was run.
#[derive(Default)]
pub(crate) struct Counts {
    cases: u32,
    different: u32,
    unaligned: u32,
}

impl fmt::Display for Counts {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cases, different, unaligned } = self;
        let name = kernel::NAME;
        write!(formatter, "{{\"kernel\":\"{name}\",\"cases\":{cases},\"different\":{different},\"unaligned\":{unaligned}}}")
    }
}

/// Runs all cases.
pub(crate) fn run() -> Result<Counts, Error> {
    static PLACE: StaticCell<Memory> = StaticCell::new();
    let memory = PLACE.init_with(|| Memory {
        inputs: [0; INPUTS],
        outputs: [[0; OUTPUTS]; 2],
        stream: [[0; 4]; STREAM + 1],
        bytes: [0; 4 * INPUTS],
    });
    let (mut cases, mut answers) = (File::open(c"cases.bin")?, File::create(c"outputs.bin")?);
    let mut counts = Counts::default();
    loop {
        let mut header = [0; 32];
        cases.read_exact(&mut header)?;
        let mut fields = [0; 8];
        words(&header, &mut fields);
        let [kind, inputs, outputs, finish, limit, stream, offset, _] = fields.map(|field| field as usize);
        if kind == 9 {
            return Ok(counts);
        }
        let too_long = inputs > INPUTS || outputs > OUTPUTS || stream > STREAM || offset > 3;
        if too_long {
            return Err(semihosting::io::ErrorKind::InvalidData.into());
        }
        let inputs = &mut memory.inputs[..inputs];
        cases.read_exact(&mut memory.bytes[..4 * inputs.len()])?;
        words(&memory.bytes, inputs);
        let place = &mut memory.stream.as_flattened_mut()[offset..][..4 * stream];
        cases.read_exact(place)?;
        let stream = place.as_chunks::<4>().0;
        let [found, twin] = memory.outputs.each_mut().map(|words| &mut words[..outputs]);
        // What a kernel does not write is seen too.
        found.fill(0xdead_beef);
        twin.fill(0xdead_beef);
        if kind == 2 {
            kernel::Float::new(stream, inputs.len() as u16, finish == 1, found.len() as u16).run(inputs, found);
            portable::float(stream, inputs, finish == 1, twin);
            if finish == 2 {
                kernel::tanh(found);
                portable::tanh(twin);
            }
        } else {
            let width = if kind == 0 { Width::Int8 } else { Width::Int16 };
            let finish = match finish {
                0 => Finish::Codes { limit: limit as u16 },
                1 => Finish::Tanh { limit: limit as u16 },
                2 => Finish::Sums,
                _ => Finish::Linear { limit: limit as u16 },
            };
            kernel::Integer::new(width, stream, inputs.len(), finish).run(inputs, found);
            portable::integer(width, stream, inputs, finish, twin);
        }
        counts.cases += 1;
        counts.different += u32::from(found != twin);
        counts.unaligned += u32::from(!stream.as_ptr().addr().is_multiple_of(4));
        for word in found {
            answers.write_all(&word.to_le_bytes())?;
        }
    }
}

/// Little-endian words of bytes.
fn words(bytes: &[u8], words: &mut [u32]) {
    for (word, bytes) in words.iter_mut().zip(bytes.as_chunks().0) {
        *word = u32::from_le_bytes(*bytes);
    }
}
