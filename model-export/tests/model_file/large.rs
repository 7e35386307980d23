//! Models of one to eight axes: which version they are, who reads them, and that limits change no bit.

use impromptu_firmware::{
    AddOn, Cap, Caps, Lanes,
    guard::GuardSettings,
    model::{Interpolation, LargestModel, MAX_AXES, MAX_CHANNELS, MAX_OUTPUTS, Model, Output, Refusal, file},
    network::Scratch,
    preview::EndRule,
};
use impromptu_model_export::{
    Description, Precision,
    description::{
        AuthorityDescription, ChannelDescription, LaneAxisDescription, LaneDescription, MonitorAxisDescription,
        MonitorDescription, Signals,
    },
    encode,
    float_network::Activation,
};
use proptest::prelude::*;

use crate::fixture::{Numbers, description, network, rows, sealed, table};

/// Samples of the trajectory that the add-ons here keep.
const PREVIEW: usize = 64;
const CAPS: [Cap; MAX_OUTPUTS] = [Cap { limit: 1e9, rate: 1e12 }; MAX_OUTPUTS];
const NETWORK: Lanes = Lanes { network: true, feedback: false };

/// A loop whose axes each have position and velocity, both of them corrected, with a lane and a monitor for each axis.
pub(crate) fn axes(count: u8) -> Description {
    let signal: Vec<ChannelDescription> = (0..count)
        .flat_map(|axis| [(axis, "position", EndRule::Hold), (axis, "velocity", EndRule::Zero)])
        .map(|(axis, name, end)| ChannelDescription { name: format!("{axis}.{name}"), unit: "".into(), frame: "".into(), end })
        .collect();
    let lanes = (0..count).map(|axis| LaneAxisDescription {
        output: 2 * axis,
        errors: vec![(2 * axis, 2 * axis), (2 * axis + 1, 2 * axis + 1)],
        error_coefficients: vec![vec![-0.5, 0.01 * f32::from(axis)], vec![-0.2, 0.0]],
        output_coefficients: vec![0.3, 0.1],
        integral: -0.2,
        fast_limit: 0.05,
        integral_limit: 0.1,
    });
    let monitors = (0..count).map(|axis| MonitorAxisDescription {
        error: (2 * axis, 2 * axis),
        inputs: vec![2 * axis, 2 * axis + 1],
        taps: vec![vec![0.1, 0.5, 0.3], vec![0.0, 0.2, 0.1]],
    });
    let output = |channel| Output { channel, limit: 0.5, slew: 0.1 };
    let small = description(5);
    Description {
        signals: Signals { desired: signal.clone(), measured: signal.clone(), reference: signal },
        outputs: (0..2 * count).map(output).collect(),
        feedback_lane: Some(LaneDescription {
            axes: lanes.collect(),
            authority: AuthorityDescription::default(),
            margins: Default::default(),
        }),
        monitor: Some(MonitorDescription { divisor: 5, validated_rms: 0.01, axes: monitors.collect() }),
        timing: impromptu_model_export::description::Timing { interpolation: Interpolation::Linear, ..small.timing },
        ..small
    }
}

/// A model of such a loop.
pub(crate) fn model(count: u8, precision: Precision, hidden: &[(usize, Activation)], skip: bool, seed: u64) -> Vec<u8> {
    let mut numbers = Numbers(seed);
    let mut float = network(&mut numbers, 5, hidden, 2 * usize::from(count), skip);
    float.output_scale.iter_mut().for_each(|scale| *scale *= 0.05);
    let rows = rows(&mut numbers, &float, 24);
    encode(&axes(count), Some(&float), precision, &rows).unwrap()
}

/// The bits of the references of a flight, of the first channels of a loop that has room for `K` of each signal.
fn flown<const K: usize, const C: usize, const O: usize, const A: usize>(
    model: &Model<'_, C, O, A>,
    description: &Description,
    lanes: Lanes,
) -> Vec<u32> {
    let channels = description.signals.reference.len();
    let caps = Caps { channels: &CAPS[..channels], sums: &[] };
    let mut add_on = Box::new(AddOn::<K, K, K, PREVIEW, C, O, A>::empty());
    add_on.load(model, &table(description), 100.0, &caps).unwrap();
    add_on.set_guard(GuardSettings::OFF);
    add_on.switch(lanes);
    let (mut bits, mut scratch) = (Vec::new(), Scratch::new());
    let wave = |tick: i32, channel: usize, size: f32| size * (0.11 * tick as f32 + channel as f32).sin();
    for tick in 0..200 {
        while add_on.next_tick() <= tick + 60 && add_on.next_tick() < 250 {
            let next = add_on.next_tick();
            let _ = add_on.push(std::array::from_fn(|channel| if channel < channels { wave(next, channel, 0.5) } else { 0.0 }));
            if add_on.next_tick() == next {
                break;
            }
        }
        let measured = std::array::from_fn(|channel| if channel < channels { wave(tick - 3, channel, 0.4) } else { 0.0 });
        let reference = add_on.step(tick, &measured, &mut scratch);
        bits.extend(reference.iter().take(channels).map(|value| value.to_bits()));
    }
    bits
}

