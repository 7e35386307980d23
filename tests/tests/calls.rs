//! Calls in any order, any settings and commands on stable Rust; `tests/fuzz` does the same under libFuzzer, which looks where it
//! has not been.

use impromptu_tests::{calls, settings};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Inputs in each test.
const INPUTS: usize = 3_000;

/// As many inputs as asked for.
fn inputs(count: usize, seed: u64) -> impl Iterator<Item = Vec<u8>> {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    (0..count).map(move |_| (0..generator.random_range(1..1_500)).map(|_| generator.random()).collect())
}

fn calls_survive(count: usize, seed: u64) {
    let corrected: usize = inputs(count, seed).map(|bytes| calls::survive(&bytes)).sum();
    // Not a test of lanes that are off.
    assert!(corrected > count, "{corrected} references corrected by {count} inputs");
}

fn settings_survive(count: usize, seed: u64) {
    let done = inputs(count, seed).map(|bytes| settings::survive(&bytes));
    let [taken, flown] = done.fold([0; 2], |[a, b], [c, d]| [a + c, b + d]);
    // Nor of motors that are off.
    assert!(taken > count && flown > 10 * count, "{taken} settings taken and {flown} ticks flown by {count} inputs");
}

#[test]
fn any_calls_give_references_within_their_bounds() {
    calls_survive(INPUTS, 10);
}

#[test]
fn any_settings_and_commands_give_motor_commands_or_refusals_that_change_nothing() {
    settings_survive(INPUTS, 11);
}

#[test]
#[ignore = "long"]
fn long_forty_times_as_many_calls_settings_and_commands() {
    calls_survive(40 * INPUTS, 110);
    settings_survive(40 * INPUTS, 111);
}
