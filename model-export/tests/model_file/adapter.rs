//! The adapter with exported models: bounded, bumpless, gone when off.

use impromptu_firmware::{
    adapter::{Adapter, Lanes},
    guard::GuardSettings,
    model::{Interpolation, Model, Refusal},
    network::Scratch,
    preview::{EndRule, Preview},
};
use impromptu_model_export::{Description, Precision, encode, float_network::Activation};
use proptest::prelude::*;

use crate::fixture::{CAPS, Numbers, constant_model, description, lane, network, rows, table};

const RULES: [EndRule; 2] = [EndRule::Hold, EndRule::Zero];
const CAPACITY: usize = 128;
/// A preview that is filled this far ahead.
const AHEAD: i32 = 60;

/// Steps an adapter from tick 0 on; `desired` and `measured` are functions of the tick, `lanes` says what is on.
/// Returns desired, reference and correction at each tick.
fn fly(
    bytes: &[u8],
    description: &Description,
    ticks: i32,
    desired: impl Fn(i32) -> [f32; 2],
    measured: impl Fn(i32) -> [f32; 2],
    lanes: impl Fn(i32) -> Lanes,
) -> Vec<([f32; 2], [f32; 2], [f32; 2])> {
    let model = Model::from_bytes(bytes).unwrap();
    let mut adapter: Adapter<'_, 2, 2, 2> = Adapter::new(&model, &table(description), 100.0, &CAPS, CAPACITY).unwrap();
    let mut preview = Preview::<2, CAPACITY>::new(RULES, -AHEAD);
    (-AHEAD..AHEAD).for_each(|tick| preview.push(desired(tick)));
    (0..ticks)
        .map(|tick| {
            preview.push(desired(tick + AHEAD));
            // The lanes by themselves: the guard's tests are its own.
            adapter.set_guard(GuardSettings::OFF);
            adapter.switch(lanes(tick));
            let reference = adapter.step(tick, &preview, &measured(tick), &mut Scratch::new());
            (desired(tick), reference, [adapter.correction()[0], adapter.correction()[1]])
        })
        .collect()
}

/// Largest change of one correction from one tick to the next, from rest.
fn largest_step(flight: &[([f32; 2], [f32; 2], [f32; 2])], output: usize) -> f32 {
    let mut last = 0.0;
    let steps = flight.iter().map(|(_, _, correction)| {
        let step = (correction[output] - last).abs();
        last = correction[output];
        step
    });
    steps.fold(0.0, f32::max)
}

fn bits(values: [f32; 2]) -> [u32; 2] {
    values.map(f32::to_bits)
}

