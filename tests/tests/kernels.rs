//! The kernels in assembly give the bits of the portable twin, on the emulated processor and on this machine: random shapes,
//! extreme weights, accumulators that wrap, codes that saturate, streams that are not aligned.

use std::{fs, path::PathBuf, time::Duration};

use impromptu_firmware::network::{
    ROWS,
    kernel::{Finish, Width, float_rows, portable},
};
use impromptu_tests::emulator::{FIRMWARE, build_firmware, run};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

const CASES: usize = 600;

/// One case for the board, and what this machine computes.
struct Case {
    header: [u32; 8],
    inputs: Vec<u32>,
    stream: Vec<u32>,
    expected: Vec<u32>,
}

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

fn case(random: &mut Xoshiro256PlusPlus) -> Case {
    let kind = random.random_range(0..3u32);
    let offset = if random.random_range(0..8) == 0 { random.random_range(1..4u32) } else { 0 };
    if kind == 2 {
        return float_case(random, offset);
    }
    let (width, finish) = (if kind == 0 { Width::Int8 } else { Width::Int16 }, random.random_range(0..4u32));
    let (words, blocks) = (2 * random.random_range(1..=34usize), random.random_range(1..=6usize));
    let limit = [32_767, 2_047, 1, random.random_range(1..=32_767u32)][random.random_range(0..4usize)];
    let extreme = random.random::<bool>();
    let inputs = (0..words).map(|_| bytes(random, extreme)).collect::<Vec<_>>();
    let mut stream = Vec::new();
    for _ in 0..blocks {
        stream.extend((0..ROWS).map(|_| random.random::<u32>() as i32 >> random.random_range(0..24u32)).map(|bias| bias as u32));
        stream.extend((0..width.words() * words).map(|_| bytes(random, extreme)));
        // From multipliers that leave nothing to those that saturate everything, of either sign.
        stream.extend((0..ROWS).map(|_| (random.random::<u32>() as i32 >> random.random_range(0..31u32)) as u32));
    }
    let whole = limit as u16;
    let finishes = [Finish::Codes { limit: whole }, Finish::Tanh { limit: whole }, Finish::Sums, Finish::Linear { limit: whole }];
    let finish_now = finishes[finish as usize];
    let mut expected = vec![0xdead_beef; blocks * finish_now.words()];
    portable::integer(width, &little_endian(&stream), &inputs, finish_now, &mut expected);
    let header = [kind, words as u32, expected.len() as u32, finish, limit, stream.len() as u32, offset, 0];
    Case { header, inputs, stream, expected }
}

fn float_case(random: &mut Xoshiro256PlusPlus, offset: u32) -> Case {
    let most = if random.random::<bool>() { 8 } else { 60 };
    let (words, rows) = (2 * random.random_range(1..=34usize), float_rows(random.random_range(1..=most)));
    let finish = random.random_range(0..3u32);
    // Normal numbers of very different size, and zeros of both signs.
    let mut number = || match random.random_range(0..20) {
        0 => 0.0f32,
        1 => -0.0,
        _ => random.random_range(-1.0f32..1.0) * f32::powi(2.0, random.random_range(-20..20)),
    };
    let inputs: Vec<u32> = (0..words).map(|_| number().to_bits()).collect();
    let stream: Vec<u32> = (0..rows * (1 + words)).map(|_| number().to_bits()).collect();
    let mut expected = vec![0xdead_beef; rows];
    portable::float(&little_endian(&stream), &inputs, finish == 1, &mut expected);
    if finish == 2 {
        portable::tanh(&mut expected);
    }
    let header = [2, words as u32, rows as u32, finish, 0, stream.len() as u32, offset, 0];
    Case { header, inputs, stream, expected }
}

fn little_endian(words: &[u32]) -> Vec<[u8; 4]> {
    words.iter().map(|word| word.to_le_bytes()).collect()
}

#[test]
fn assembly_and_twin_give_the_same_bits_on_the_board_and_here() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(8);
    let cases: Vec<Case> = (0..CASES).map(|_| case(&mut random)).collect();
    let words = cases.iter().flat_map(|case| case.header.iter().chain(&case.inputs).chain(&case.stream));
    let mut file: Vec<u8> = words.flat_map(|word| word.to_le_bytes()).collect();
    file.extend([9u32, 0, 0, 0, 0, 0, 0, 0].iter().flat_map(|word| word.to_le_bytes()));
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("kernels");
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("cases.bin"), file).unwrap();
    let elf = build_firmware("impromptu-board", "kernels", FIRMWARE, &[]).unwrap();
    let output = run(&elf, &folder, Duration::from_secs(120)).unwrap();
    let report = output.report().unwrap();
    let unaligned = cases.iter().filter(|case| case.header[6] > 0).count();
    assert!(unaligned > CASES / 20);
    assert_eq!(
        report,
        serde_json::json!({ "kernel": "Cortex-M4 assembly", "cases": CASES, "different": 0, "unaligned": unaligned })
    );
    let found = fs::read(folder.join("outputs.bin")).unwrap();
    let mut found = found.as_chunks().0.iter().map(|bytes| u32::from_le_bytes(*bytes));
    for case in &cases {
        let words: Vec<u32> = found.by_ref().take(case.expected.len()).collect();
        assert_eq!(words, case.expected, "{:?}", case.header);
    }
    assert_eq!(found.next(), None);
}
