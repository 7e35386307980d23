//! Computes on one machine what another computes too, so that their bits can be compared: layers, networks, whole flights,
//! learners.
//!
//! *in* cases, one after the other; *out* the words of their outputs, and how many there were; *never* a judgement whether the
//! outputs are right: the host compares them with its own; *source* this page is the format's specification.
//!
//! A case is a header of eight u32 and data, all little-endian; a model file is filled up to whole words. The header starts with
//! the kind:
//!
//! | kind | the rest of the header | data | outputs |
//! |---|---|---|---|
//! | 0 int8, 1 int16, 2 f32 | as in `layer.rs` | inputs, stream | words of the assembly, where there is one, else of the twin |
//! | 3 network | rows, inputs, outputs, bytes of the model file, zeros | model file, rows of f32 | rows of f32 |
//! | 4 flight | bytes of the model file, zeros | model file, recording ([`impromptu_flight::replay`]) | its answers |
//! | 5 learner | ticks, zeros | as in `learning.rs` | its corrections |
//! | 9 end | zeros | | |
//!
//! # Layers
//! | layer | modules | what they hold |
//! |--:|---|---|
//! | 1 | `case` | memory, numbers, failures |
//! | 2 | `layer`, `network`, `flight`, `learning` | a case of each kind |
#![no_std]

mod case;
mod flight;
mod layer;
mod learning;
mod network;

use embedded_io::{Read, Write};

use case::read_words;
pub use case::{Counts, Failure, Memory};

/// Runs all cases. `mark` is called before and after each evaluation of a network, and each tick of a learner.
///
/// # Errors
/// If the cases cannot be read, do not fit into `memory` or are refused, or the outputs cannot be written.
pub fn run<const WORDS: usize>(
    cases: &mut impl Read,
    outputs: &mut impl Write,
    memory: &mut Memory<WORDS>,
    mark: impl Fn(),
) -> Result<Counts, Failure> {
    let mut counts = Counts::default();
    loop {
        let mut header = [0; 8];
        read_words(cases, &mut header)?;
        match header {
            [kind @ 0..=2, rest @ ..] => {
                layer::Layer::new(kind, rest).run(cases, outputs, memory, &mut counts)?;
            }
            [3, rows, inputs, results, file, ..] => {
                network::run([rows, inputs, results, file].map(|count| count as usize), cases, outputs, memory, &mark)?;
            }
            [4, file, ..] => flight::run(file as usize, cases, outputs, memory)?,
            [5, ticks, ..] => learning::run(ticks, cases, outputs, &mark)?,
            [9, ..] => return Ok(counts),
            _ => return Err(Failure("a case of unknown kind")),
        }
        counts.cases += 1;
    }
}
