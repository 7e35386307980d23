//! Float network in, the same map out of the firmware.

use impromptu_firmware::{
    model::{Arithmetic, Model},
    network::Scratch,
};
use impromptu_model_export::{
    ExportError, FloatNetwork, Precision, encode,
    float_network::{Activation, DenseLayer},
    verify::{ComparisonError, compare, difference},
};
use proptest::prelude::*;

use crate::fixture::{Numbers, description, lane, network, rows, unlimited};

/// Hidden layers of widths that are and are not multiples of the kernel's eight rows.
fn hidden() -> impl Strategy<Value = Vec<(usize, Activation)>> {
    let activation = prop_oneof![Just(Activation::Relu), Just(Activation::Tanh), Just(Activation::Linear)];
    proptest::collection::vec((1usize..40, activation), 0..4)
}

fn firmware(model: &Model<'_>, row: &[f32]) -> [f32; 2] {
    let mut outputs = [0.0; 2];
    model.network().unwrap().evaluate(row, &mut outputs, &mut Scratch::new());
    outputs
}

/// RMS difference over RMS output, means left out, over all outputs in their scales.
fn relative_difference(float: &FloatNetwork, model: &Model<'_>, rows: &[Vec<f32>]) -> f64 {
    let (mut error, mut size) = (0.0, 0.0);
    for row in rows {
        for (o, (expected, found)) in float.evaluate(row).into_iter().zip(firmware(model, row)).enumerate() {
            let scale = f64::from(float.output_scale[o]);
            error += (f64::from(expected - found) / scale).powi(2);
            size += (f64::from(expected - float.output_mean[o]) / scale).powi(2);
        }
    }
    (error / size).sqrt()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(120))]

    #[test]
    fn f32_is_the_float_network(seed in any::<u64>(), inputs in 1usize..80, hidden in hidden(), skip in any::<bool>()) {
        let mut numbers = Numbers(seed);
        let float = network(&mut numbers, inputs, &hidden, 2, skip);
        let rows = rows(&mut numbers, &float, 20);
        let bytes = encode(&unlimited(inputs), Some(&float), Precision::Float, &rows).unwrap();
        let model = Model::from_bytes(&bytes).unwrap();
        for row in &rows {
            for (o, (expected, found)) in float.evaluate(row).into_iter().zip(firmware(&model, row)).enumerate() {
                let size = expected.abs() + float.output_scale[o] + float.output_mean[o].abs();
                prop_assert!((expected - found).abs() < 1e-5 * size, "{expected} {found}");
            }
        }
    }

    /// int8 weights are off by at most 1/254 of the row's largest: about 0.4 % of a row's sum. Stated: 1 % of the output's RMS
    /// for one layer and half a percent more for each further one (measured over such networks: 0.4 % in the mean, 1.0 % at
    /// worst).
    #[test]
    fn int8_is_close(seed in any::<u64>(), inputs in 4usize..80, hidden in hidden(), skip in any::<bool>()) {
        let mut numbers = Numbers(seed);
        let float = network(&mut numbers, inputs, &hidden, 2, skip);
        let rows = rows(&mut numbers, &float, 200);
        let bytes = encode(&unlimited(inputs), Some(&float), Precision::Int8, &rows).unwrap();
        let model = Model::from_bytes(&bytes).unwrap();
        prop_assert_eq!(model.card().network.as_ref().unwrap().arithmetic, Arithmetic::Int8);
        let found = relative_difference(&float, &model, &rows);
        let bound = 0.01 * (1.0 + float.layers.len() as f64) / 2.0;
        prop_assert!(found < bound, "{found} over {bound}");
    }

    #[test]
    fn a_linear_map_is_exact_to_rounding(seed in any::<u64>(), inputs in 1usize..=128, int8 in any::<bool>()) {
        let mut numbers = Numbers(seed);
        let float = network(&mut numbers, inputs, &[], 2, true);
        let rows = rows(&mut numbers, &float, 8);
        let precision = if int8 { Precision::Int8 } else { Precision::Float };
        let bytes = encode(&unlimited(inputs), Some(&float), precision, &rows).unwrap();
        let model = Model::from_bytes(&bytes).unwrap();
        for row in &rows {
            let found = firmware(&model, row);
            for (o, found) in found.into_iter().enumerate() {
                let (mut exact, mut size) = (0.0, 0.0);
                for (i, x) in row.iter().enumerate() {
                    let input = (f64::from(*x) - f64::from(float.input_mean[i])) / f64::from(float.input_scale[i]);
                    let term = f64::from(float.skip.as_ref().unwrap()[o * inputs + i]) * input;
                    exact += term;
                    size += term.abs() + (f64::from(*x) / f64::from(float.input_scale[i])).abs();
                }
                let (scale, mean) = (f64::from(float.output_scale[o]), f64::from(float.output_mean[o]));
                let tolerance = (inputs as f64 + 4.0) * f64::from(f32::EPSILON) * (scale * size + mean.abs());
                prop_assert!((f64::from(found) - (mean + scale * exact)).abs() < tolerance);
            }
        }
    }
}

