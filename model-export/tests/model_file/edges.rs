//! Hostile and well-formed: whatever loads gives finite numbers within its bounds, whatever finite or other numbers come in.

use impromptu_firmware::{
    adapter::Job,
    feedback::{self, AxisState, Lane},
    model::{
        Arithmetic, Blob, Card, DEFAULT_OUTPUTS, MAX_ERRORS, MAX_FEATURES, Model, Probes, Refusal, Section, file,
        ranges::{MAGNITUDE, RANGES, Range},
    },
    network::{Network, Scratch},
};
use impromptu_model_export::Precision;
use proptest::prelude::*;

use crate::fixture::{Numbers, edited, small_model};

/// What may come in.
const INPUTS: [f32; 12] =
    [0.0, 0.3, -2.0, 1e-40, -1e9, 1e12, 3.4e38, -3.4e38, f32::MIN_POSITIVE, f32::INFINITY, f32::NEG_INFINITY, f32::NAN];

fn range(what: &str) -> Range {
    RANGES.into_iter().find(|range| range.what == what).unwrap()
}

/// An end of the range, or a number inside.
fn edge(numbers: &mut Numbers, what: &str) -> f32 {
    let Range { least, most, .. } = range(what);
    match numbers.next() {
        draw if draw < -0.4 => least,
        draw if draw < 0.2 => most,
        draw if least < 0.0 => draw,
        draw => 0.5_f32.mul_add(draw, 0.5).max(least),
    }
}

fn spoil(blob: &mut [u8], section: Section, mut number: impl FnMut() -> f32) {
    let (from, to) = (section.offset as usize, (section.offset + section.length) as usize);
    for place in blob[from..to].as_chunks_mut::<4>().0 {
        *place = number().to_le_bytes();
    }
}

/// The small model with numbers at the ends of all ranges, and the bounds and probes that fit.
fn at_the_edges(seed: u64, precision: Precision) -> Vec<u8> {
    edited(&small_model(precision), |card, blob| {
        let numbers = &mut Numbers(seed);
        let network = card.network.as_mut().unwrap();
        let halves = |section: Section| {
            let half = section.length / 2;
            [Section { length: half, ..section }, Section { offset: section.offset + half, length: half }]
        };
        let [mean, scale] = halves(network.input_normalisation);
        spoil(blob, mean, || edge(numbers, "input mean"));
        spoil(blob, scale, || edge(numbers, "reciprocal input scale"));
        let [scale, mean] = halves(network.output_normalisation);
        spoil(blob, scale, || edge(numbers, "output scale"));
        spoil(blob, mean, || edge(numbers, "output mean"));
        spoil(blob, network.skip, || edge(numbers, "skip rows"));
        if network.arithmetic == Arithmetic::Float {
            network.layers.iter().for_each(|layer| spoil(blob, layer.rows, || edge(numbers, "layer rows")));
        } else {
            network.input_code = edge(numbers, "input code");
            // The scales of the last layer's rows are its last eight words.
            let rows = network.layers.last().unwrap().rows;
            let scales = Section { offset: rows.offset + rows.length - 32, length: 32 };
            spoil(blob, scales, || edge(numbers, "layer row scales"));
        }
        for output in &mut card.outputs {
            output.limit = edge(numbers, "output limit");
            output.slew = edge(numbers, "output slew").max(output.limit);
        }
        let lane = card.feedback.as_mut().unwrap();
        for axis in &mut lane.axes {
            // The lane's past outputs, two of the six, must leave it a steady state.
            let mut index = 0;
            spoil(blob, axis.coefficients, || {
                index += 1;
                let number = edge(numbers, "lane coefficients");
                if index > 4 { -number.abs() } else { number }
            });
            axis.integral = edge(numbers, "lane integral");
            axis.fast_limit = edge(numbers, "lane limit");
            axis.integral_limit = edge(numbers, "lane limit");
        }
        lane.authority.scale = edge(numbers, "lane authority scale");
        let monitor = card.monitor.as_mut().unwrap();
        monitor.validated_rms = edge(numbers, "validated RMS of the monitor");
        monitor.axes.iter().for_each(|axis| spoil(blob, axis.taps, || edge(numbers, "monitor taps")));
        let [low, high] = halves(card.envelope);
        spoil(blob, low, || -MAGNITUDE);
        spoil(blob, high, || edge(numbers, "envelope"));
        let mut stated = [f32::MIN, f32::MAX, f32::MAX, f32::MAX].into_iter().cycle();
        spoil(blob, card.bounds, || stated.next().unwrap());
        probe(card, blob);
    })
}

