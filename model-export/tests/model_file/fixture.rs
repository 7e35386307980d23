//! Small models and what is needed to spoil them.

use impromptu_firmware::{
    caps::{Cap, Caps},
    features::{Feature, Relative, Source},
    model::{Card, Channel, Interpolation, Margins, Output, SignalTable, file},
    preview::EndRule,
};
use impromptu_model_export::{
    Description, FloatNetwork, Precision,
    description::{
        ChannelDescription, LaneAxisDescription, LaneDescription, MonitorAxisDescription, MonitorDescription, Provenance,
        Signals, Timing,
    },
    encode,
    float_network::{Activation, DenseLayer},
};

/// Numbers that look random and are the same everywhere (SplitMix64).
pub(crate) struct Numbers(pub(crate) u64);

impl Numbers {
    /// Within ±1.
    pub(crate) fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) >> 40) as f32 / 8_388_608.0 - 1.0
    }

    pub(crate) fn take(&mut self, count: usize, scale: f32) -> Vec<f32> {
        (0..count).map(|_| scale * self.next()).collect()
    }
}

fn channel(name: &str, unit: &str, end: EndRule) -> ChannelDescription {
    ChannelDescription { name: name.into(), unit: unit.into(), frame: "world ENU".into(), end }
}

/// Position and velocity along one axis, desired, measured and as a reference; one window of desired positions; both references
/// corrected.
pub(crate) fn description(window: usize) -> Description {
    let signal = vec![channel("position", "m", EndRule::Hold), channel("velocity", "m/s", EndRule::Zero)];
    let feature = |offset: usize| Feature {
        source: Source::Desired,
        channel: 0,
        offset: offset as i16 + 1,
        relative: Relative::Desired(0),
    };
    Description {
        name: "small".into(),
        provenance: Provenance { vehicle: "cart".into(), software: "test".into(), seed: 7, ..Provenance::default() },
        signals: Signals { desired: signal.clone(), measured: signal.clone(), reference: signal },
        timing: Timing {
            reference_rate_hz: 100.0,
            divisor: 10,
            interpolation: Interpolation::Hold,
            measurement_delay_s: 0.0,
            fade_s: 0.0,
        },
        features: (0..window).map(feature).collect(),
        outputs: vec![Output { channel: 0, limit: 0.5, slew: 0.1 }, Output { channel: 1, limit: 2.0, slew: 0.5 }],
        envelope: vec![(-3.0, 3.0); window],
        feedback_lane: None,
        monitor: None,
        tie: None,
    }
}

/// A feedback lane on the position reference: position and velocity error.
pub(crate) fn lane(errors: [Vec<f32>; 2], outputs: Vec<f32>, integral: f32) -> LaneDescription {
    LaneDescription {
        axes: vec![LaneAxisDescription {
            output: 0,
            errors: vec![(0, 0), (1, 1)],
            error_coefficients: errors.into(),
            output_coefficients: outputs,
            integral,
            fast_limit: 0.05,
            integral_limit: 0.1,
        }],
        authority: Default::default(),
        margins: Margins { delay_ms: 30.0, gain: 2.0, modulus: 0.5 },
    }
}

/// [`description`] for any network: one that is always beyond its limits would be refused.
pub(crate) fn unlimited(window: usize) -> Description {
    let mut description = description(window);
    description.outputs.iter_mut().for_each(|output| output.limit = 1e6);
    description
}

/// A network with hidden layers of these widths and activations.
pub(crate) fn network(
    numbers: &mut Numbers,
    inputs: usize,
    hidden: &[(usize, Activation)],
    outputs: usize,
    skip: bool,
) -> FloatNetwork {
    let mut width = inputs;
    let mut layers = Vec::new();
    let last = (outputs, Activation::Linear);
    let all = hidden.iter().chain(if hidden.is_empty() && skip { None } else { Some(&last) });
    for &(units, activation) in all {
        let scale = 1.7 / (width as f32).sqrt();
        layers.push(DenseLayer { weights: numbers.take(width * units, scale), bias: numbers.take(units, 0.3), activation });
        width = units;
    }
    let mut positive = |count| (0..count).map(|_| 1.25 + numbers.next()).collect::<Vec<_>>();
    let (input_scale, output_scale) = (positive(inputs), positive(outputs));
    FloatNetwork {
        input_mean: numbers.take(inputs, 0.5),
        input_scale,
        layers,
        skip: skip.then(|| numbers.take(inputs * outputs, 0.5)),
        output_mean: numbers.take(outputs, 0.2),
        output_scale,
        notes: Default::default(),
    }
}

