//! The receivers of the link under any bytes on stable Rust; `tests/fuzz` does the same under libFuzzer, which looks where it has
//! not been.

use impromptu_tests::link::{SEPARATOR, survive};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Inputs in the test.
const INPUTS: usize = 100_000;

/// As many inputs as asked for.
fn survives(inputs: usize, seed: u64) {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    let (mut messages, mut delivered) = (0, 0);
    for _ in 0..inputs {
        let mut bytes = Vec::new();
        for _ in 0..generator.random_range(1..5) {
            messages += 1;
            bytes.extend([SEPARATOR, generator.random_range(0..12)]);
            // Much that is small or zero: lengths that fit, numbers that are finite.
            let most = *[1, 4, 0xfe].get(generator.random_range(0..3)).unwrap();
            let length = *[0, 1, 4, 30, 40, 150].get(generator.random_range(0..6)).unwrap();
            bytes.extend((0..length).map(|_| generator.random_range(0..=most)));
        }
        delivered += survive(&bytes);
    }
    // Not a test of refusals alone.
    assert!(delivered > messages / 20 && delivered < messages, "{delivered} of {messages} delivered");
}

#[test]
fn any_bytes_are_refused_or_messages_that_arrive_again() {
    survives(INPUTS, 9);
}

#[test]
#[ignore = "long"]
fn long_forty_times_as_many_bytes_are_refused_or_messages_that_arrive_again() {
    survives(40 * INPUTS, 109);
}
