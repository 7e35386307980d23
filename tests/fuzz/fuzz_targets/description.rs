//! Any text as the description of a loop: it is refused, or it is written as it was read, and has channels or too many of them.
#![no_main]

use impromptu_loops::{LoopDescription, layout::Layout};
use libfuzzer_sys::{Corpus, fuzz_target};

fuzz_target!(|bytes: &[u8]| -> Corpus {
    let Some(described) = std::str::from_utf8(bytes).ok().and_then(|text| LoopDescription::parse(text).ok()) else {
        return Corpus::Keep;
    };
    let again = LoopDescription::parse(&described.to_toml()).expect("what was written is read");
    assert_eq!(again, described);
    let _ = Layout::of(&described);
    Corpus::Keep
});
