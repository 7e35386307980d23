//! Any bytes through the receivers of the link; what is delivered is sent again.
#![no_main]

use impromptu_tests::link;
use libfuzzer_sys::{Corpus, fuzz_target};

fuzz_target!(|bytes: &[u8]| -> Corpus {
    link::survive(bytes);
    Corpus::Keep
});