#[test]
fn either_lane_works_alone() {
    let mut lane_only = description(0);
    lane_only.feedback_lane = Some(lane([vec![-1.0], vec![-0.4]], vec![0.0], -0.5));
    let bytes = encode(&lane_only, None, Precision::Int8, &[]).unwrap();
    let model = Model::from_bytes(&bytes).unwrap();
    assert!(model.network().is_none() && model.feedback().is_some());
    assert_eq!(model.card().probes.count, 0);

    let mut numbers = Numbers(3);
    let float = network(&mut numbers, 3, &[(4, Activation::Relu)], 2, false);
    let bytes = encode(&description(3), Some(&float), Precision::Float, &[]).unwrap();
    let model = Model::from_bytes(&bytes).unwrap();
    assert!(model.network().is_some() && model.feedback().is_none());
    assert_eq!(model.card().probes.count, 3, "without rows the envelope gives the probes");
}

/// A layer that is silent over all rows, beside large weights: its scale is that of nothing.
#[test]
fn a_dead_layer_stays_dead() {
    let mut numbers = Numbers(5);
    let mut float = network(&mut numbers, 4, &[(6, Activation::Relu)], 2, true);
    float.layers[0].bias.fill(-1e3);
    float.layers[0].weights.iter_mut().for_each(|weight| *weight *= 50.0);
    let rows = rows(&mut numbers, &float, 50);
    let bytes = encode(&description(4), Some(&float), Precision::Int8, &rows).unwrap();
    let found = relative_difference(&float, &Model::from_bytes(&bytes).unwrap(), &rows);
    assert!(found < 1e-3, "{found}");
}

/// Two units that cancel: the layer's outputs are far smaller than its terms.
#[test]
fn steep_layers_are_widened_or_refused() {
    let steep = |activation, weight: f32| FloatNetwork {
        layers: vec![
            DenseLayer { weights: vec![weight, -weight], bias: vec![0.0], activation },
            DenseLayer { weights: vec![1.0, 1.0], bias: vec![0.0, 0.0], activation: Activation::Linear },
        ],
        skip: None,
        ..network(&mut Numbers(1), 2, &[], 2, true)
    };
    let rows: Vec<Vec<f32>> = (0..40).map(|i| vec![i as f32 * 0.1; 2]).collect();
    let export = |activation, weight| encode(&description(2), Some(&steep(activation, weight)), Precision::Int8, &rows);
    let bytes = export(Activation::Linear, 1e3).unwrap();
    let found = relative_difference(&steep(Activation::Linear, 1e3), &Model::from_bytes(&bytes).unwrap(), &rows);
    assert!(found < 0.02, "{found}");
    let refusal = export(Activation::Tanh, 1e5).unwrap_err();
    assert!(matches!(refusal, ExportError::Steep { layer: 0, row: 0 }), "{refusal}");
}

