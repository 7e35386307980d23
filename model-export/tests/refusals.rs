//! Files whose check sum is right and whose content is wrong: each is refused by name.

use impromptu_firmware::{
    features::{Feature, Relative, Source},
    model::{Card, MAX_FEATURES, MAX_LAGS, Model, Refusal, Section, file},
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
fn shapes_and_sections() {
    check(
        Precision::Int8,
        &[
            case!("chain", |c, _b| c.network.as_mut().unwrap().layers[1].inputs = 6, Refusal::Shape { what: "layer inputs", found: 6, limit: 5 }, "layer inputs is 6"),
            case!("first layer", |c, _b| c.network.as_mut().unwrap().layers[0].inputs = 4, Refusal::Shape { what: "layer inputs", .. }, "layer inputs is 4"),
            case!("last layer", |c, _b| c.network.as_mut().unwrap().layers[1].outputs = 3, Refusal::Shape { .. }, "outputs of the last (linear) layer is 3"),
            case!("no units", |c, _b| c.network.as_mut().unwrap().layers[0].outputs = 0, Refusal::Shape { found: 0, .. }, "layer outputs is 0"),
            case!("wide", |c, _b| c.network.as_mut().unwrap().layers[0].outputs = 257, Refusal::Shape { found: 257, limit: 256, .. }, "layer outputs is 257"),
            case!("no map", |c, _b| { let n = c.network.as_mut().unwrap(); n.layers.clear(); n.skip = Section::default() }, Refusal::Shape { .. }, "number of layers without a skip is 0"),
            case!("no inputs", |c, _b| c.features.clear(), Refusal::Shape { .. }, "number of features is 0"),
            case!("no outputs", |c, _b| { c.lane = None; c.outputs.clear() }, Refusal::Shape { .. }, "number of outputs is 0"),
            case!("lags", |c, _b| c.lane.as_mut().unwrap().lags = MAX_LAGS as u8 + 1, Refusal::Shape { .. }, "lane lags is 33"),
            case!("no lags", |c, _b| c.lane.as_mut().unwrap().lags = 0, Refusal::Shape { .. }, "lane lags is 0"),
            case!("no errors", |c, _b| c.lane.as_mut().unwrap().axes[0].errors.clear(), Refusal::Shape { .. }, "lane errors is 0"),
            case!("length", |c, _b| c.network.as_mut().unwrap().layers[0].weights.length -= 8, Refusal::SectionLength { expected: 24, found: 16, .. }, "section layer weights has 16 bytes"),
            case!("multipliers", |c, _b| c.network.as_mut().unwrap().layers[0].requantisation.length = 0, Refusal::SectionLength { .. }, "section layer multipliers"),
            case!("lane length", |c, _b| c.lane.as_mut().unwrap().axes[0].coefficients.length += 4, Refusal::SectionLength { .. }, "section lane coefficients"),
            case!("envelope length", |c, _b| c.envelope.length = 0, Refusal::SectionLength { .. }, "section envelope"),
            case!("probe count", |c, _b| c.probes.count = 5, Refusal::SectionLength { .. }, "section network probes"),
            case!("alignment", |c, _b| c.network.as_mut().unwrap().layers[0].weights.offset += 4, Refusal::SectionAlignment { .. }, "section layer weights is not aligned"),
            case!("range", |c, _b| c.network.as_mut().unwrap().skip.offset = 16 << 16, Refusal::SectionRange { .. }, "section skip weights lies outside"),
            case!("end of the address space", |c, _b| c.envelope.offset = u32::MAX - 15, Refusal::SectionRange { .. }, "section envelope lies outside"),
        ],
    );
}

#[test]
fn numbers() {
    check(
        Precision::Float,
        &[
            case!("weight", |c, b| put(b, c.network.as_ref().unwrap().layers[0].weights, 3, f32::NAN.to_le_bytes()), Refusal::NotFinite { .. }, "layer weights holds"),
            case!("bias", |c, b| put(b, c.network.as_ref().unwrap().layers[1].bias, 0, f32::INFINITY.to_le_bytes()), Refusal::NotFinite { .. }, "layer bias holds"),
            case!("skip", |c, b| put(b, c.network.as_ref().unwrap().skip, 0, f32::NAN.to_le_bytes()), Refusal::NotFinite { .. }, "skip weights holds"),
            case!("normalisation", |c, b| put(b, c.network.as_ref().unwrap().input_normalisation, 4, f32::INFINITY.to_le_bytes()), Refusal::NotFinite { .. }, "input normalisation holds"),
            case!("lane", |c, b| put(b, c.lane.as_ref().unwrap().axes[0].coefficients, 0, f32::NAN.to_le_bytes()), Refusal::NotFinite { .. }, "lane coefficients holds"),
            case!("margins", |c, _b| c.lane.as_mut().unwrap().margins.gain = f32::NAN, Refusal::NotFinite { .. }, "lane margins holds"),
            case!("rate", |c, _b| c.timing.reference_rate_hz = 0.0, Refusal::Value { .. }, "reference rate"),
            case!("tiny rate", |c, _b| c.timing.reference_rate_hz = 1e-40, Refusal::Value { .. }, "reference rate"),
            case!("divisor", |c, _b| c.timing.divisor = 0, Refusal::Value { .. }, "sub-rate divisor"),
            case!("delay", |c, _b| c.timing.measurement_delay_ticks = f32::NAN, Refusal::Value { .. }, "measurement delay"),
            case!("limit", |c, _b| c.outputs[0].limit = -0.1, Refusal::Value { .. }, "output limit or slew"),
            case!("slew", |c, _b| c.outputs[1].slew = 0.0, Refusal::Value { .. }, "output limit or slew"),
            case!("lane limit", |c, _b| c.lane.as_mut().unwrap().axes[0].fast_limit = -1.0, Refusal::Value { .. }, "lane integral or limit"),
            case!("lane integral", |c, _b| c.lane.as_mut().unwrap().axes[0].integral = f32::NAN, Refusal::Value { .. }, "lane integral or limit"),
            case!("steady state", |c, b| put(b, c.lane.as_ref().unwrap().axes[0].coefficients, 4, 0.9f32.to_le_bytes()), Refusal::Value { .. }, "past-output coefficients"),
            case!("envelope", |c, b| put(b, c.envelope, 0, 99f32.to_le_bytes()), Refusal::Value { .. }, "envelope"),
            case!("future of a measurement", |c, _b| c.features[0].source = Source::Measured, Refusal::Value { .. }, "feature offset"),
            case!("window", |c, _b| c.features[0].offset = 1001, Refusal::Value { .. }, "feature offset"),
            case!("network probe", |c, b| nudge(b, c.probes.network, 4 * 3), Refusal::Probe { index: 0 }, "probe 0 gives other bits"),
            case!("last network probe", |c, b| nudge(b, c.probes.network, 4 * 5 - 1), Refusal::Probe { index: 3 }, "probe 3 gives other bits"),
            case!("lane probe", |c, b| nudge(b, c.probes.lane, 0), Refusal::Probe { index: u8::MAX }, "feedback lane's probe"),
        ],
    );
    check(
        Precision::Int8,
        &[
            case!("overflow", |c, b| put(b, c.network.as_ref().unwrap().layers[0].bias, 0, i32::MAX.to_le_bytes()), Refusal::Overflow { layer: 0 }, "layer 0 could overflow"),
            case!("overflow below", |c, b| put(b, c.network.as_ref().unwrap().layers[1].bias, 1, i32::MIN.to_le_bytes()), Refusal::Overflow { layer: 1 }, "layer 1 could overflow"),
            case!("row scale", |c, b| put(b, c.network.as_ref().unwrap().layers[1].requantisation, 0, f32::NAN.to_le_bytes()), Refusal::NotFinite { .. }, "layer row scales holds"),
            case!("input code", |c, _b| c.network.as_mut().unwrap().input_code = f32::NAN, Refusal::NotFinite { .. }, "input code holds"),
            case!("no input code", |c, _b| c.network.as_mut().unwrap().input_code = 0.0, Refusal::Value { .. }, "input code"),
        ],
    );
}

#[test]
fn indices() {
    check(
        Precision::Int8,
        &[
            case!("feature", |c, _b| c.features[1].channel = 2, Refusal::Index { found: 2, .. }, "feature channel names index 2"),
            case!("origin", |c, _b| c.features[1].relative = Relative::Desired(9), Refusal::Index { found: 9, .. }, "feature origin names index 9"),
            case!("measured origin", |c, _b| c.features[1].relative = Relative::Measured(2), Refusal::Index { .. }, "feature origin names index 2"),
            case!("output", |c, _b| c.outputs[1].channel = 2, Refusal::Index { .. }, "output channel names index 2"),
            case!("output twice", |c, _b| c.outputs[1].channel = 0, Refusal::Duplicate { .. }, "output channel names index 0 twice"),
            case!("lane output", |c, _b| c.lane.as_mut().unwrap().axes[0].output = 2, Refusal::Index { .. }, "lane output names index 2"),
            case!("lane output twice", |c, _b| { let lane = c.lane.as_mut().unwrap(); let axis = lane.axes[0].clone(); lane.axes.push(axis).unwrap() }, Refusal::Duplicate { .. }, "lane output names index 0 twice"),
            case!("lane measured", |c, _b| c.lane.as_mut().unwrap().axes[0].errors[0].0 = 2, Refusal::Index { .. }, "lane measured channel names index 2"),
            case!("lane desired", |c, _b| c.lane.as_mut().unwrap().axes[0].errors[1].1 = 200, Refusal::Index { .. }, "lane desired channel names index 200"),
            case!("base", |c, _b| c.signals.reference[1].name = "thrust", Refusal::Signal { signal: "reference", channel: 1 }, "channel 1 of the reference signal"),
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
