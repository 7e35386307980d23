//! Power is lost at every byte of an update.

use std::{cell::RefCell, rc::Rc};

use impromptu_firmware::{
    network::Scratch,
    storage::{self, Arming, Header, Sequence, Slot, StorageError, Uploader},
};
use proptest::prelude::*;

use crate::{
    flash::{CAPACITY, Simulated, Supply},
    models::{FLOAT, INTEGER, anything, named},
};

type Slots<const WRITE: usize, const ERASE: usize> = [Simulated<WRITE, ERASE>; 2];

/// Sends a whole model in chunks that fit no granularity.
fn update<S: Slot>(uploader: &mut Uploader<S>, file: &[u8]) -> Result<(), StorageError> {
    let checksum = impromptu_firmware::model::file::checksum(file);
    let mut next = uploader.begin(Arming::Disarmed, file.len() as u32, checksum)?;
    for chunk in file.chunks(53) {
        next = uploader.write(Arming::Disarmed, next, chunk)?;
    }
    uploader.commit(Arming::Disarmed, &mut Scratch::new(), anything).map(|stored| assert_eq!(stored.file(), file))
}

/// The model that a start finds.
fn boot<const WRITE: usize, const ERASE: usize>(slots: &Slots<WRITE, ERASE>) -> Option<Vec<u8>> {
    storage::survey(slots.each_ref().map(Slot::bytes), &mut Scratch::new(), anything).flies.map(|stored| stored.file().to_vec())
}

/// Slots which hold these models, the number of the first being `sequence`, in turn from slot `first` on.
fn holding<const WRITE: usize, const ERASE: usize>(
    supply: &Rc<RefCell<Supply>>,
    models: &[&[u8]],
    sequence: u32,
    first: usize,
) -> Slots<WRITE, ERASE> {
    let mut slots = [Simulated::new(supply), Simulated::new(supply)];
    for (index, model) in models.iter().enumerate() {
        let checksum = impromptu_firmware::model::file::checksum(model);
        let sequence = Sequence(sequence.wrapping_add(index as u32));
        let mut bytes = Header { sequence, length: model.len() as u32, checksum }.to_bytes().to_vec();
        bytes.extend_from_slice(model);
        slots[(first + index) % 2].plant(&bytes);
    }
    slots
}

/// Cuts the update of slots that hold `models` at each byte; the next start must finish it.
fn cut_everywhere<const WRITE: usize, const ERASE: usize>(models: &[&[u8]], sequence: u32, first: usize, new: &[u8]) {
    let supply = Supply::new();
    let old = models.last().map(|model| model.to_vec());
    let header = CAPACITY + new.len().next_multiple_of(32);
    let (mut found_new, mut cut) = (0, 0);
    loop {
        supply.borrow_mut().restore(None, None, 0);
        let mut slots = holding::<WRITE, ERASE>(&supply, models, sequence, first);
        supply.borrow_mut().restore(Some(cut), None, cut as u64);
        let result = update(&mut storage::open(&mut slots, anything).1, new);
        let found = boot(&slots);
        if result.is_ok() {
            assert_eq!(found.as_deref(), Some(new));
            break;
        }
        assert!(matches!(result, Err(StorageError::Flash { .. })), "cut at {cut}: {result:?}");
        if cut < header {
            assert_eq!(found, old, "cut at {cut}, before the header");
        } else {
            assert!(found == old || found.as_deref() == Some(new), "cut at {cut}, in the header");
            found_new += usize::from(found != old);
        }
        supply.borrow_mut().restore(None, None, 0);
        update(&mut storage::open(&mut slots, anything).1, new).expect("the next upload");
        assert_eq!(boot(&slots).as_deref(), Some(new), "after a cut at {cut}");
        cut += 1;
    }
    assert_eq!(cut, header + 32, "every byte was a cut");
    // A torn word can hold the right bits by chance, not more.
    assert!(found_new <= 2, "{found_new}");
}

#[test]
fn a_cut_at_any_byte_of_the_first_upload_leaves_no_model_or_the_new_one() {
    cut_everywhere::<1, CAPACITY>(&[], 0, 0, FLOAT);
    cut_everywhere::<16, 512>(&[], 0, 0, INTEGER);
}

