//! Who may store a model: whose key the application trusts, and nobody with an older one.

use ed25519_compact::{KeyPair, Seed};
use impromptu_firmware::{
    format::trailer,
    model::{Refusal, file},
    network::Scratch,
    storage::{Arming, HEADER, Key, RamFlash, Signers, Slot, StorageError, Stored, floor, open},
};
use proptest::prelude::*;

use crate::models::{FLOAT, cart, named};

type Flash = RamFlash<2048>;

const DISARMED: Arming = Arming::Disarmed;

fn key(number: u8) -> KeyPair {
    KeyPair::from_seed(Seed::new([number; 32]))
}

/// The two keys that the vehicle trusts.
fn trusted() -> &'static [Key] {
    Box::leak(Box::new([*key(1).pk, *key(2).pk]))
}

fn signed(file: &[u8], version: u32, by: &KeyPair) -> Vec<u8> {
    let mut bytes = [file, &trailer::signed_part(version, file.len() as u32)].concat();
    bytes.extend(*by.sk.sign(&bytes, None));
    bytes
}

/// Uploads after a restart, with this lowest version of the application's own.
fn upload(slots: &mut [Flash; 2], bytes: &[u8], keys: &'static [Key], own: u32) -> Result<u32, StorageError> {
    let stored = floor([slots[0].bytes(), slots[1].bytes()]);
    let (_, mut uploader) = open(slots, cart);
    uploader.require(Signers { keys, floor: stored.max(own) });
    uploader.begin(DISARMED, bytes.len() as u32, file::checksum(bytes))?;
    uploader.write(DISARMED, 0, bytes)?;
    uploader.commit(DISARMED, &mut Scratch::new(), cart).map(|stored| stored.checksum())
}

fn refused<T>(refusal: Refusal) -> Result<T, StorageError> {
    Err(StorageError::Refused(refusal))
}

#[test]
fn a_model_that_a_trusted_key_has_signed_is_stored_as_the_file_that_it_is() {
    for by in [key(1), key(2)] {
        let mut slots = [Flash::new(), Flash::new()];
        assert_eq!(upload(&mut slots, &signed(FLOAT, 3, &by), trusted(), 0), Ok(file::checksum(FLOAT)));
        assert_eq!(floor([slots[0].bytes(), slots[1].bytes()]), 3);
        assert_eq!(open(&mut slots, cart).0.unwrap().file(), FLOAT);
    }
}

#[test]
fn what_nobody_trusted_has_signed_is_refused_and_nothing_is_lost() {
    let mut slots = [Flash::new(), Flash::new()];
    upload(&mut slots, &signed(FLOAT, 3, &key(1)), trusted(), 0).unwrap();
    let other = named(b"other");
    let mut other_length = signed(&other, 9, &key(1));
    other_length.splice(other.len()..other.len(), [0; 16]);
    for (bytes, keys, refusal) in [
        (other.clone(), trusted(), Refusal::Unsigned),
        (other_length, trusted(), Refusal::Unsigned),
        (signed(&other, 9, &key(3)), trusted(), Refusal::Signature),
        (signed(&other, 9, &key(1)), &[], Refusal::Signature),
        // Another file's signature.
        ([&other[..], &signed(FLOAT, 9, &key(1))[FLOAT.len()..]].concat(), trusted(), Refusal::Signature),
        (signed(&other, 2, &key(1)), trusted(), Refusal::Downgrade { found: 2, floor: 3 }),
        // Keys of small order, under which a signature can be forged.
        (signed(&other, 9, &key(1)), Box::leak(Box::new([[0; 32]])), Refusal::Signature),
    ] {
        assert_eq!(upload(&mut slots, &bytes, keys, 0), refused(refusal), "{refusal}");
        assert_eq!(open(&mut slots, cart).0.unwrap().file(), FLOAT);
        assert_eq!(floor([slots[0].bytes(), slots[1].bytes()]), 3);
    }
    // The words say what to do.
    assert!(Refusal::Unsigned.to_string().contains("model-export sign"));
}

#[test]
fn versions_only_rise() {
    let mut slots = [Flash::new(), Flash::new()];
    let mut put = |version, own| upload(&mut slots, &signed(&named(b"model"), version, &key(1)), trusted(), own).map(drop);
    let downgrade = |found, floor| refused(Refusal::Downgrade { found, floor });
    assert_eq!(put(6, 7), downgrade(6, 7));
    assert_eq!(put(7, 7), Ok(()));
    assert_eq!(put(7, 0), Ok(()), "the same once more");
    assert_eq!(put(12, 0), Ok(()));
    assert_eq!(put(11, 0), downgrade(11, 12));
    assert_eq!(put(7, 0), downgrade(7, 12), "although the other slot held it");
    assert_eq!(put(u32::MAX, 0), Ok(()));
}

#[test]
fn without_keys_asked_for_the_files_are_as_ever() {
    let mut slots = [Flash::new(), Flash::new()];
    for (bytes, stored) in [(FLOAT.to_vec(), true), (signed(&named(b"other"), 1, &key(1)), false)] {
        let (_, mut uploader) = open(&mut slots, cart);
        uploader.begin(DISARMED, bytes.len() as u32, file::checksum(&bytes)).unwrap();
        uploader.write(DISARMED, 0, &bytes).unwrap();
        let outcome = uploader.commit(DISARMED, &mut Scratch::new(), cart).map(drop);
        assert_eq!(outcome.is_ok(), stored);
        assert!(stored || matches!(outcome, Err(StorageError::Refused(Refusal::Length { .. }))));
    }
    assert_eq!(open(&mut slots, cart).0.unwrap().file(), FLOAT);
    assert_eq!(floor([slots[0].bytes(), slots[1].bytes()]), 0);
    assert!(Stored::read(&slots[0].bytes()[..HEADER + FLOAT.len()]).is_ok(), "a slot that the file fills");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]
    /// On any bit of file, trailer and signature.
    #[test]
    fn a_flipped_bit_is_refused(at in any::<prop::sample::Index>(), bit in 0..8, in_trailer: bool) {
        let mut slots = [Flash::new(), Flash::new()];
        let mut bytes = signed(FLOAT, 3, &key(1));
        let from = if in_trailer { FLOAT.len() } else { 0 };
        let at = from + at.index(bytes.len() - from);
        bytes[at] ^= 1_u8 << bit;
        let outcome = upload(&mut slots, &bytes, trusted(), 0);
        prop_assert!(
            matches!(outcome, Err(StorageError::Refused(Refusal::Signature | Refusal::Unsigned))),
            "byte {at}: {outcome:?}"
        );
        prop_assert!(open(&mut slots, cart).0.is_none());
    }
}
