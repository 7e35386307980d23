//! Files whose check sum is right and whose content is wrong: each is refused by name.

use impromptu_firmware::{
    features::{Feature, Relative, Source},
    model::{Card, DEFAULT_AXES, MAX_FEATURES, MAX_INPUTS, Model, MonitorAxis, MonitorLayout, Refusal, Section, file},
};
use impromptu_model_export::Precision;

use crate::fixture::{assembled, edited, small_model};

/// A spoiled file and what must be said of it.
struct Case {
    name: &'static str,
    spoil: fn(&mut Card<'_>, &mut Vec<u8>),
    expected: fn(&Refusal) -> bool,
    words: &'static str,
}

macro_rules! case {
    ($name:literal, |$card:ident, $blob:ident| $spoil:expr, $pattern:pat, $words:literal) => {
        Case {
            name: $name,
            spoil: |$card, $blob| {
                let _ = &$blob;
                $spoil;
            },
            expected: |refusal| matches!(refusal, $pattern),
            words: $words,
        }
    };
}

mod numbers;
mod shapes;

fn put(blob: &mut [u8], section: Section, index: usize, bytes: [u8; 4]) {
    let at = section.offset as usize + 4 * index;
    blob[at..at + 4].copy_from_slice(&bytes);
}

/// Another last bit of a number.
fn nudge(blob: &mut [u8], section: Section, index: usize) {
    blob[section.offset as usize + 4 * index] ^= 1;
}

fn check(precision: Precision, cases: &[Case]) {
    let good = small_model(precision);
    for case in cases {
        let bytes = edited(&good, case.spoil);
        let refusal = Model::from_bytes(&bytes).map(|_| ()).expect_err(case.name);
        assert!((case.expected)(&refusal), "{}: {refusal:?}", case.name);
        assert!(refusal.to_string().contains(case.words), "{}: {refusal}", case.name);
    }
}

#[test]
fn indices() {
    check(
        Precision::Int8,
        &[
            case!("feature", |c, _b| c.features[1].channel = 2, Refusal::Index { found: 2, .. }, "feature channel names index 2"),
            case!(
                "origin",
                |c, _b| c.features[1].relative = Relative::Desired(9),
                Refusal::Index { found: 9, .. },
                "feature origin names index 9"
            ),
            case!(
                "measured origin",
                |c, _b| c.features[1].relative = Relative::Measured(2),
                Refusal::Index { .. },
                "feature origin names index 2"
            ),
            case!("output", |c, _b| c.outputs[1].channel = 2, Refusal::Index { .. }, "output channel names index 2"),
            case!(
                "output twice",
                |c, _b| c.outputs[1].channel = 0,
                Refusal::Duplicate { .. },
                "output channel names index 0 twice"
            ),
            case!(
                "lane output",
                |c, _b| c.feedback.as_mut().unwrap().axes[0].output = 2,
                Refusal::Index { .. },
                "lane output names index 2"
            ),
            case!(
                "lane output twice",
                |c, _b| {
                    let lane = c.feedback.as_mut().unwrap();
                    let axis = lane.axes[0].clone();
                    lane.axes.push(axis).unwrap()
                },
                Refusal::Duplicate { .. },
                "lane output names index 0 twice"
            ),
            case!(
                "lane measured",
                |c, _b| c.feedback.as_mut().unwrap().axes[0].errors[0].0 = 2,
                Refusal::Index { .. },
                "lane measured channel names index 2"
            ),
            case!(
                "lane desired",
                |c, _b| c.feedback.as_mut().unwrap().axes[0].errors[1].1 = 200,
                Refusal::Index { .. },
                "lane desired channel names index 200"
            ),
            case!(
                "base",
                |c, _b| c.signals.reference[1].name = "thrust",
                Refusal::Signal { signal: "reference", channel: 1 },
                "channel 1 of the reference signal"
            ),
        ],
    );
}

#[test]
fn more_than_this_build_holds() {
    let bytes = small_model(Precision::Int8);
    let (card, blob) = file::split(&bytes).unwrap();
    let mut full: Card<'_> = postcard::from_bytes(card).unwrap();
    let feature = Feature { source: Source::Desired, channel: 0, offset: 0, relative: Relative::Nothing };
    full.features = (0..MAX_FEATURES).map(|_| feature).collect();
    let mut empty = full.clone();
    empty.features.clear();
    let (full, empty) = (postcard::to_allocvec(&full).unwrap(), postcard::to_allocvec(&empty).unwrap());
    // The list's length is the first byte that differs: 128 as a varint.
    let at = full.iter().zip(&empty).position(|(a, b)| a != b).unwrap();
    assert_eq!(full[at..at + 2], [0x80, 0x01]);
    let mut more = full[..at].to_vec();
    more.extend([0x81, 0x01]);
    more.extend(postcard::to_allocvec(&feature).unwrap());
    more.extend(&full[at + 2..]);
    let refusal = Model::from_bytes(&assembled(&more, blob)).map(|_| ()).unwrap_err();
    assert_eq!(refusal, Refusal::Shape { what: "number of features", found: 129, limit: 128 });
    assert!(refusal.to_string().contains("number of features is 129"));
    // A list that claims more than there is: damaged, and nothing to name.
    more[at..at + 2].copy_from_slice(&[0xff, 0x7f]);
    assert_eq!(Model::from_bytes(&assembled(&more, blob)).map(|_| ()).unwrap_err(), Refusal::Card);
}

/// The monitor's lists are one longer than this build holds: a card that cannot be decoded, whose refusal says what to do. They
/// are made from a card with a full list by repeating an item.
#[test]
fn more_of_the_monitor_than_this_build_holds() {
    let bytes = small_model(Precision::Int8);
    let (card, blob) = file::split(&bytes).unwrap();
    let card: Card<'_> = postcard::from_bytes(card).unwrap();
    let with = |edit: &dyn Fn(&mut MonitorLayout)| {
        let mut card = card.clone();
        edit(card.monitor.as_mut().unwrap());
        postcard::to_allocvec(&card).unwrap()
    };
    let axis =
        |inputs: usize| MonitorAxis { inputs: (0..inputs as u8).collect(), ..card.monitor.as_ref().unwrap().axes[0].clone() };
    let refused = |full: &[u8], empty: &[u8], length: usize, item: &[u8]| {
        // The list's length is the first byte that differs.
        let at = full.iter().zip(empty).position(|(a, b)| a != b).unwrap();
        assert_eq!((full[at], empty[at]), (length as u8, 0));
        let more = [&full[..at], &[length as u8 + 1], item, &full[at + 1..]].concat();
        Model::from_bytes(&assembled(&more, blob)).map(|_| ()).unwrap_err()
    };
    let axes = |count: usize| with(&|monitor| monitor.axes = (0..count).map(|_| axis(1)).collect());
    let refusal = refused(&axes(DEFAULT_AXES), &axes(0), DEFAULT_AXES, &postcard::to_allocvec(&axis(1)).unwrap());
    let (found, limit) = (DEFAULT_AXES as u32 + 1, DEFAULT_AXES as u32);
    assert_eq!(refusal, Refusal::Shape { what: "number of axes of the monitor", found, limit });
    // A list within a list has no name.
    let inputs = |count: usize| with(&|monitor| monitor.axes = [axis(1), axis(count)].into_iter().collect());
    let refusal = refused(&inputs(MAX_INPUTS), &inputs(0), MAX_INPUTS, &[0]);
    assert_eq!(refusal, Refusal::Card);
    let words = refusal.to_string();
    assert!(words.contains("made for a build that holds longer lists") && words.contains("export the model again"), "{words}");
}

#[test]
fn cards_that_are_none() {
    let bytes = small_model(Precision::Int8);
    let (card, blob) = file::split(&bytes).unwrap();
    let refused = |card: &[u8]| Model::from_bytes(&assembled(card, blob)).map(|_| ()).unwrap_err();
    assert_eq!(refused(&[card, &[0]].concat()), Refusal::Card, "one byte more");
    assert_eq!(refused(&card[..card.len() - 1]), Refusal::Card, "one byte less");
    let mut not_text = card.to_vec();
    not_text[1] = 0xff;
    assert_eq!(refused(&not_text), Refusal::Card, "a name that is no UTF-8");
}
