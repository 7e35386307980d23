//! Random layers: extreme weights, accumulators that wrap, codes that saturate, streams that are not aligned.

use impromptu_firmware::network::{
    ROWS,
    kernel::{Finish, Width, float_rows},
};
use impromptu_tests::twins::cases::{Cases, Ending, FloatFinish};
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Words whose bytes are often the largest and the smallest ones.
fn bytes(random: &mut Xoshiro256PlusPlus, extreme: bool) -> u32 {
    let mut byte = || match random.random_range(0..if extreme { 6 } else { 60 }) {
        0 => 0x7f,
        1 => 0x80,
        2 => 0xff,
        3 => 0x00,
        _ => random.random::<u8>(),
    };
    u32::from_le_bytes([byte(), byte(), byte(), byte()])
}

/// Adds one whose stream has at most `room` bytes.
pub(crate) fn add(cases: &mut Cases, random: &mut Xoshiro256PlusPlus, room: usize) {
    loop {
        let kind = random.random_range(0..3u32);
        let offset = if random.random_range(0..8) == 0 { random.random_range(1..4u32) } else { 0 };
        let layer = match kind {
            0 => integer(random, Width::Int8),
            1 => integer(random, Width::Int16),
            _ => float(random),
        };
        if 4 * layer.stream.len() + offset as usize <= room {
            return cases.layer(layer.ending, &layer.inputs, layer.outputs, &layer.stream, offset);
        }
    }
}

struct Layer {
    ending: Ending,
    inputs: Vec<u32>,
    outputs: usize,
    stream: Vec<u32>,
}

fn integer(random: &mut Xoshiro256PlusPlus, width: Width) -> Layer {
    let finish = random.random_range(0..4usize);
    let (words, blocks) = (2 * random.random_range(1..=34usize), random.random_range(1..=6usize));
    let limit = [32_767, 2_047, 1, random.random_range(1..=32_767u16)][random.random_range(0..4usize)];
    let extreme = random.random::<bool>();
    let inputs = (0..words).map(|_| bytes(random, extreme)).collect::<Vec<_>>();
    let mut stream = Vec::new();
    for _ in 0..blocks {
        stream.extend((0..ROWS).map(|_| random.random::<u32>() as i32 >> random.random_range(0..24u32)).map(|bias| bias as u32));
        stream.extend((0..width.words() * words).map(|_| bytes(random, extreme)));
        // From multipliers that leave nothing to those that saturate everything, of either sign.
        stream.extend((0..ROWS).map(|_| (random.random::<u32>() as i32 >> random.random_range(0..31u32)) as u32));
    }
    let finish = [Finish::Codes { limit }, Finish::Tanh { limit }, Finish::Sums, Finish::Linear { limit }][finish];
    Layer { ending: Ending::Integer(width, finish), inputs, outputs: blocks * finish.words(), stream }
}

fn float(random: &mut Xoshiro256PlusPlus) -> Layer {
    let most = if random.random::<bool>() { 8 } else { 60 };
    let (words, rows) = (2 * random.random_range(1..=34usize), float_rows(random.random_range(1..=most)));
    let finish = [FloatFinish::Linear, FloatFinish::Rectified, FloatFinish::Tanh][random.random_range(0..3usize)];
    // Normal numbers of very different size, and zeros of both signs.
    let mut number = || match random.random_range(0..20) {
        0 => 0.0f32,
        1 => -0.0,
        _ => random.random_range(-1.0f32..1.0) * f32::powi(2.0, random.random_range(-20..20)),
    };
    let inputs = (0..words).map(|_| number().to_bits()).collect();
    let stream = (0..rows * (1 + words)).map(|_| number().to_bits()).collect();
    Layer { ending: Ending::Float(finish), inputs, outputs: rows, stream }
}
