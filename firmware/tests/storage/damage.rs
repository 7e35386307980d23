//! Flash that has lost bits, or holds what does not fly here.

use impromptu_firmware::{
    model::{Model, Refusal},
    network::Scratch,
    storage::{HEADER, Header, Sequence, Slot, SlotIndex, StorageError, Stored, survey},
};

use crate::{
    flash::{CAPACITY, Simulated, Supply},
    models::{FLOAT, INTEGER, anything, cart, named, servo, with_wrong_probe},
};

type Flash = Simulated<1, CAPACITY>;

fn slot(sequence: u32, file: &[u8]) -> Flash {
    let mut slot = Flash::new(&Supply::new());
    let checksum = impromptu_firmware::model::file::checksum(file);
    slot.plant(&Header { sequence: Sequence(sequence), length: file.len() as u32, checksum }.to_bytes());
    let header = slot.bytes()[..HEADER].to_vec();
    slot.plant(&[&header, file].concat());
    slot
}

#[test]
fn every_flipped_bit_is_found_and_the_other_model_flies() {
    let older = slot(1, INTEGER);
    let mut newer = slot(2, FLOAT);
    for bit in 0..8 * (HEADER + FLOAT.len()) {
        newer.flip(bit);
        assert!(Stored::read(newer.bytes()).is_err(), "bit {bit}");
        for (slots, spare) in [([&older, &newer], SlotIndex::Second), ([&newer, &older], SlotIndex::First)] {
            let found = survey(slots.map(Slot::bytes), &mut Scratch::new(), anything);
            assert_eq!((found.flies.unwrap().file(), found.spare, found.sequence), (INTEGER, spare, Sequence(2)), "bit {bit}");
        }
        newer.flip(bit);
    }
    assert_eq!(survey([older.bytes(), newer.bytes()], &mut Scratch::new(), anything).flies.unwrap().file(), FLOAT);
}

#[test]
fn a_stored_model_tells_its_name_and_check_sum() {
    let slot = slot(3, &named(b"third"));
    let stored = Stored::read(slot.bytes()).unwrap();
    let model = Model::from_bytes(stored.file()).unwrap();
    assert_eq!((stored.name(), stored.checksum(), stored.sequence()), ("third", model.checksum(), Sequence(3)));
    assert_eq!(stored.file().as_ptr().align_offset(16), 0);
}

#[test]
fn the_newest_model_flies_also_after_the_last_number() {
    for number in [0, 7, i32::MAX as u32, u32::MAX] {
        let (older, newer) = (slot(number, FLOAT), slot(number.wrapping_add(1), INTEGER));
        for (slots, spare) in [([&older, &newer], SlotIndex::First), ([&newer, &older], SlotIndex::Second)] {
            let found = survey(slots.map(Slot::bytes), &mut Scratch::new(), anything);
            let expected = (INTEGER, spare, Sequence(number.wrapping_add(2)));
            assert_eq!((found.flies.unwrap().file(), found.spare, found.sequence), expected);
        }
    }
}

#[test]
fn a_newer_model_that_does_not_fly_here_is_passed_over() {
    let good = slot(1, FLOAT);
    let unwanted = |model: &Model<'_>| if model.card().name == "third" { Err(Refusal::Card) } else { cart(model) };
    for bad in [with_wrong_probe(), named(b"third")] {
        let bad = slot(2, &bad);
        let found = survey([good.bytes(), bad.bytes()], &mut Scratch::new(), unwanted);
        assert_eq!((found.flies.unwrap().file(), found.spare, found.sequence), (FLOAT, SlotIndex::Second, Sequence(3)));
    }
}

#[test]
fn where_nothing_flies_the_newest_intact_model_is_kept() {
    let slots = [slot(5, FLOAT), slot(4, INTEGER)];
    let found = survey(slots.each_ref().map(Slot::bytes), &mut Scratch::new(), servo);
    assert_eq!((found.flies, found.spare, found.sequence), (None, SlotIndex::Second, Sequence(6)));
    let slots = [Flash::new(&Supply::new()), slot(4, INTEGER)];
    let found = survey(slots.each_ref().map(Slot::bytes), &mut Scratch::new(), servo);
    assert_eq!((found.flies, found.spare, found.sequence), (None, SlotIndex::First, Sequence(5)));
}

#[test]
fn what_is_wrong_with_a_slot_is_named() {
    let read = |slot: &Flash| Stored::read(slot.bytes()).unwrap_err();
    assert_eq!(read(&Flash::new(&Supply::new())), StorageError::Empty);
    assert_eq!(Stored::read(&[0xff; HEADER - 1]), Err(StorageError::Empty));
    let mut torn = slot(1, FLOAT);
    torn.flip(8 * 13);
    assert_eq!(read(&torn), StorageError::Torn);
    let mut damaged = slot(1, FLOAT);
    damaged.flip(8 * (HEADER + 600));
    assert!(matches!(read(&damaged), StorageError::Refused(Refusal::Checksum { .. })));
    let mut foreign = slot(1, FLOAT);
    foreign.plant(&Header { sequence: Sequence(1), length: FLOAT.len() as u32, checksum: 4 }.to_bytes());
    assert!(matches!(read(&foreign), StorageError::Mixed { header: 4, .. }));
    foreign.plant(&Header { sequence: Sequence(1), length: u32::MAX, checksum: 4 }.to_bytes());
    assert_eq!(read(&foreign), StorageError::Length { length: u32::MAX });
}
