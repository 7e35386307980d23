//! A whole network out of its model file, row after row.

use core::{
    hint::black_box,
    sync::atomic::{Ordering, compiler_fence},
};

use embedded_io::{Read, Write};
use impromptu_firmware::{
    model::{DEFAULT_OUTPUTS, MAX_FEATURES, Model},
    network::{Network, Scratch},
};

use crate::case::{Failure, Memory, TOO_LARGE, read_file, read_words, write_words};

/// Loads the model and evaluates its rows: `[rows, inputs, outputs, bytes of the file]`.
#[inline(never)]
pub(crate) fn run<const WORDS: usize>(
    [rows, inputs, results, length]: [usize; 4],
    cases: &mut impl Read,
    answers: &mut impl Write,
    memory: &mut Memory<WORDS>,
    mark: &impl Fn(),
) -> Result<(), Failure> {
    let file = read_file(cases, &mut memory.bulk, length)?;
    let mut place: Model<'_> = Model::EMPTY;
    let model = Model::load_into(&mut place, file, &mut memory.scratch).map_err(|_| Failure("a model file is refused"))?;
    let network = model.network().ok_or(Failure("a model file has no network"))?;
    let (mut row, mut result) = ([0.0; MAX_FEATURES], [0.0; DEFAULT_OUTPUTS]);
    let (Some(row), Some(result)) = (row.get_mut(..inputs), result.get_mut(..results)) else { return Err(TOO_LARGE) };
    for _ in 0..rows {
        let words = memory.inputs.get_mut(..inputs).ok_or(TOO_LARGE)?;
        read_words(cases, words)?;
        for (value, word) in row.iter_mut().zip(words) {
            *value = f32::from_bits(*word);
        }
        evaluate(network, row, result, &mut memory.scratch, mark);
        let [words, _] = &mut memory.outputs;
        for (word, value) in words.iter_mut().zip(result.iter()) {
            *word = value.to_bits();
        }
        write_words(answers, words.get(..results).ok_or(TOO_LARGE)?)?;
    }
    Ok(())
}

/// Evaluates between two marks; a function of its own, so that its call is a part of the price.
#[inline(never)]
fn evaluate(network: &Network<'_>, inputs: &[f32], outputs: &mut [f32], scratch: &mut Scratch, mark: &impl Fn()) {
    let network = black_box(network);
    compiler_fence(Ordering::SeqCst);
    mark();
    network.evaluate(inputs, outputs, scratch);
    mark();
    compiler_fence(Ordering::SeqCst);
}
