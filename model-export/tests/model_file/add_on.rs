//! The add-on is the adapter with the trajectory ahead of it: the same bits, in place too, and the desired reference without a
//! model.

use impromptu_firmware::{
    adapter::{Adapter, Lanes},
    add_on::{AddOn, PushError, Report},
    model::{Channels, Interpolation, Model, Refusal},
    network::Scratch,
    preview::{EndRule, Preview},
};
use proptest::prelude::*;

use crate::{
    adapter::violent,
    fixture::{CAPS, Numbers, constant_model, description, table},
};

const CAPACITY: usize = 128;
const AHEAD: i32 = 60;
type Cart<'m> = AddOn<'m, 2, 2, 2, CAPACITY>;

/// The report of an add-on that has done nothing but so many ticks.
fn nothing(next_tick: i32, ticks: i32) -> Report {
    let mut report = Report::default();
    (report.next_tick, report.reach) = (next_tick, if ticks > 0 { next_tick - ticks } else { 0 });
    report
}

fn bits(values: [f32; 2]) -> [u32; 2] {
    values.map(f32::to_bits)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Whole ticks, and ticks whose network is evaluated later, whatever was in the add-on's place before.
    #[test]
    fn an_add_on_gives_the_bits_of_an_adapter(
        seed in any::<u64>(), first in -500i32..500, linear in any::<bool>(), deferred in any::<bool>(),
    ) {
        let interpolation = if linear { Interpolation::Linear } else { Interpolation::Hold };
        let (description, bytes) = violent(seed, interpolation);
        let model = Model::from_bytes(&bytes).unwrap();
        let table = table(&description);
        let (mut adapter, mut preview) = (
            Adapter::<2, 2, 2>::new(&model, &table, 100.0, &CAPS, CAPACITY).unwrap(),
            Preview::<2, CAPACITY>::new([EndRule::Hold, EndRule::Zero], first),
        );
        let (mut whole, mut split) = (Cart::new(&model, &table, 100.0, &CAPS).unwrap(), Cart::empty());
        split.bypass(&table).unwrap();
        split.push([9.0, 9.0]).unwrap();
        split.load(&model, &table, 100.0, &CAPS).unwrap();
        // A ramped correction needs the inference until the next tick, a held one at once.
        let deferred = linear && deferred;
        if deferred {
            split.defer();
        }
        let (mut numbers, mut scratch) = (Numbers(seed ^ 1), Scratch::new());
        let mut push = |preview: &mut Preview<2, CAPACITY>, add_ons: [&mut Cart<'_>; 2]| {
            let sample = [numbers.next(), numbers.next()];
            preview.push(sample);
            add_ons.into_iter().for_each(|add_on| add_on.push(sample).unwrap());
        };
        whole.clear(first);
        split.clear(first);
        adapter.switch(Lanes::BOTH);
        whole.switch(Lanes::BOTH);
        split.switch(Lanes::BOTH);
        (0..AHEAD).for_each(|_| push(&mut preview, [&mut whole, &mut split]));
        let mut measure = Numbers(seed ^ 2);
        for tick in first..first + 150 {
            push(&mut preview, [&mut whole, &mut split]);
            let measured = [measure.next(), measure.next()];
            let expected = adapter.step(tick, &preview, &measured, &mut scratch);
            prop_assert_eq!(bits(whole.step(tick, &measured, &mut scratch)), bits(expected), "tick {}", tick);
            let job = split.begin(tick, &measured);
            let mut inference = job.map(|job| job.run(model.network().unwrap(), &mut scratch));
            if !deferred {
                inference.take().into_iter().for_each(|inference| split.deliver(inference));
            }
            prop_assert_eq!(bits(split.finish(tick, &measured)), bits(expected), "tick {}", tick);
            inference.into_iter().for_each(|inference| split.deliver(inference));
            let report = Report::of(&adapter, preview.next_tick());
            prop_assert_eq!((whole.report(), split.report()), (report, report));
        }
    }
}

