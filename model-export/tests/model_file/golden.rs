//! The exact bytes of one small model: a change of the format, or of what writes it, is seen here.

use impromptu_firmware::model::{Model, file};
use impromptu_model_export::Precision;

use crate::fixture::small_model;

/// Header and the first bytes of the card, 16 to a line.
fn hexadecimal(bytes: &[u8]) -> Vec<String> {
    bytes.chunks(16).map(|line| line.iter().map(|byte| format!("{byte:02x}")).collect()).collect()
}

#[test]
fn the_format_is_what_it_was() {
    let bytes = small_model(Precision::Int8);
    assert_eq!(
        hexadecimal(&bytes[..64]),
        [
            "494d50524f4d50540100000027010000",
            "240200004cb2af9a0000000000000000",
            "05736d616c6c04636172740000047465",
            "73740700000208706f736974696f6e01",
        ]
    );
    assert_eq!((bytes.len(), Model::from_bytes(&bytes).unwrap().checksum(), file::VERSION), (884, 0x9aaf_b24c, 1));
    let float = small_model(Precision::Float);
    assert_eq!((float.len(), Model::from_bytes(&float).unwrap().checksum()), (964, 0x5afb_da1e));
}