/// A window network and a lane with large numbers.
pub(crate) fn violent(seed: u64, interpolation: Interpolation) -> (Description, Vec<u8>) {
    let mut numbers = Numbers(seed);
    let mut float = network(&mut numbers, 4, &[(9, Activation::Tanh)], 2, true);
    float.output_scale = vec![3.0, 20.0];
    let rows = rows(&mut numbers, &float, 40);
    let mut description = description(4);
    description.timing.interpolation = interpolation;
    description.timing.measurement_delay_s = 0.024;
    description.timing.fade_s = 0.1;
    let mut lane = lane([numbers.take(6, 3.0), numbers.take(6, 3.0)], numbers.take(6, 0.15), 2.0 * numbers.next());
    lane.axes[0].fast_limit = 0.4;
    lane.axes[0].integral_limit = 0.4;
    description.feedback_lane = Some(lane);
    let bytes = encode(&description, Some(&float), Precision::Int8, &rows).unwrap();
    (description, bytes)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Off is the desired reference to the bit: never switched on, and some time after having been on.
    #[test]
    fn bypass_is_bit_identical(
        seed in any::<u64>(),
        patterns in proptest::collection::vec(any::<[u32; 2]>(), 8),
        was_on in any::<bool>(),
    ) {
        let (description, bytes) = violent(seed, Interpolation::Linear);
        let pattern = |tick: i32| patterns[tick.rem_euclid(8) as usize].map(f32::from_bits);
        // Any bits at all while off, negative zero and NaN among them; numbers while on.
        let desired = |tick: i32| if was_on && tick < 90 { [0.3 * (0.1 * tick as f32).sin(), 1.0] } else { pattern(tick) };
        let lanes = |tick| if was_on && (5..25).contains(&tick) { Lanes::BOTH } else { Lanes::NONE };
        let flight = fly(&bytes, &description, 150, desired, |_| [0.1, 0.2], lanes);
        let first = if was_on { 60 } else { 0 };
        for (desired, reference, correction) in &flight[first..] {
            prop_assert_eq!(bits(*desired), bits(*reference));
            prop_assert_eq!(bits(*correction), [0, 0]);
        }
        prop_assert!(!was_on || flight[5..25].iter().any(|(desired, reference, _)| bits(*desired) != bits(*reference)));
    }

    /// Limits and slew hold for any measurement and any switching.
    #[test]
    fn corrections_never_exceed_limit_and_slew(
        seed in any::<u64>(),
        linear in any::<bool>(),
        raw in proptest::collection::vec(any::<[u32; 2]>(), 16),
        huge in proptest::collection::vec(
            prop::sample::select(vec![1e30f32, -1e30, f32::MAX, f32::MIN, f32::NAN, f32::INFINITY, 0.0]),
            16,
        ),
        switches in any::<u64>(),
    ) {
        let (description, bytes) = violent(seed, if linear { Interpolation::Linear } else { Interpolation::Hold });
        let measured = |tick: i32| {
            let at = (tick / 3).rem_euclid(16) as usize;
            if tick % 50 < 25 { raw[at].map(f32::from_bits) } else { [huge[at], -huge[at]] }
        };
        let desired = |tick: i32| [2.0 * (0.05 * tick as f32).sin(), if tick % 7 == 0 { 1e6 } else { 0.0 }];
        let lanes = |tick: i32| {
            let bits = switches >> ((tick / 11) % 60);
            Lanes { network: bits & 1 == 1, feedback: bits & 2 == 2 }
        };
        let flight = fly(&bytes, &description, 400, desired, measured, lanes);
        for (output, limits) in description.outputs.iter().enumerate() {
            for (desired, reference, correction) in &flight {
                prop_assert!(correction[output].abs() <= limits.limit);
                prop_assert_eq!(reference[output], desired[output] + correction[output]);
            }
            // One rounding of the sum correction + slew.
            prop_assert!(largest_step(&flight, output) <= limits.slew + limits.limit * f32::EPSILON);
        }
    }

    /// Relative features and errors: the same flight elsewhere gets the same corrections.
    #[test]
    fn corrections_do_not_depend_on_the_place(seed in any::<u64>(), shift in -100f32..100.0) {
        let (mut description, _) = violent(seed, Interpolation::Linear);
        description.feedback_lane.as_mut().unwrap().axes[0].error_coefficients = vec![vec![-0.5, 0.2], vec![-0.1, 0.0]];
        description.feedback_lane.as_mut().unwrap().axes[0].output_coefficients = vec![0.3, 0.1];
        let mut numbers = Numbers(seed);
        let float = network(&mut numbers, 4, &[(9, Activation::Tanh)], 2, true);
        let bytes = encode(&description, Some(&float), Precision::Float, &rows(&mut numbers, &float, 10)).unwrap();
        let desired = |tick: i32, shift: f32| [shift + 0.5 * (0.03 * tick as f32).sin(), 0.0];
        let measured = |tick: i32, shift: f32| [shift + 0.5 * (0.03 * (tick - 4) as f32).sin(), 0.1];
        let here = fly(&bytes, &description, 200, |t| desired(t, 0.0), |t| measured(t, 0.0), |_| Lanes::BOTH);
        let there = fly(&bytes, &description, 200, |t| desired(t, shift), |t| measured(t, shift), |_| Lanes::BOTH);
        for (a, b) in here.iter().zip(&there) {
            // Positions are rounded to 8e-6 m at 100 m.
            prop_assert!((a.2[0] - b.2[0]).abs() < 5e-4 && (a.2[1] - b.2[1]).abs() < 5e-4, "{:?} {:?}", a.2, b.2);
        }
    }
}

/// A constant network correction and an integral at its clamp, faded in and out at any phase of the sub-rate.
#[test]
fn engaging_and_disengaging_are_bumpless() {
    for (fade_s, slew, phase) in [(0.5, 0.5, 3), (0.5, 0.5, 10), (0.3, 0.01, 7), (0.0, 0.01, 5), (0.01, 0.02, 1)] {
        let mut description = description(1);
        description.timing.fade_s = fade_s;
        description.outputs[0].slew = slew;
        let mut lane = lane([vec![0.0], vec![0.0]], vec![0.0], -5.0);
        lane.axes[0].integral_limit = 0.2;
        description.feedback_lane = Some(lane);
        let bytes = constant_model(description.clone(), [-0.2, 0.0]);
        let on = |tick: i32| if (phase..300 + phase).contains(&tick) { Lanes::BOTH } else { Lanes::NONE };
        let flight = fly(&bytes, &description, 600, |_| [1.0, 0.0], |_| [1.5, 0.0], on);
        let settled = flight[299].2[0];
        assert!((settled + 0.4).abs() < 1e-6, "{settled}");
        let ticks = (fade_s * 100.0f32).max(1.0);
        // Network: limit / fade. Lane: its integral grows by 5 /s x 0.5 m x 10 ms a tick while it is faded in.
        let bound = (0.4 / ticks + 0.025).min(slew) + 1e-6;
        assert!(largest_step(&flight, 0) <= bound, "{} {bound}", largest_step(&flight, 0));
        let falling =
            largest_step(&flight[310..].iter().map(|f| (f.0, f.1, [f.2[0] - flight[310].2[0], 0.0])).collect::<Vec<_>>(), 0);
        assert!(falling <= (0.4 / ticks).min(slew) + 1e-6, "{falling}");
        assert_eq!(bits(flight[599].1), bits([1.0, 0.0]), "nothing is left");
    }
}

