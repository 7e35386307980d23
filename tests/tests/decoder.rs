//! The decoder under mutated files on stable Rust; `tests/fuzz` does the same under libFuzzer, which looks where it has not been.

use std::{fs, path::Path};

use impromptu_tests::decoder;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Mutated files in the test.
const FILES: u32 = 250_000;

/// The golden models.
fn seeds() -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/models");
    let mut paths: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| fs::read(path).unwrap()).collect()
}

/// Overwrites, cuts, repeats or copies a few pieces.
fn mutate(generator: &mut Xoshiro256PlusPlus, seeds: &[Vec<u8>]) -> Vec<u8> {
    const WORTHWHILE: [u32; 8] = [0, 1, 0x7f, 0x8000_0000, 0x7fff_ffff, u32::MAX, 0x7fc0_0000, 0x7f7f_ffff];
    let mut bytes = seeds[generator.random_range(0..seeds.len())].clone();
    for _ in 0..generator.random_range(1..6) {
        if bytes.len() < 8 {
            break;
        }
        let at = generator.random_range(0..bytes.len() - 4);
        match generator.random_range(0..6) {
            0 => bytes[at] ^= 1 << generator.random_range(0..8),
            1 => bytes[at] = generator.random(),
            2 => {
                let word = WORTHWHILE[generator.random_range(0..WORTHWHILE.len())];
                bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
            }
            3 => drop(bytes.drain(at..at + generator.random_range(1..5))),
            4 => {
                let piece = bytes[at..at + 4].to_vec();
                bytes.splice(at..at, piece);
            }
            _ => {
                let other = &seeds[generator.random_range(0..seeds.len())];
                let from = generator.random_range(0..other.len() - 4);
                bytes[at..at + 4].copy_from_slice(&other[from..from + 4]);
            }
        }
    }
    bytes
}

/// As many mutated files as asked for.
fn survives(files: u32, seed: u64) {
    let seeds = seeds();
    assert!(seeds.len() >= 2 && seeds.iter().all(|seed| decoder::survive(seed)), "the seeds must load");
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    let loaded = (0..files).filter(|_| decoder::survive(&mutate(&mut generator, &seeds))).count();
    // Not a test of refusals alone: a good part must get through to the arithmetic.
    assert!(loaded > files as usize / 20 && loaded < files as usize, "{loaded} of {files} loaded");
}

#[test]
fn mutated_files_are_refused_or_flown() {
    survives(FILES, 8);
}

#[test]
#[ignore = "long"]
fn long_forty_times_as_many_mutated_files_are_refused_or_flown() {
    survives(40 * FILES, 108);
}
