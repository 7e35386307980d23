//! Any settings, states and commands for the flight stack; what it refuses changes nothing.
#![no_main]

use impromptu_tests::settings;
use libfuzzer_sys::{Corpus, fuzz_target};

fuzz_target!(|bytes: &[u8]| -> Corpus {
    settings::survive(bytes);
    Corpus::Keep
});
