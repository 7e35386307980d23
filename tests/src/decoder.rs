//! What the decoder of model files must survive: any bytes, and files that are whole but for their content.
//!
//! *in* bytes; *out* whether a model was loaded from them and flown; *never* a panic, an overflow or a read out of bounds,
//! whatever the bytes: that is what the fuzz target and the test on stable Rust look for.

use impromptu_firmware::{
    Cap, Caps,
    adapter::{Adapter, Job, Lanes},
    feedback::{self, AxisState, Lane},
    model::{Blob, LargestCard, LargestModel, MAX_FEATURES, MAX_OUTPUTS, Model, Probes, Section, file, ranges},
    network::{Network, Scratch},
    preview::{EndRule, Preview},
};

use crate::bytes::EXTREMES;

/// Bounds of an application that are wider than any model's.
const CAPS: Caps<'_> = Caps { channels: &[Cap { limit: 1e9, rate: 1e12 }; 2], sums: &[] };
/// Samples that the adapter's preview holds here.
const PREVIEW: usize = 256;

/// Loads the bytes as they are, then with a header that fits, then with probes that fit too; flies whatever loads.
pub fn survive(bytes: &[u8]) -> bool {
    let raw = load(bytes);
    let repaired = with_header(bytes);
    let loaded = load(&repaired) | raw;
    with_probes(&repaired).is_some_and(|bytes| load(&bytes)) | loaded
}

/// Loads a file, as small loops do, and with the limits of the largest.
fn load(bytes: &[u8]) -> bool {
    let small = Model::from_bytes(bytes).map(|model| lean(&model)).is_ok();
    let large = LargestModel::sized(bytes).map(|model| lean(&model)).is_ok();
    // What fits version 2 is the same to both.
    assert!(large || !small);
    large
}

/// Evaluates the network of a model at zero and extremes and flies both lanes.
fn lean<const C: usize, const O: usize, const A: usize>(model: &Model<'_, C, O, A>) {
    let _ = model.card().preview_span();
    if let Some(network) = model.network() {
        let mut scratch = Scratch::new();
        let mixed: [f32; MAX_FEATURES] = core::array::from_fn(|i| EXTREMES[i % EXTREMES.len()]);
        for inputs in EXTREMES.map(|input| [input; MAX_FEATURES]).into_iter().chain([mixed]) {
            let outputs = Job { tick: 0, inputs }.run_sized::<_, O>(network, &mut scratch).outputs;
            assert!(outputs.iter().all(|output| output.abs() <= ranges::MAGNITUDE), "{outputs:?}");
        }
    }
    if let Some(lane) = model.feedback() {
        lean_on(lane, 1.0 / model.card().timing.reference_rate_hz);
    }
    fly(model);
}

/// Steps each axis of a feedback lane through extremes: its output is finite and within its clamps.
fn lean_on<const A: usize>(lane: &Lane<'_, A>, dt: f32) {
    for axis in lane.axes() {
        let mut state = AxisState::EMPTY;
        let bound = axis.layout().fast_limit + axis.layout().integral_limit;
        for tick in 0..3 * EXTREMES.len() {
            let extreme = |shift: usize| EXTREMES[(tick * (shift + 1) + shift) % EXTREMES.len()];
            let output = state.step(lane, axis, core::array::from_fn(extreme), 1.0, dt, true);
            assert!(output.abs() <= bound, "{output} beyond {bound}");
            state.applied(lane, if tick % 2 == 0 { output } else { extreme(2) });
        }
    }
}

