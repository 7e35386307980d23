//! Any calls to an add-on, in any order; its references stay within their bounds.
#![no_main]

use impromptu_tests::calls;
use libfuzzer_sys::{Corpus, fuzz_target};

fuzz_target!(|bytes: &[u8]| -> Corpus {
    calls::survive(bytes);
    Corpus::Keep
});
