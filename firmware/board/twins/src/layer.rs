//! One layer: by the kernel of this core, and by the portable twin beside it.
//!
//! The header of a case: kind (0: int8, 1: int16, 2: f32), words of inputs, words of outputs, finish (integers: 0 rectified
//! codes, 1 tanh, 2 sums, 3 linear codes; f32: 1 with ReLU, 2 with tanh), largest code, words of the stream, byte offset of the
//! stream from a word, 0.

use embedded_io::{Read, Write};
use impromptu_firmware::network::kernel::{self, Finish, Width, portable};

use crate::case::{Counts, ENDED, Failure, Memory, TOO_LARGE, read_words, write_words};

/// What a case's header says.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layer {
    kind: u32,
    inputs: usize,
    outputs: usize,
    finish: u32,
    limit: u16,
    stream: usize,
    offset: usize,
}

impl Layer {
    /// The layer of a header.
    pub(crate) fn new(kind: u32, [inputs, outputs, finish, limit, stream, offset, _]: [u32; 7]) -> Self {
        let [inputs, outputs, stream, offset] = [inputs, outputs, stream, offset].map(|count| count as usize);
        Self { kind, inputs, outputs, finish, limit: limit as u16, stream, offset }
    }

    /// Reads inputs and stream, runs the layer, writes its outputs.
    pub(crate) fn run<const WORDS: usize>(
        &self,
        cases: &mut impl Read,
        answers: &mut impl Write,
        memory: &mut Memory<WORDS>,
        counts: &mut Counts,
    ) -> Result<(), Failure> {
        let inputs = memory.inputs.get_mut(..self.inputs).ok_or(TOO_LARGE)?;
        read_words(cases, inputs)?;
        let place = memory.bulk.0.as_flattened_mut().get_mut(self.offset..).and_then(|place| place.get_mut(..4 * self.stream));
        let place = place.ok_or(TOO_LARGE)?;
        cases.read_exact(place).map_err(|_| ENDED)?;
        let stream = place.as_chunks::<4>().0;
        let [found, twin] = &mut memory.outputs;
        let (Some(found), Some(twin)) = (found.get_mut(..self.outputs), twin.get_mut(..self.outputs)) else {
            return Err(TOO_LARGE);
        };
        // What a kernel does not write is seen too.
        found.fill(0xdead_beef);
        twin.fill(0xdead_beef);
        if self.kind == 2 {
            let relu = self.finish == 1;
            kernel::Float::new(stream, inputs.len() as u16, relu, found.len() as u16).run(inputs, found);
            portable::float(stream, inputs, relu, twin);
            if self.finish == 2 {
                kernel::tanh(found);
                portable::tanh(twin);
            }
        } else {
            let width = if self.kind == 0 { Width::Int8 } else { Width::Int16 };
            let limit = self.limit;
            let finish = match self.finish {
                0 => Finish::Codes { limit },
                1 => Finish::Tanh { limit },
                2 => Finish::Sums,
                _ => Finish::Linear { limit },
            };
            kernel::Integer::new(width, stream, inputs.len(), finish).run(inputs, found);
            portable::integer(width, stream, inputs, finish, twin);
        }
        counts.different += u32::from(found != twin);
        counts.unaligned += u32::from(!stream.as_ptr().addr().is_multiple_of(4));
        write_words(answers, found)
    }
}
