//! Damaged files: what a cable, a flash page or a wrong copy does.

use impromptu_firmware::{
    model::{DEFAULT_OUTPUTS, Model, Refusal, file},
    network::Scratch,
};
use impromptu_model_export::Precision;
use proptest::prelude::*;

use crate::fixture::{assembled, sealed, small_model};

#[test]
fn a_valid_file_loads() {
    for precision in [Precision::Float, Precision::Int8] {
        let bytes = small_model(precision);
        let model = Model::from_bytes(&bytes).unwrap();
        assert!(model.network().is_some() && model.feedback().is_some());
        assert_eq!(model.card().probes.count, 4);
    }
}

#[test]
fn truncated_at_every_length_is_refused() {
    let bytes = small_model(Precision::Int8);
    for length in 0..bytes.len() {
        let refusal = Model::from_bytes(&bytes[..length]).unwrap_err();
        if length < file::HEADER {
            assert_eq!(refusal, Refusal::TooShort { found: length });
        } else {
            assert_eq!(refusal, Refusal::Length { expected: bytes.len() as u64, found: length });
            assert!(refusal.to_string().contains("truncated"));
        }
    }
}

#[test]
fn every_single_flipped_bit_is_refused() {
    let mut bytes = small_model(Precision::Int8);
    for bit in 0..bytes.len() * 8 {
        bytes[bit / 8] ^= 1 << (bit % 8);
        let refusal = Model::from_bytes(&bytes).unwrap_err();
        match bit / 8 {
            0..8 => assert_eq!(refusal, Refusal::NotAModel),
            // One bit makes the second version the third.
            8 if bit % 8 == 0 => assert!(matches!(refusal, Refusal::Checksum { .. })),
            8..10 => assert!(matches!(refusal, Refusal::Version { .. })),
            12..20 => assert!(matches!(
                refusal,
                Refusal::Length { .. } | Refusal::Shape { what: "file length", .. } | Refusal::Checksum { .. }
            )),
            20..24 | 32.. => assert!(matches!(refusal, Refusal::Checksum { .. }), "byte {}: {refusal}", bit / 8),
            _ => assert_eq!(refusal, Refusal::Value { what: "reserved part of the header" }),
        }
        bytes[bit / 8] ^= 1 << (bit % 8);
    }
    assert!(Model::from_bytes(&bytes).is_ok());
}

#[test]
fn wrong_header_is_named() {
    let good = small_model(Precision::Int8);
    let refusal = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = good.clone();
        change(&mut bytes);
        Model::from_bytes(&sealed(bytes)).unwrap_err()
    };
    assert_eq!(refusal(&|bytes| bytes[0] = b'i'), Refusal::NotAModel);
    let version = refusal(&|bytes| bytes[8] = 1);
    assert_eq!(version, Refusal::Version { found: 1, expected: file::VERSION });
    assert!(version.to_string().contains("format version 1, this build reads 2 to 3"));
    assert_eq!(refusal(&|bytes| bytes[30] = 1), Refusal::Value { what: "reserved part of the header" });
    let trailing = refusal(&|bytes| bytes.push(0));
    assert_eq!(trailing, Refusal::Length { expected: good.len() as u64, found: good.len() + 1 });
    assert!(trailing.to_string().contains("trailing bytes"));
}

#[test]
fn an_oversized_file_is_refused() {
    let (card, blob) = (vec![0; 16], vec![0; file::MAX_FILE]);
    let refusal = Model::from_bytes(&assembled(&card, &blob)).map(|_| ()).unwrap_err();
    let found = (file::HEADER + 16 + file::MAX_FILE) as u32;
    assert_eq!(refusal, Refusal::Shape { what: "file length", found, limit: file::MAX_FILE as u32 });
    // Lengths whose sum would wrap in 32 bits.
    let mut header = file::header(file::VERSION, u32::MAX, u32::MAX).to_vec();
    header.resize(64, 0);
    assert!(matches!(Model::from_bytes(&sealed(header)).unwrap_err(), Refusal::Shape { what: "file length", .. }));
}

/// Loads, and flies what loads.
fn load(bytes: &[u8]) {
    let Ok(model) = Model::from_bytes(bytes) else { return };
    let _ = model.card().preview_span();
    let mut outputs = [0.0; DEFAULT_OUTPUTS];
    for input in [0.0, 1e30, f32::NAN, f32::NEG_INFINITY] {
        if let Some(network) = model.network() {
            network.evaluate(&[input; 3], &mut outputs, &mut Scratch::new());
        }
    }
    if let Some(lane) = model.feedback() {
        let _ = impromptu_firmware::feedback::probe(lane, 1.0);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        load(&bytes);
    }

    #[test]
    fn arbitrary_cards_never_panic(
        card in proptest::collection::vec(any::<u8>(), 0..300),
        blob in proptest::collection::vec(any::<u8>(), 0..64),
    ) {
        load(&assembled(&card, &blob));
    }

    /// A valid file with bytes changed, cut or repeated, and the check sum of the result.
    #[test]
    fn mutated_files_never_panic(
        int8 in any::<bool>(),
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        card_only in any::<bool>(),
        cut in proptest::option::of((any::<prop::sample::Index>(), 1usize..40)),
    ) {
        let bytes = small_model(if int8 { Precision::Int8 } else { Precision::Float });
        let (card, blob) = file::split(&bytes).unwrap();
        let (mut card, mut blob) = (card.to_vec(), blob.to_vec());
        for (at, value) in changes {
            let part = if card_only { &mut card } else { &mut blob };
            let at = at.index(part.len());
            part[at] = value;
        }
        if let Some((at, count)) = cut {
            let at = at.index(card.len());
            card.drain(at..(at + count).min(card.len()));
        }
        load(&assembled(&card, &blob));
    }
}