/// Rows like those that a network was trained on.
pub(crate) fn rows(numbers: &mut Numbers, network: &FloatNetwork, count: usize) -> Vec<Vec<f32>> {
    let row = |numbers: &mut Numbers| {
        let places = network.input_mean.iter().zip(&network.input_scale);
        places.map(|(mean, scale)| mean + 1.7 * scale * numbers.next()).collect()
    };
    (0..count).map(|_| row(numbers)).collect()
}

/// A small model with everything: two int8 layers, skip, lane, monitor, probes.
pub(crate) fn small_model(precision: Precision) -> Vec<u8> {
    let mut numbers = Numbers(1);
    let network = network(&mut numbers, 3, &[(5, Activation::Tanh)], 2, true);
    let rows = rows(&mut numbers, &network, 32);
    let mut description = description(3);
    description.feedback_lane = Some(lane([vec![-0.5, 0.1], vec![-0.2, 0.0]], vec![0.3, 0.1], -0.2));
    let axis = MonitorAxisDescription { error: (0, 0), inputs: vec![0, 1], taps: vec![vec![0.1, 0.5, 0.3], vec![0.0, 0.2, 0.1]] };
    description.monitor = Some(MonitorDescription { divisor: 5, validated_rms: 0.01, axes: vec![axis] });
    encode(&description, Some(&network), precision, &rows).unwrap()
}

/// A model that adds `correction` to each reference, whatever comes in, and the description's lane.
pub(crate) fn constant_model(mut description: Description, correction: [f32; 2]) -> Vec<u8> {
    description.features.truncate(1);
    description.envelope.truncate(1);
    let network = FloatNetwork {
        input_mean: vec![0.0],
        input_scale: vec![1.0],
        layers: vec![],
        skip: Some(vec![0.0, 0.0]),
        output_mean: correction.into(),
        output_scale: vec![1.0, 1.0],
        notes: Default::default(),
    };
    encode(&description, Some(&network), Precision::Float, &[]).unwrap()
}

/// The signal table of an application that fits.
/// No bound of the application's: what the tests are about is the model's own.
pub(crate) const CAPS: Caps<'_> = Caps { channels: &[Cap { limit: 1e9, rate: 1e12 }; 2], sums: &[] };

pub(crate) fn table(description: &Description) -> SignalTable<'_> {
    fn borrowed<const N: usize>(channels: &[ChannelDescription]) -> heapless::Vec<Channel<'_>, N> {
        channels.iter().map(|c| Channel { name: &c.name, unit: &c.unit, frame: &c.frame, end: c.end }).collect()
    }
    let Signals { desired, measured, reference } = &description.signals;
    SignalTable { desired: borrowed(desired), measured: borrowed(measured), reference: borrowed(reference) }
}

/// Header, card bytes, padding, blob, check sum: what `encode` does in its last step, for cards that it would not write.
pub(crate) fn assembled(card: &[u8], blob: &[u8]) -> Vec<u8> {
    let mut bytes = file::header(file::OLDEST_VERSION, card.len() as u32, blob.len() as u32).to_vec();
    bytes.extend(card);
    bytes.resize(bytes.len().next_multiple_of(file::ALIGNMENT), 0);
    bytes.extend(blob);
    sealed(bytes)
}

/// The same bytes with the check sum that fits.
pub(crate) fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let checksum = file::checksum(&bytes);
    if let Some(place) = bytes.get_mut(20..24) {
        place.copy_from_slice(&checksum.to_le_bytes());
    }
    bytes
}

/// A file with another card and blob, its check sum recomputed.
pub(crate) fn edited(bytes: &[u8], edit: impl FnOnce(&mut Card<'_>, &mut Vec<u8>)) -> Vec<u8> {
    let (card, blob) = file::split(bytes).unwrap();
    let mut card: Card<'_> = postcard::from_bytes(card).unwrap();
    let mut blob = blob.to_vec();
    edit(&mut card, &mut blob);
    assembled(&postcard::to_allocvec(&card).unwrap(), &blob)
}