fn hidden() -> impl Strategy<Value = Vec<(usize, Activation)>> {
    let activation = prop_oneof![Just(Activation::Relu), Just(Activation::Tanh), Just(Activation::Linear)];
    prop::collection::vec((1usize..40, activation), 0..3)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// What fits the second version is one, and is flown with the same bits by types of any limits.
    #[test]
    fn a_model_is_of_the_oldest_version_that_holds_it_and_limits_change_no_bit(
        count in 1u8..=8, float in any::<bool>(), hidden in hidden(), skip in any::<bool>(), seed in any::<u64>()
    ) {
        prop_assume!(skip || !hidden.is_empty());
        let precision = if float { Precision::Float } else { Precision::Int8 };
        let (bytes, description) = (model(count, precision, &hidden, skip, seed), axes(count));
        let large = LargestModel::sized(&bytes).unwrap();
        prop_assert_eq!(file::version(&bytes), if count <= 4 { 2 } else { 3 });
        let expected = flown::<MAX_CHANNELS, _, _, _>(&large, &description, Lanes::BOTH);
        prop_assert_eq!(&expected, &flown::<MAX_OUTPUTS, _, _, _>(&large, &description, Lanes::BOTH));
        match Model::from_bytes(&bytes) {
            Ok(small) => {
                prop_assert!(count <= 4);
                prop_assert_eq!(&expected, &flown::<8, _, _, _>(&small, &description, Lanes::BOTH));
            }
            Err(refusal) => {
                prop_assert!(count > 4);
                prop_assert!(refusal.to_string().contains("number of outputs is"), "{}", refusal);
                // The same under the old version is no file that was ever written.
                let mut old = bytes.clone();
                old[8] = 2;
                let refused = matches!(LargestModel::sized(&sealed(old)), Err(Refusal::Shape { limit: 8, .. }));
                prop_assert!(refused);
            }
        }
        if count == 1 {
            let tiny = Model::<'_, 2, 2, 1>::sized(&bytes).unwrap();
            prop_assert_eq!(&expected, &flown::<2, _, _, _>(&tiny, &description, Lanes::BOTH));
        }
    }

    /// Each output of a network with more outputs than a kernel's block has rows is the float network's.
    #[test]
    fn every_output_of_a_large_network_is_the_float_networks(
        count in 1u8..=8, hidden in hidden(), skip in any::<bool>(), seed in any::<u64>()
    ) {
        prop_assume!(skip || !hidden.is_empty());
        let mut numbers = Numbers(seed);
        let float = network(&mut numbers, 5, &hidden, 2 * usize::from(count), skip);
        let rows = rows(&mut numbers, &float, 24);
        let mut description = axes(count);
        description.outputs.iter_mut().for_each(|output| output.limit = 1e6);
        for (precision, tolerance) in [(Precision::Float, 1e-4), (Precision::Int16, 0.02), (Precision::Int8, 0.2)] {
            let bytes = encode(&description, Some(&float), precision, &rows).unwrap();
            let model = LargestModel::sized(&bytes).unwrap();
            for row in &rows {
                let mut found = [0.0; MAX_OUTPUTS];
                model.network().unwrap().evaluate(row, &mut found, &mut Scratch::new());
                let expected = float.evaluate(row);
                let size = expected.iter().fold(1.0f32, |size, value| size.max(value.abs()));
                for (expected, found) in expected.iter().zip(found) {
                    prop_assert!((expected - found).abs() <= tolerance * size, "{precision:?} {expected} {found}");
                }
            }
        }
    }
}

/// Eight lanes in one model fly what eight models of one lane fly.
#[test]
fn lanes_of_eight_axes_do_not_know_of_each_other() {
    let only = |description: &Description| encode(description, None, Precision::Float, &[]).unwrap();
    let without_network = |mut description: Description| {
        description.features.clear();
        description.envelope.clear();
        description
    };
    let together = without_network(axes(8));
    let bytes = only(&together);
    let all = LargestModel::sized(&bytes).unwrap();
    assert_eq!(all.feedback().unwrap().axes().len(), MAX_AXES);
    let feedback = Lanes { network: false, feedback: true };
    let expected = flown::<16, _, _, _>(&all, &together, feedback);
    for axis in 0..8 {
        let mut alone = together.clone();
        alone.feedback_lane.as_mut().unwrap().axes = vec![together.feedback_lane.as_ref().unwrap().axes[axis].clone()];
        let bytes = only(&alone);
        let found = flown::<16, _, _, _>(&LargestModel::sized(&bytes).unwrap(), &alone, feedback);
        let of_axis = |bits: &[u32]| bits.chunks(16).map(|channels| channels[2 * axis]).collect::<Vec<_>>();
        assert!(of_axis(&expected) == of_axis(&found), "axis {axis}");
        let idle = flown::<16, _, _, _>(&all, &together, Lanes::NONE);
        assert!(of_axis(&idle) != of_axis(&expected), "axis {axis} is not corrected");
    }
}

/// All sixteen outputs act.
#[test]
fn sixteen_channels_are_corrected() {
    let (bytes, description) = (model(8, Precision::Int8, &[(20, Activation::Relu)], true, 3), axes(8));
    let large = LargestModel::sized(&bytes).unwrap();
    let [with, without] = [NETWORK, Lanes::NONE].map(|lanes| flown::<16, _, _, _>(&large, &description, lanes));
    let differs =
        |channel: usize| with.chunks(16).zip(without.chunks(16)).any(|(with, without)| with[channel] != without[channel]);
    assert!((0..16).all(differs));
}