#[test]
fn a_cut_at_any_byte_leaves_the_one_good_model_or_the_new_one() {
    cut_everywhere::<1, CAPACITY>(&[FLOAT], 7, 0, INTEGER);
    cut_everywhere::<4, CAPACITY>(&[INTEGER], u32::MAX, 1, FLOAT);
    cut_everywhere::<8, 1024>(&[INTEGER], 7, 0, &named(b"third"));
}

#[test]
fn a_cut_at_any_byte_leaves_the_newer_of_two_models_or_the_new_one() {
    let third = named(b"third");
    cut_everywhere::<1, CAPACITY>(&[FLOAT, INTEGER], 7, 0, &third);
    cut_everywhere::<1, CAPACITY>(&[INTEGER, FLOAT], u32::MAX, 1, &third);
    cut_everywhere::<2, 512>(&[FLOAT, INTEGER], u32::MAX - 1, 0, &third);
    cut_everywhere::<16, 256>(&[FLOAT, INTEGER], u32::MAX, 1, &third);
    cut_everywhere::<32, CAPACITY>(&[third.as_slice(), FLOAT], 7, 1, INTEGER);
}

#[test]
fn an_error_of_the_driver_at_any_call_is_reported_and_loses_nothing() {
    let supply = Supply::new();
    for call in 0.. {
        let mut slots = holding::<1, CAPACITY>(&supply, &[FLOAT, INTEGER], 7, 0);
        supply.borrow_mut().restore(None, Some(call), call as u64);
        let third = named(b"third");
        let (stored, mut uploader) = storage::open(&mut slots, anything);
        assert_eq!(stored.unwrap().file(), INTEGER);
        let result = update(&mut uploader, &third);
        if result.is_ok() {
            // Erasing, 43 blocks of the model, the header.
            assert_eq!(call, 1 + third.len().div_ceil(32) + 1);
            break;
        }
        assert!(matches!(result, Err(StorageError::Flash { .. })), "{result:?}");
        assert_eq!(uploader.write(Arming::Disarmed, 0, &third), Err(StorageError::NotBegun));
        assert_eq!(uploader.commit(Arming::Disarmed, &mut Scratch::new(), anything), Err(StorageError::NotBegun));
        assert_eq!(update(&mut uploader, &third), Ok(()), "the same uploader, after call {call} failed");
        assert_eq!(boot(&slots).as_deref(), Some(&*third));
    }
}

#[test]
fn a_bit_that_the_flash_does_not_keep_is_found_before_the_old_model_is_given_up() {
    let supply = Supply::new();
    let third = named(b"third");
    let calls = 1 + third.len().div_ceil(32) + 1;
    let mut damaged_headers = 0;
    for (call, seed) in (0..calls).flat_map(|call| (0..30).map(move |seed| (call, seed))) {
        let mut slots = holding::<4, CAPACITY>(&supply, &[FLOAT, INTEGER], 7, 0);
        supply.borrow_mut().restore(None, None, seed);
        supply.borrow_mut().weak = Some(call);
        let mut uploader = storage::open(&mut slots, anything).1;
        let result = update(&mut uploader, &third);
        damaged_headers += usize::from(result == Err(StorageError::ReadBack));
        if result.is_err() {
            assert_eq!(uploader.begin(Arming::Disarmed, 900, 0), Ok(0), "the upload can be begun again");
        }
        // A bit may also be one that is cleared anyway.
        assert_eq!(boot(&slots).as_deref(), Some(if result.is_ok() { &*third } else { INTEGER }), "{result:?}");
    }
    assert!(damaged_headers > 5);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn updates_that_are_cut_again_and_again_never_lose_a_model(
        start in prop::option::of(any::<u32>()),
        cuts in prop::collection::vec((0..CAPACITY + FLOAT.len() + 40, 0..3usize, any::<u64>()), 1..20)
    ) {
        let models = [FLOAT.to_vec(), INTEGER.to_vec(), named(b"third")];
        let supply = Supply::new();
        let mut slots = match start {
            Some(sequence) => holding::<4, 1024>(&supply, &[FLOAT], sequence, 0),
            None => holding(&supply, &[], 0, 0),
        };
        for (cut, new, seed) in cuts {
            let old = boot(&slots);
            supply.borrow_mut().restore(Some(cut), None, seed);
            let result = update(&mut storage::open(&mut slots, anything).1, &models[new]);
            let found = boot(&slots);
            let new = Some(&models[new]);
            prop_assert!(found.as_ref() == new || (result.is_err() && found == old));
            supply.borrow_mut().restore(None, None, 0);
        }
    }
}
