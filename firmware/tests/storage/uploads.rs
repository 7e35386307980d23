//! What a peer may send, and what comes of it.

use impromptu_firmware::{
    model::{Model, Refusal, file},
    network::Scratch,
    storage::{Arming, RamFlash, Slot, StorageError, Uploader, open},
};
use proptest::prelude::*;

use crate::models::{FLOAT, INTEGER, anything, cart, named, servo, with_wrong_probe};

type Flash = RamFlash<2048>;

const DISARMED: Arming = Arming::Disarmed;

fn send(uploader: &mut Uploader<&mut Flash>, model: &[u8]) -> Result<u32, StorageError> {
    uploader.begin(DISARMED, model.len() as u32, file::checksum(model))?;
    uploader.write(DISARMED, 0, model)
}

/// Slots of which one holds the float model.
fn with_a_model() -> [Flash; 2] {
    let mut slots = [Flash::new(), Flash::new()];
    let mut uploader = open(&mut slots, anything).1;
    send(&mut uploader, FLOAT).unwrap();
    uploader.commit(DISARMED, &mut Scratch::new(), cart).unwrap();
    slots
}

#[test]
fn a_refused_model_never_displaces_the_good_one() {
    let mut slots = with_a_model();
    type Check = fn(&Model<'_>) -> Result<(), Refusal>;
    let wrong_probe = with_wrong_probe();
    let mut flipped = FLOAT.to_vec();
    flipped[700] ^= 4;
    let cases: [(&[u8], Check); 5] =
        [(INTEGER, servo), (&wrong_probe, anything), (&flipped, anything), (&FLOAT[..1000], anything), (&[], anything)];
    let mut refusals = Vec::new();
    for (bad, check) in cases {
        let (stored, mut uploader) = open(&mut slots, cart);
        assert_eq!(stored.unwrap().file(), FLOAT);
        send(&mut uploader, bad).unwrap();
        match uploader.commit(DISARMED, &mut Scratch::new(), check) {
            Err(StorageError::Refused(refusal)) => refusals.push(refusal),
            other => panic!("{other:?}"),
        }
        assert_eq!(
            uploader.commit(DISARMED, &mut Scratch::new(), anything),
            Err(StorageError::NotBegun),
            "a refused model cannot be committed again"
        );
    }
    assert!(
        matches!(
            refusals[..],
            [
                Refusal::Signal { .. },
                Refusal::Probe { .. },
                Refusal::Checksum { .. },
                Refusal::Length { .. },
                Refusal::TooShort { found: 0 }
            ]
        ),
        "{refusals:?}"
    );
    assert_eq!(open(&mut slots, cart).0.unwrap().file(), FLOAT);
}

#[test]
fn bytes_other_than_announced_are_refused() {
    let mut slots = with_a_model();
    let (_, mut uploader) = open(&mut slots, anything);
    let announced = file::checksum(INTEGER);
    uploader.begin(DISARMED, FLOAT.len() as u32, announced).unwrap();
    uploader.write(DISARMED, 0, FLOAT).unwrap();
    let computed = file::checksum(FLOAT);
    assert_eq!(uploader.commit(DISARMED, &mut Scratch::new(), anything), Err(StorageError::Checksum { announced, computed }));
}

#[test]
fn nothing_is_written_while_armed() {
    let mut slots = with_a_model();
    let before = slots.each_ref().map(|slot| slot.bytes().to_vec());
    let (_, mut uploader) = open(&mut slots, anything);
    assert_eq!(uploader.begin(Arming::Armed, 900, 1), Err(StorageError::Armed));
    assert_eq!(slots.each_ref().map(|slot| slot.bytes().to_vec()), before);

    let (_, mut uploader) = open(&mut slots, anything);
    uploader.begin(DISARMED, INTEGER.len() as u32, file::checksum(INTEGER)).unwrap();
    assert_eq!(uploader.write(Arming::Armed, 0, INTEGER), Err(StorageError::Armed));
    assert_eq!(uploader.write(DISARMED, 0, INTEGER), Ok(INTEGER.len() as u32), "disarmed again, the upload goes on");
    assert_eq!(uploader.commit(Arming::Armed, &mut Scratch::new(), anything), Err(StorageError::Armed));
    assert_eq!(uploader.commit(DISARMED, &mut Scratch::new(), anything).unwrap().file(), INTEGER);
}

#[test]
fn gaps_overruns_and_early_commits_name_what_is_expected_and_the_upload_goes_on() {
    let mut slots = [Flash::new(), Flash::new()];
    let (_, mut uploader) = open(&mut slots, anything);
    let length = INTEGER.len() as u32;
    assert_eq!(uploader.write(DISARMED, 0, INTEGER), Err(StorageError::NotBegun));
    assert_eq!(uploader.begin(DISARMED, 2017, 0), Err(StorageError::TooLong { length: 2017, room: 2016 }));
    assert_eq!(uploader.begin(DISARMED, u32::MAX, 0), Err(StorageError::TooLong { length: u32::MAX, room: 2016 }));
    uploader.begin(DISARMED, length, file::checksum(INTEGER)).unwrap();
    assert_eq!(uploader.write(DISARMED, 1, &INTEGER[1..]), Err(StorageError::Gap { expected: 0, found: 1 }));
    assert_eq!(uploader.write(DISARMED, 0, &INTEGER[..100]), Ok(100));
    assert_eq!(uploader.write(DISARMED, 0, FLOAT), Err(StorageError::Overrun { end: FLOAT.len() as u64, length }));
    assert_eq!(uploader.commit(DISARMED, &mut Scratch::new(), anything), Err(StorageError::Incomplete { received: 100, length }));
    assert_eq!(uploader.begin(DISARMED, length, file::checksum(INTEGER)), Ok(100), "a repeated announcement goes on");
    assert_eq!(uploader.write(DISARMED, 100, &INTEGER[100..]), Ok(length));
    assert_eq!(uploader.commit(DISARMED, &mut Scratch::new(), anything).unwrap().file(), INTEGER);
}

#[test]
fn a_repeated_commit_is_acknowledged_and_another_upload_waits_for_a_restart() {
    let mut slots = with_a_model();
    let (_, mut uploader) = open(&mut slots, anything);
    send(&mut uploader, INTEGER).unwrap();
    let first = uploader.commit(DISARMED, &mut Scratch::new(), anything).unwrap().sequence();
    assert_eq!(uploader.commit(DISARMED, &mut Scratch::new(), servo).unwrap().sequence(), first);
    assert_eq!(send(&mut uploader, FLOAT), Err(StorageError::Restart));
    let third = named(b"third");
    let (stored, mut uploader) = open(&mut slots, anything);
    assert_eq!(stored.unwrap().file(), INTEGER);
    send(&mut uploader, &third).unwrap();
    assert_eq!(uploader.commit(DISARMED, &mut Scratch::new(), anything).unwrap().name(), "third");
}

proptest! {
    #[test]
    fn whatever_the_chunks_the_file_arrives_or_what_is_expected_is_told(
        chunks in prop::collection::vec((0..INTEGER.len(), 0..200usize), 0..60)
    ) {
        let mut slots = [Flash::new(), Flash::new()];
        let (_, mut uploader) = open(&mut slots, anything);
        uploader.begin(DISARMED, INTEGER.len() as u32, file::checksum(INTEGER)).unwrap();
        let mut next = 0;
        for (offset, length) in chunks {
            // Near to what is expected, so that repeated, overlapping and missing chunks are all frequent.
            let offset = if offset % 3 == 0 { offset } else { (next as usize + offset % 64).saturating_sub(32) };
            let offset = offset.min(INTEGER.len());
            let end = (offset + length).min(INTEGER.len());
            match uploader.write(DISARMED, offset as u32, &INTEGER[offset..end]) {
                Ok(expected) => {
                    prop_assert_eq!(expected, next.max(end as u32));
                    next = expected;
                }
                Err(error) => {
                    prop_assert_eq!(error, StorageError::Gap { expected: next, found: offset as u32 });
                    prop_assert!(offset as u32 > next);
                }
            }
        }
        uploader.write(DISARMED, next, &INTEGER[next as usize..]).unwrap();
        prop_assert_eq!(uploader.commit(DISARMED, &mut Scratch::new(), anything).unwrap().file(), INTEGER);
    }
}
