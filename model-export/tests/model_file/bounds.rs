//! No sampled point breaks a bound, and the bounds are not idle.

use impromptu_firmware::model::{Model, OutputBounds, Reach, Refusal};
use impromptu_model_export::{
    Batch, Description, FloatNetwork, Precision, encode,
    float_network::Activation::{self, Linear, Relu, Tanh},
};
use proptest::prelude::*;

use crate::fixture::{Numbers, description, edited, network, rows, unlimited};

/// A box round the inputs' means, `width` input scales to either side at most; some features do not move.
fn envelope(numbers: &mut Numbers, float: &FloatNetwork, width: f32) -> Vec<(f32, f32)> {
    let places = float.input_mean.iter().zip(&float.input_scale);
    let ranges = places.map(|(mean, scale)| {
        let middle = mean + 0.5 * width * scale * numbers.next();
        let half = if numbers.next() > 0.9 { 0.0 } else { 0.5 * width * scale * numbers.next().abs() };
        (middle - half, middle + half)
    });
    ranges.collect()
}

/// Points of the box: corners, faces, inside.
fn points(numbers: &mut Numbers, envelope: &[(f32, f32)], count: usize) -> Vec<Vec<f32>> {
    let mut points =
        vec![envelope.iter().map(|range| range.0).collect::<Vec<_>>(), envelope.iter().map(|range| range.1).collect::<Vec<_>>()];
    for index in 0..count {
        let place = |&(low, high): &(f32, f32)| match (index % 3, numbers.next()) {
            (0, sign) => {
                if sign > 0.0 {
                    high
                } else {
                    low
                }
            }
            (1, value) if value > 0.5 => high,
            (1, value) if value < -0.5 => low,
            (_, value) => (low + (high - low) * (0.5 + 0.5 * value)).clamp(low, high),
        };
        points.push(envelope.iter().map(place).collect());
    }
    points
}

/// What sampling finds, in the order of [`OutputBounds`].
#[derive(Clone, Copy, Default)]
struct Sampled {
    low: f32,
    high: f32,
    difference: f64,
}

/// Checks every point against the bounds of the file; returns them with what was found.
fn check(bytes: &[u8], float: &FloatNetwork, points: &[Vec<f32>]) -> Vec<(OutputBounds, Sampled)> {
    let model = Model::from_bytes(bytes).unwrap();
    let bounds: Vec<OutputBounds> = model.bounds().iter().collect();
    assert_eq!(bounds.len(), float.outputs());
    let start = Sampled { low: f32::INFINITY, high: f32::NEG_INFINITY, ..Default::default() };
    let mut sampled = vec![start; bounds.len()];
    let mut exact: Vec<Vec<f32>> = Vec::new();
    Batch::of_network(float).evaluate(points.iter().map(Vec::as_slice), |_, outputs| exact.push(outputs.to_vec()));
    Batch::of_model(&model).unwrap().evaluate(points.iter().map(Vec::as_slice), |row, outputs| {
        for ((found, bounds), (output, exact)) in sampled.iter_mut().zip(&bounds).zip(outputs.iter().zip(&exact[row])) {
            let difference = (f64::from(*output) - f64::from(*exact)).abs();
            assert!((bounds.low..=bounds.high).contains(output), "{output} outside of {bounds:?}");
            assert!(difference <= f64::from(bounds.difference), "difference {difference} against {bounds:?}");
            found.low = found.low.min(*output);
            found.high = found.high.max(*output);
            found.difference = found.difference.max(difference);
        }
    });
    for (row, pair) in points.windows(2).enumerate() {
        let moves = pair[0].iter().zip(&pair[1]).zip(&float.input_scale).map(|((a, b), scale)| f64::from((a - b).abs() / scale));
        let step = moves.fold(0.0, f64::max);
        let reach =
            pair.iter().flat_map(|point| point.iter().zip(&float.input_scale)).map(|(a, scale)| f64::from((a / scale).abs()));
        let reach = reach.fold(1.0, f64::max);
        for (output, bounds) in bounds.iter().enumerate() {
            let change = (f64::from(exact[row][output]) - f64::from(exact[row + 1][output])).abs();
            // The float network is evaluated in f32, and adds terms that may be larger than their sum: as large as what the
            // inputs change it by.
            let terms = f64::from(bounds.magnitude() + bounds.difference) + f64::from(bounds.lipschitz) * reach;
            let rounding = 1e-5 * terms;
            assert!(change <= f64::from(bounds.lipschitz) * step + rounding, "{change} over {step} against {bounds:?}");
        }
    }
    bounds.into_iter().zip(sampled).collect()
}