/// Steps an adapter of a loop with two channels each, if the model is for one.
fn fly<const C: usize, const O: usize, const A: usize>(model: &Model<'_, C, O, A>) {
    let card = model.card();
    let Ok(mut adapter) = Adapter::<2, 2, 2, C, O, A>::new(model, &card.signals, card.timing.reference_rate_hz, &CAPS, PREVIEW)
    else {
        return;
    };
    let mut scratch = Scratch::new();
    adapter.switch(Lanes::BOTH);
    let mut preview = Preview::<2, PREVIEW>::new([EndRule::Hold; 2], 0);
    for tick in 0..24 {
        let value = EXTREMES[tick as usize % EXTREMES.len()];
        preview.push([value, -value]);
        let reference = adapter.step(tick, &preview, &[-value, value], &mut scratch);
        let limits = card.outputs.iter().map(|output| output.limit);
        assert!(adapter.correction().iter().zip(limits).all(|(value, limit)| value.abs() <= limit), "{reference:?}");
    }
}

/// The bytes as a file: magic, version, lengths and check sum put right. The card's length stays if it is possible.
fn with_header(bytes: &[u8]) -> Vec<u8> {
    let body = bytes.get(file::HEADER..).unwrap_or_default();
    let announced = bytes.get(12..16).map_or(0, |word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]) as usize);
    let card = if announced <= body.len() { announced } else { announced % (body.len() + 1) };
    let blob = body.len().saturating_sub(card.next_multiple_of(file::ALIGNMENT));
    let end = card.next_multiple_of(file::ALIGNMENT) + blob;
    // Either version, as the file says, if it says one.
    let version = if file::version(bytes) == file::VERSION { file::VERSION } else { file::OLDEST_VERSION };
    let mut repaired = file::header(version, card as u32, blob as u32).to_vec();
    repaired.extend(body);
    repaired.resize(file::HEADER + end, 0);
    sealed(repaired)
}

/// The file with the probes that its network and its lane give, so that edited numbers get past the probes.
fn with_probes(bytes: &[u8]) -> Option<Vec<u8>> {
    let (card, blob) = file::split(bytes).ok()?;
    let mut card: LargestCard<'_> = postcard::from_bytes(card).ok()?;
    let mut blob = blob.to_vec();
    let mut probe = Vec::new();
    if let Some(layout) = &card.feedback {
        let lane = Lane::new(layout, &Blob::new(&blob)).ok()?;
        let outputs = feedback::probe(&lane, 1.0 / card.timing.reference_rate_hz);
        probe.extend(outputs.iter().take(layout.axes.len()).flat_map(|output| output.to_le_bytes()));
    }
    let mut numbers = Vec::new();
    if let Some(layout) = &card.network {
        let network = Network::new(layout, &Blob::new(&blob), card.features.len(), card.outputs.len()).ok()?;
        let (inputs, mut outputs) = ([0.25; MAX_FEATURES], [0.0; MAX_OUTPUTS]);
        network.evaluate(&inputs, &mut outputs, &mut Scratch::new());
        // As the probes are read.
        let outputs = outputs.map(|output: f32| if output.abs() <= ranges::MAGNITUDE { output } else { 0.0 });
        let probe = inputs.iter().take(card.features.len()).chain(outputs.iter().take(card.outputs.len()));
        numbers.extend(probe.flat_map(|number| number.to_le_bytes()));
    }
    let mut section = |bytes: Vec<u8>| {
        blob.resize(blob.len().next_multiple_of(file::ALIGNMENT), 0);
        let section = Section { offset: blob.len() as u32, length: bytes.len() as u32 };
        blob.extend(bytes);
        section
    };
    card.probes = Probes { count: u8::from(card.network.is_some()), network: section(numbers), feedback: section(probe) };
    let encoded = postcard::to_allocvec(&card).ok()?;
    let mut bytes = file::header(card.version(), encoded.len() as u32, blob.len() as u32).to_vec();
    bytes.extend(encoded);
    bytes.resize(bytes.len().next_multiple_of(file::ALIGNMENT), 0);
    bytes.extend(blob);
    Some(sealed(bytes))
}

fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let checksum = file::checksum(&bytes);
    bytes[20..24].copy_from_slice(&checksum.to_le_bytes());
    bytes
}