#[test]
fn what_does_not_fit_is_named() {
    let float = network(&mut Numbers(1), 3, &[(4, Activation::Relu)], 2, true);
    let refusal = |change: &dyn Fn(&mut impromptu_model_export::Description, &mut FloatNetwork), rows: &[Vec<f32>]| {
        let (mut description, mut float) = (description(3), float.clone());
        description.feedback_lane = Some(lane([vec![-1.0], vec![-0.4]], vec![0.0], 0.0));
        change(&mut description, &mut float);
        encode(&description, Some(&float), Precision::Int8, rows).unwrap_err().to_string()
    };
    let good = [vec![0.0; 3]];
    let same = |text: String, words: &str| assert!(text.contains(words), "{text}");
    same(
        refusal(&|d, _| d.features.truncate(2), &good),
        "inputs of the network (one for each feature): 3 found where 2 are needed",
    );
    same(refusal(&|d, _| d.outputs.truncate(1), &good), "outputs of the network");
    same(refusal(&|d, _| d.envelope.truncate(2), &good), "ranges of the envelope");
    same(refusal(&|_, _| (), &[]), "--calibration");
    same(refusal(&|_, _| (), &[vec![0.0; 4]]), "columns of the calibration rows (one for each feature): 4 found where 3");
    same(refusal(&|_, _| (), &[vec![0.0; 3], vec![0.0, f32::NAN, 0.0]]), "calibration row 2: value 2");
    same(refusal(&|d, _| d.timing.fade_s = -1.0, &good), "`timing.fade_s` is -1 s");
    same(refusal(&|d, _| d.timing.fade_s = 1e9, &good), "`timing.fade_s`");
    same(refusal(&|d, _| d.feedback_lane.as_mut().unwrap().axes[0].errors.truncate(1), &good), "lists of error coefficients");
    same(
        refusal(&|d, _| d.feedback_lane.as_mut().unwrap().axes[0].error_coefficients[1].push(0.0), &good),
        "lags of the feedback lane",
    );
    same(
        refusal(&|d, _| d.feedback_lane.as_mut().unwrap().axes[0].output_coefficients = vec![0.0; 257], &good),
        "257, the firmware holds at most 32",
    );
    same(refusal(&|_, f| f.layers[0].weights[2] = f32::NAN, &good), "`layer.0.weight` is not finite at index 2");
    let wide = network(&mut Numbers(1), 3, &[(65_537, Activation::Relu)], 2, true);
    same(encode(&description(3), Some(&wide), Precision::Float, &good).unwrap_err().to_string(), "units in a layer: 65537");
    same(refusal(&|d, _| d.outputs[0].limit = -1.0, &good), "output limit or slew");
}

#[test]
fn comparisons_name_what_cannot_be_compared() {
    let mut numbers = Numbers(9);
    let float = network(&mut numbers, 3, &[(4, Activation::Tanh)], 2, true);
    let rows = rows(&mut numbers, &float, 30);
    let bytes = encode(&description(3), Some(&float), Precision::Int8, &rows).unwrap();
    let model = Model::from_bytes(&bytes).unwrap();
    let comparison = compare(&model, &float, &rows).unwrap();
    let plain = difference(&model, &float, &rows);
    assert_eq!((comparison.rows, comparison.outputs.len()), (30, 2));
    assert_eq!(comparison.outputs[1].rms, plain.rms[1]);
    assert!(plain.rms[1] > 0.0 && plain.largest[1] >= plain.rms[1] && plain.correction_rms[1] > 30.0 * plain.rms[1]);
    assert_eq!((comparison.outputs[1].name.as_str(), comparison.outputs[1].unit.as_str()), ("velocity", "m/s"));
    let other = network(&mut numbers, 4, &[], 2, true);
    assert_eq!(compare(&model, &other, &rows), Err(ComparisonError::Shape { what: "inputs", expected: 3, found: 4 }));
}