/// Held values are those of the sub-rate ticks; ramps go through the same values at the same ticks.
#[test]
fn ramps_pass_through_the_held_values() {
    let mut numbers = Numbers(11);
    let float = network(&mut numbers, 4, &[(8, Activation::Relu)], 2, true);
    let rows = rows(&mut numbers, &float, 10);
    let desired = |tick: i32| [0.4 * (0.02 * tick as f32).sin() + 0.2 * (0.05 * tick as f32).cos(), 0.0];
    let correction = |interpolation| {
        let mut description = description(4);
        description.timing.interpolation = interpolation;
        for output in &mut description.outputs {
            (output.limit, output.slew) = (100.0, 100.0);
        }
        let bytes = encode(&description, Some(&float), Precision::Float, &rows).unwrap();
        let network = Lanes { network: true, feedback: false };
        fly(&bytes, &description, 300, desired, |_| [0.0; 2], |_| network).iter().map(|f| f.2[0]).collect::<Vec<_>>()
    };
    let (held, ramped) = (correction(Interpolation::Hold), correction(Interpolation::Linear));
    assert!(held.chunks(10).all(|period| period.iter().all(|value| value == &period[0])));
    let mut moves = 0.0f32;
    // Before the first inference there was none to start from: in the first period its end is held.
    for (tick, ramped) in ramped.iter().enumerate().take(290).skip(10) {
        let (start, phase) = (tick - tick % 10, (tick % 10) as f32);
        let line = held[start] + (held[start + 10] - held[start]) * phase / 10.0;
        assert!((ramped - line).abs() < 1e-6);
        moves = moves.max((held[start + 10] - held[start]).abs());
    }
    assert!(moves > 0.01, "the test would also pass without any correction");
}

#[test]
fn each_lane_acts_alone() {
    let mut description = description(1);
    description.feedback_lane = Some(lane([vec![-0.5], vec![0.0]], vec![0.0], 0.0));
    let bytes = constant_model(description.clone(), [0.25, 0.5]);
    let settled = |lanes| fly(&bytes, &description, 60, |_| [1.0, 0.0], |_| [1.0625, 0.0], |_| lanes)[59].2;
    assert_eq!(settled(Lanes { network: true, feedback: false }), [0.25, 0.5]);
    assert_eq!(settled(Lanes { network: false, feedback: true }), [-0.03125, 0.0]);
    assert_eq!(settled(Lanes::BOTH), [0.21875, 0.5]);
    assert_eq!(settled(Lanes::NONE), [0.0, 0.0]);
}

#[test]
fn applications_that_do_not_fit_are_refused() {
    let mut description = description(4);
    description.timing.interpolation = Interpolation::Linear;
    description.timing.measurement_delay_s = 0.024;
    let bytes = constant_model(description.clone(), [0.0; 2]);
    let model = Model::from_bytes(&bytes).unwrap();
    let refusal = |description: &Description, rate, capacity| {
        Adapter::<2, 2, 2>::new(&model, &table(description), rate, &CAPS, capacity).map(|_| ()).unwrap_err()
    };
    let changed = |change: &dyn Fn(&mut Description)| {
        let mut other = description.clone();
        change(&mut other);
        refusal(&other, 100.0, CAPACITY)
    };
    assert_eq!(changed(&|d| d.signals.measured[1].unit = "km/h".into()), Refusal::Signal { signal: "measured", channel: 1 });
    assert_eq!(changed(&|d| d.signals.desired[0].frame = "world NED".into()), Refusal::Signal { signal: "desired", channel: 0 });
    assert_eq!(changed(&|d| d.signals.reference[1].name = "speed".into()), Refusal::Signal { signal: "reference", channel: 1 });
    assert_eq!(changed(&|d| d.signals.desired[1].end = EndRule::Hold), Refusal::Signal { signal: "desired", channel: 1 });
    assert_eq!(changed(&|d| d.signals.desired.truncate(1)), Refusal::Signal { signal: "desired", channel: 1 });
    // The arrays may be longer than the signals, as the C face's are, but not shorter.
    assert!(Adapter::<2, 3, 2>::new(&model, &table(&description), 100.0, &CAPS, CAPACITY).is_ok());
    let missing = Adapter::<2, 1, 2>::new(&model, &table(&description), 100.0, &CAPS, CAPACITY).map(|_| ()).unwrap_err();
    assert_eq!(missing, Refusal::Signal { signal: "measured", channel: 1 });
    assert_eq!(refusal(&description, 50.0, CAPACITY), Refusal::Rate { model: 100.0, application: 50.0 });
    assert!(matches!(refusal(&description, f32::NAN, CAPACITY), Refusal::Rate { .. }));
    // 3 ticks of the past (the measurement's age between two of them), now, and one offset plus the ramp's period.
    assert_eq!(refusal(&description, 100.0, 23), Refusal::Preview { needed: 24, available: 23 });
    assert!(Adapter::<2, 2, 2>::new(&model, &table(&description), 100.0, &CAPS, 24).is_ok());
}
