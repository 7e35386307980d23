//! Any bytes through the decoder of model files; what loads is flown.
#![no_main]

use impromptu_tests::decoder;
use libfuzzer_sys::{Corpus, fuzz_target};

fuzz_target!(|bytes: &[u8]| -> Corpus {
    decoder::survive(bytes);
    Corpus::Keep
});