#[test]
fn without_a_model_the_reference_is_the_desired_one() {
    let description = description(1);
    let table = table(&description);
    let mut add_on = Cart::empty();
    add_on.bypass(&table).unwrap();
    add_on.switch(Lanes::BOTH);
    add_on.push([1.5, -0.0]).unwrap();
    assert_eq!(bits(add_on.step(0, &[f32::NAN, 1.0], &mut Scratch::new())), bits([1.5, -0.0]));
    // The end rules are those of the table: the position holds, the velocity vanishes.
    assert_eq!(add_on.step(1, &[0.0; 2], &mut Scratch::new()), [1.5, 0.0]);
    assert!(add_on.guard().is_none() && add_on.report() == nothing(1, 2));
    // A table in another order is followed by its names.
    let swapped = [table.reference[1], table.reference[0]];
    let signals = Channels { reference: &swapped, ..Channels::from(&table) };
    add_on.bypass(signals).unwrap();
    add_on.push([1.0, 2.0]).unwrap();
    assert_eq!(add_on.finish(0, &[0.0; 2]), [2.0, 1.0]);
    // What cannot be followed is refused, and nothing changes.
    let unknown = [table.reference[0], table.reference[0], table.reference[1]];
    let refused = [
        (Channels { desired: &table.desired[1..], ..signals }, Refusal::Signal { signal: "reference", channel: 1 }),
        (Channels { reference: &unknown, ..signals }, Refusal::Signal { signal: "reference", channel: 2 }),
        (Channels { measured: &unknown, ..signals }, Refusal::Signal { signal: "measured", channel: 2 }),
    ];
    for (signals, refusal) in refused {
        assert_eq!(add_on.bypass(signals), Err(refusal));
    }
    assert_eq!(add_on.finish(0, &[0.0; 2]), [2.0, 1.0]);
}

#[test]
fn a_refused_model_and_a_refused_sample_change_nothing() {
    let description = description(1);
    let bytes = constant_model(description.clone(), [0.25, 0.5]);
    let model = Model::from_bytes(&bytes).unwrap();
    let table = table(&description);
    let signals = Channels::from(&table);
    let mut add_on = Cart::new(&model, signals, 100.0, &CAPS).unwrap();
    add_on.switch(Lanes::BOTH);
    add_on.push([1.0, 2.0]).unwrap();
    assert_eq!(add_on.load(&model, signals, 50.0, &CAPS), Err(Refusal::Rate { model: 100.0, application: 50.0 }));
    assert_eq!(Cart::check(&model, signals, 50.0, &CAPS), Err(Refusal::Rate { model: 100.0, application: 50.0 }));
    assert_eq!(add_on.push([1.0, f32::NAN]), Err(PushError::NotFinite { channel: 1 }));
    assert_eq!(add_on.push([f32::INFINITY, f32::NAN]), Err(PushError::NotFinite { channel: 0 }));
    assert_eq!((add_on.next_tick(), add_on.desired(0)), (1, [1.0, 2.0]));
    assert_eq!(add_on.step(0, &[0.0; 2], &mut Scratch::new()), [1.1, 2.5]);
}

#[test]
fn clearing_keeps_the_fade_a_reset_the_wanted_lanes_and_a_restart_neither() {
    let mut description = description(1);
    description.timing.fade_s = 0.04;
    let bytes = constant_model(description.clone(), [0.25, 0.5]);
    let model = Model::from_bytes(&bytes).unwrap();
    let mut add_on = Cart::new(&model, &table(&description), 100.0, &CAPS).unwrap();
    add_on.switch(Lanes { network: true, feedback: false });
    let weight = |add_on: &mut Cart<'_>, tick| {
        add_on.push([0.0; 2]).unwrap();
        add_on.step(tick, &[0.0; 2], &mut Scratch::new());
        add_on.report().network_weight
    };
    assert_eq!([0, 1, 2, 3].map(|tick| weight(&mut add_on, tick)), [0.25, 0.5, 0.75, 1.0]);
    add_on.clear(20);
    assert_eq!((weight(&mut add_on, 20), add_on.report().next_tick), (1.0, 21));
    add_on.reset(0);
    assert_eq!((weight(&mut add_on, 0), add_on.report().next_tick), (0.25, 1));
    add_on.restart(-5);
    assert_eq!((weight(&mut add_on, -5), add_on.report()), (0.0, nothing(-4, 0)));
}

/// An application that pushes as far ahead as it may takes nothing from the model that it looks back at.
#[test]
fn a_push_that_would_cost_the_model_its_past_is_refused() {
    let mut description = description(1);
    description.features[0].offset = -9;
    let bytes = constant_model(description.clone(), [0.25, 0.5]);
    let model = Model::from_bytes(&bytes).unwrap();
    let past = model.card().preview_span().0 as i32;
    assert_eq!(past, 9 * i32::from(description.timing.divisor));
    let mut add_on = Cart::new(&model, &table(&description), 100.0, &CAPS).unwrap();
    let mut pushed = 0;
    for tick in 0..300 {
        while add_on.push([pushed as f32, 0.0]).is_ok() {
            pushed += 1;
        }
        assert_eq!(add_on.push([0.0; 2]), Err(PushError::Full));
        assert_eq!(pushed, (tick + CAPACITY as i32 - past).max(CAPACITY as i32));
        let oldest = (tick - past).max(0);
        assert_eq!(add_on.desired(oldest)[0], oldest as f32);
        add_on.step(tick, &[tick as f32, 0.0], &mut Scratch::new());
    }
}