fn boxed(inputs: usize, envelope: Vec<(f32, f32)>) -> Description {
    Description { envelope, ..unlimited(inputs) }
}

fn activations() -> impl Strategy<Value = Vec<(usize, Activation)>> {
    let activation = prop_oneof![4 => Just(Relu), 4 => Just(Tanh), 1 => Just(Linear)];
    proptest::collection::vec((1usize..24, activation), 0..4)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn no_point_breaks_a_bound(
        seed in any::<u64>(),
        inputs in 1usize..20,
        hidden in activations(),
        skip in any::<bool>(),
        width in prop_oneof![Just(0.0f32), 0.01f32..0.3, 1.0f32..8.0],
        gain in prop_oneof![Just(1.0f32), 0.01f32..3.0],
        narrow in any::<bool>(),
    ) {
        let mut numbers = Numbers(seed);
        let mut float = network(&mut numbers, inputs, &hidden, 2, skip);
        if let Some(first) = float.layers.first_mut() {
            first.weights.iter_mut().for_each(|weight| *weight *= gain);
        }
        let envelope = envelope(&mut numbers, &float, width);
        let points = points(&mut numbers, &envelope, 300);
        // Narrow: calibrated where the box is not, so that codes saturate.
        let calibration: Vec<Vec<f32>> = if narrow { rows(&mut numbers, &float, 3) } else { points[..40].to_vec() };
        for precision in [Precision::Float, Precision::Int8, Precision::Int16] {
            match encode(&boxed(inputs, envelope.clone()), Some(&float), precision, &calibration) {
                Ok(bytes) => drop(check(&bytes, &float, &points)),
                Err(error) => prop_assert!(error.to_string().contains("too large"), "{error}"),
            }
        }
    }
}

#[test]
fn a_skip_alone_is_bounded_to_the_last_digits() {
    let mut numbers = Numbers(3);
    let float = network(&mut numbers, 6, &[], 2, true);
    let envelope = vec![(-1.0, 1.5); 6];
    let bytes = encode(&boxed(6, envelope.clone()), Some(&float), Precision::Float, &[]).unwrap();
    let corners: Vec<Vec<f32>> =
        (0..64).map(|corner| (0..6).map(|i| if corner >> i & 1 == 0 { -1.0 } else { 1.5 }).collect()).collect();
    for (bounds, found) in check(&bytes, &float, &corners) {
        let width = bounds.high - bounds.low;
        assert!((found.high - found.low) / width > 0.999_99, "{bounds:?}");
        assert!(bounds.difference < 1e-5 * width);
    }
}

/// Largest Σ |∂output / ∂normalised input| at the points, by differences of f64 evaluations of the float network.
fn steepest(float: &FloatNetwork, points: &[Vec<f32>], output: usize) -> f64 {
    let evaluate = |normalised: &[f64]| {
        let mut values = normalised.to_vec();
        for layer in &float.layers {
            let row = |(weights, bias): (&[f32], &f32)| {
                let sum: f64 = weights.iter().zip(&values).map(|(weight, value)| f64::from(*weight) * value).sum();
                match layer.activation {
                    Relu => (sum + f64::from(*bias)).max(0.0),
                    Tanh => (sum + f64::from(*bias)).tanh(),
                    Linear => sum + f64::from(*bias),
                }
            };
            values = layer.weights.chunks(values.len()).zip(&layer.bias).map(row).collect();
        }
        let skip = float.skip.as_ref().map_or(0.0, |skip| {
            let row = &skip[output * normalised.len()..][..normalised.len()];
            row.iter().zip(normalised).map(|(weight, value)| f64::from(*weight) * value).sum()
        });
        f64::from(float.output_scale[output]) * (values[output] + skip)
    };
    let slope = |point: &Vec<f32>| {
        let places = point.iter().zip(&float.input_mean).zip(&float.input_scale);
        let mut at: Vec<f64> = places.map(|((x, mean), scale)| f64::from((x - mean) / scale)).collect();
        let here = evaluate(&at);
        let mut sum = 0.0;
        for input in 0..at.len() {
            let kept = at[input];
            at[input] += 1e-6;
            sum += (evaluate(&at) - here).abs() / 1e-6;
            at[input] = kept;
        }
        sum
    };
    points.iter().map(slope).fold(0.0, f64::max)
}