/// Probes at zero.
fn probe(card: &mut Card<'_>, blob: &mut Vec<u8>) {
    let (features, count) = (card.features.len(), card.outputs.len());
    let mut outputs = [0.0; DEFAULT_OUTPUTS];
    let spoilt = blob.clone();
    let network = Network::new(card.network.as_ref().unwrap(), &Blob::new(&spoilt), features, count).unwrap();
    network.evaluate(&[0.0; MAX_FEATURES], &mut outputs, &mut Scratch::new());
    // As the probes are read.
    let outputs = outputs.map(|output: f32| if output.abs() <= MAGNITUDE { output } else { 0.0 });
    let lane = Lane::new(card.feedback.as_ref().unwrap(), &Blob::new(&spoilt)).unwrap();
    let expected = feedback::probe(&lane, 1.0 / card.timing.reference_rate_hz);
    let axes = lane.axes().len();
    let numbers = [&[0.0; MAX_FEATURES][..features], &outputs[..count]].concat();
    let mut section = |numbers: &[f32]| {
        blob.resize(blob.len().next_multiple_of(file::ALIGNMENT), 0);
        let section = Section { offset: blob.len() as u32, length: 4 * numbers.len() as u32 };
        blob.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        section
    };
    card.probes = Probes { count: 1, network: section(&numbers), feedback: section(&expected[..axes]) };
}

proptest! {
    #[test]
    fn what_loads_gives_finite_numbers_within_its_bounds(seed: u64, which in 0..3usize) {
        let precision = [Precision::Float, Precision::Int8, Precision::Int16][which];
        let bytes = at_the_edges(seed, precision);
        // All of it is within the ranges.
        let model = Model::from_bytes(&bytes).map_err(|refusal| TestCaseError::fail(refusal.to_string()))?;
        let (mut numbers, mut scratch) = (Numbers(seed ^ 1), Scratch::new());
        let mut input = || INPUTS[(numbers.next().abs() * 11.99) as usize];
        let lane = model.feedback().unwrap();
        let (axis, layout) = (&lane.axes()[0], lane.axes()[0].layout().clone());
        let mut state = AxisState::EMPTY;
        for tick in 0..40 {
            let job = Job { tick, inputs: core::array::from_fn(|_| input()) };
            let outputs = job.run(model.network().unwrap(), &mut scratch).outputs;
            prop_assert!(outputs.iter().all(|output| output.abs() <= MAGNITUDE), "{:?} of {:?}", outputs, job.inputs);
            let errors: [f32; MAX_ERRORS] = core::array::from_fn(|_| input());
            let output = state.step(lane, axis, errors, if tick % 7 == 6 { input() } else { 1.0 }, 0.01, true);
            prop_assert!(output.abs() <= layout.fast_limit + layout.integral_limit, "{output}");
            state.applied(lane, if tick % 5 == 4 { input() } else { output });
        }
    }
}

/// As they were found: all of the float network's scales at 1e37, limits at the end of f32, no probes.
#[test]
fn scales_and_limits_that_no_loop_has_and_missing_probes_are_refused_by_name() {
    let refused = |edit: fn(&mut Card<'_>, &mut Vec<u8>)| {
        let bytes = edited(&small_model(Precision::Float), edit);
        Model::from_bytes(&bytes).map(drop).unwrap_err()
    };
    let scales = refused(|card, blob| spoil(blob, card.network.as_ref().unwrap().output_normalisation, || 1e37));
    assert_eq!(scales, Refusal::Value { what: "output scale" });
    assert!(scales.to_string().contains("output scale is out of its meaningful range, -1000000000 to 1000000000"), "{scales}");
    let limit = refused(|card, _| card.outputs[0].limit = 3.4e38);
    assert_eq!(limit, Refusal::Value { what: "output limit or slew" });
    let probes = refused(|card, _| (card.probes.count, card.probes.network) = (0, Section::default()));
    assert_eq!(probes, Refusal::NoProbes);
    assert!(probes.to_string().contains("no probes"), "{probes}");
    let taps = refused(|card, blob| spoil(blob, card.monitor.as_ref().unwrap().axes[0].taps, || 1e30));
    assert_eq!(taps, Refusal::Value { what: "monitor taps" });
    let fade = refused(|card, _| card.timing.fade_ticks = u16::MAX);
    assert_eq!(fade, Refusal::Value { what: "fade time" });
    let decay = refused(|card, _| card.feedback.as_mut().unwrap().authority.decay = 0.999_999);
    assert_eq!(decay, Refusal::Value { what: "lane authority" });
}
