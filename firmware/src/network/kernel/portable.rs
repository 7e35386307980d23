//! The kernels in safe Rust, for every machine: the definition of the bits that the assembly must give.

use super::stream::{Finish, Width, float_blocks};
use crate::network::{self, ROWS, requantise, tanh_code};

/// The two signed halves of a word, low half first.
#[inline(always)]
pub const fn halves(word: u32) -> [i16; 2] {
    [word as i16, (word >> 16) as i16]
}

/// The weights of a packed byte-wide word: even row, odd row; each for the first and the second input.
#[inline(always)]
pub const fn byte_rows(word: u32) -> [[i16; 2]; 2] {
    [halves(word), halves(word << 8)]
}

/// A word with these halves.
#[inline(always)]
pub const fn pair(low: i16, high: i16) -> u32 {
    low as u16 as u32 | (high as u16 as u32) << 16
}

/// A layer of [`super::Integer`] on any machine: `outputs` are all that it has.
#[inline(never)]
pub fn integer(width: Width, stream: &[[u8; 4]], inputs: &[u32], finish: Finish, outputs: &mut [u32]) {
    let blocks = stream.chunks_exact(width.block(inputs.len()).max(1));
    for (block, outputs) in blocks.zip(outputs.chunks_exact_mut(finish.words())) {
        let Some((bias, rest)) = block.split_first_chunk::<ROWS>() else { return };
        let Some((weights, multipliers)) = rest.split_last_chunk::<ROWS>() else { return };
        let mut sums = bias.map(i32::from_le_bytes);
        match width {
            Width::Int8 => {
                for (words, &input) in weights.as_chunks::<{ ROWS / 2 }>().0.iter().zip(inputs) {
                    for (sums, word) in sums.as_chunks_mut::<2>().0.iter_mut().zip(words) {
                        let rows = byte_rows(u32::from_le_bytes(*word));
                        *sums = [multiply_add(rows[0], input, sums[0]), multiply_add(rows[1], input, sums[1])];
                    }
                }
            }
            Width::Int16 => {
                for (words, &input) in weights.as_chunks::<ROWS>().0.iter().zip(inputs) {
                    for (sum, word) in sums.iter_mut().zip(words) {
                        *sum = multiply_add(halves(u32::from_le_bytes(*word)), input, *sum);
                    }
                }
            }
        }
        let code = |row: usize| match (sums.get(row), multipliers.get(row)) {
            (Some(sum), Some(multiplier)) => requantise(*sum, i32::from_le_bytes(*multiplier)),
            // There are as many as rows: not an index that could panic.
            _ => 0,
        };
        match finish {
            Finish::Codes { limit } => {
                let code = |row| code(row).clamp(0, i32::from(limit)) as i16;
                outputs.iter_mut().enumerate().for_each(|(i, word)| *word = pair(code(2 * i), code(2 * i + 1)));
            }
            Finish::Tanh { limit } => {
                let code = |row| tanh_code(code(row).clamp(i32::from(i16::MIN), i32::from(i16::MAX)) as i16, limit);
                outputs.iter_mut().enumerate().for_each(|(i, word)| *word = pair(code(2 * i), code(2 * i + 1)));
            }
            Finish::Linear { limit } => {
                let code = |row| code(row).clamp(-i32::from(limit), i32::from(limit)) as i16;
                outputs.iter_mut().enumerate().for_each(|(i, word)| *word = pair(code(2 * i), code(2 * i + 1)));
            }
            Finish::Sums => outputs.iter_mut().zip(sums).for_each(|(word, sum)| *word = sum as u32),
        }
    }
}

/// SMLAD: both products of halves, added modulo 2³².
#[inline(always)]
fn multiply_add(weights: [i16; 2], input: u32, sum: i32) -> i32 {
    let codes = halves(input);
    let low = i32::from(weights[0]) * i32::from(codes[0]);
    let high = i32::from(weights[1]) * i32::from(codes[1]);
    sum.wrapping_add(low).wrapping_add(high)
}

/// A layer of [`super::Float`] on any machine: `inputs` and `outputs` are all that it has.
#[inline(never)]
pub fn float(stream: &[[u8; 4]], inputs: &[u32], relu: bool, outputs: &mut [u32]) {
    let Some([twelves, _, sixes]) = float_blocks(outputs.len()) else { return };
    let Some((first, rest)) = outputs.split_at_mut_checked(12 * twelves) else { return };
    let Some((first_stream, rest_stream)) = stream.split_at_checked(12 * twelves * (1 + inputs.len())) else { return };
    float_part::<12>(first_stream, inputs, relu, first);
    if sixes > 0 {
        float_part::<6>(rest_stream, inputs, relu, rest);
    } else {
        float_part::<8>(rest_stream, inputs, relu, rest);
    }
}

/// The blocks of `N` rows.
fn float_part<const N: usize>(stream: &[[u8; 4]], inputs: &[u32], relu: bool, outputs: &mut [u32]) {
    for (block, outputs) in stream.chunks_exact((N * (1 + inputs.len())).max(1)).zip(outputs.as_chunks_mut::<N>().0) {
        let Some((bias, weights)) = block.split_first_chunk::<N>() else { return };
        let mut sums = bias.map(f32::from_le_bytes);
        for (weights, &input) in weights.as_chunks::<N>().0.iter().zip(inputs) {
            let input = f32::from_bits(input);
            for (sum, weight) in sums.iter_mut().zip(weights) {
                *sum += f32::from_le_bytes(*weight) * input;
            }
        }
        *outputs = sums.map(|sum| if relu { rectified(sum.to_bits()) } else { sum.to_bits() });
    }
}

/// Zero if the sign bit is set.
#[inline(always)]
const fn rectified(bits: u32) -> u32 {
    bits & !((bits as i32 >> 31) as u32)
}

/// [`super::tanh`] on any machine.
#[inline(always)]
pub fn tanh(words: &mut [u32]) {
    for word in words {
        *word = network::tanh(f32::from_bits(*word)).to_bits();
    }
}