/// Prints how near the bounds are; `cargo test -- --nocapture` shows it.
#[test]
fn bounds_are_near_what_sampling_finds() {
    for (name, hidden, width, most) in [
        ("20-32x2-2 relu, narrow box", vec![(32, Relu); 2], 0.2, [2.5, 45.0, 8.0]),
        ("20-32x2-2 tanh", vec![(32, Tanh); 2], 1.0, [3.0, 80.0, 12.0]),
        ("20-32x2-2 relu", vec![(32, Relu); 2], 4.0, [4.5, 700.0, 15.0]),
    ] {
        let mut numbers = Numbers(4);
        let float = network(&mut numbers, 20, &hidden, 2, true);
        let envelope = envelope(&mut numbers, &float, width);
        let points = points(&mut numbers, &envelope, 3000);
        let bytes = encode(&boxed(20, envelope), Some(&float), Precision::Int8, &points).unwrap();
        for (output, (bounds, found)) in check(&bytes, &float, &points).into_iter().enumerate() {
            let ratios = [
                f64::from((bounds.high - bounds.low) / (found.high - found.low)),
                f64::from(bounds.difference) / found.difference,
                f64::from(bounds.lipschitz) / steepest(&float, &points[..300], output),
            ];
            println!(
                "{name}: range {:.2}, difference {:.1}, slope {:.1} times what sampling finds",
                ratios[0], ratios[1], ratios[2]
            );
            assert!(ratios.iter().zip(most).all(|(ratio, most)| *ratio >= 1.0 && *ratio <= most), "{name}: {ratios:?}");
        }
    }
}

#[test]
fn bounds_that_contradict_themselves_the_probes_or_the_limits_are_refused() {
    let good = crate::fixture::small_model(Precision::Int8);
    let refusal = |field: usize, value: f32| {
        let bytes = edited(&good, |card, blob| {
            let at = card.bounds.offset as usize + 4 * field;
            blob[at..at + 4].copy_from_slice(&value.to_le_bytes());
        });
        Model::from_bytes(&bytes).map(|_| ()).unwrap_err()
    };
    assert_eq!(refusal(0, f32::NAN), Refusal::NotFinite { what: "output bounds" });
    assert_eq!(refusal(4, 1e9), Refusal::Value { what: "output bounds" });
    assert_eq!(refusal(2, -1.0), Refusal::Value { what: "output bounds" });
    assert_eq!(refusal(7, -1.0), Refusal::Value { what: "output bounds" });
    // The probes lie within the envelope: a range that ends before the largest of them is wrong.
    let model = Model::from_bytes(&good).unwrap();
    let probes = model.blob().floats(model.card().probes.network, 4 * (3 + 2), "").unwrap();
    let largest = (0..4).map(|probe| probes.get(4 * 3 + 2 * probe)).fold(f32::NEG_INFINITY, f32::max);
    assert_eq!(refusal(1, largest.next_down()), Refusal::Bounds { output: 0 });
    assert!(Refusal::Bounds { output: 0 }.to_string().contains("output 0"));
    let none = edited(&good, |card, _| card.bounds = Default::default());
    assert!(matches!(Model::from_bytes(&none).unwrap_err(), Refusal::SectionLength { what: "output bounds", .. }));
}

#[test]
fn an_output_that_is_always_clamped_is_refused() {
    let mut description = description(1);
    description.outputs[1].limit = 0.25;
    let float = FloatNetwork {
        input_mean: vec![0.0],
        input_scale: vec![1.0],
        layers: vec![],
        skip: Some(vec![0.5, 0.0]),
        output_mean: vec![0.0, -0.5],
        output_scale: vec![1.0; 2],
        notes: Default::default(),
    };
    let encoded = |description: &Description| encode(description, Some(&float), Precision::Float, &[]);
    assert!(encoded(&description).unwrap_err().to_string().contains("network's output 1 lies beyond its limit"));
    description.outputs[1].limit = 0.0;
    let bytes = encoded(&description).unwrap();
    let bounds: Vec<_> = Model::from_bytes(&bytes).unwrap().bounds().iter().collect();
    assert_eq!([bounds[0].reach(0.5), bounds[0].reach(1.6)], [Reach::Partly, Reach::Within]);
    assert_eq!(bounds[1].reach(0.4), Reach::Beyond);
    assert!((bounds[0].lipschitz - 0.5).abs() < 1e-6);
}
