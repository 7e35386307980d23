//! A batch gives the bits of single evaluations.

use impromptu_firmware::{
    model::{DEFAULT_OUTPUTS, Model},
    network::Scratch,
};
use impromptu_model_export::{
    Batch, Precision, encode,
    float_network::Activation::{self, Linear, Relu, Tanh},
};

use crate::fixture::{Numbers, network, rows, unlimited};

/// Bits, the sign of zeros apart.
fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|value| (value + 0.0).to_bits()).collect()
}

/// Inputs, hidden layers, skip.
type Shape<'a> = (usize, &'a [(usize, Activation)], bool);

#[test]
fn every_row_has_the_bits_of_a_single_evaluation() {
    let shapes: [Shape<'_>; 6] = [
        (1, &[], true),
        (3, &[(5, Tanh)], true),
        (12, &[(128, Relu), (128, Relu)], false),
        (7, &[(33, Tanh), (9, Relu), (17, Linear)], true),
        (36, &[(31, Relu)], true),
        (4, &[], false),
    ];
    let mut numbers = Numbers(8);
    for (inputs, hidden, skip) in shapes {
        let float = network(&mut numbers, inputs, hidden, 2, skip);
        let calibration = rows(&mut numbers, &float, 40);
        // Neither whole tiles nor whole blocks, and some far outside of what was calibrated.
        let mut all = rows(&mut numbers, &float, 300);
        all[7].iter_mut().for_each(|value| *value *= 50.0);
        let mut batch = Batch::of_network(&float);
        let mut seen = 0;
        batch.evaluate(all.iter().map(Vec::as_slice), |row, outputs| {
            assert_eq!((row, bits(outputs)), (seen, bits(&float.evaluate(&all[row]))));
            seen += 1;
        });
        assert_eq!(seen, all.len());
        for precision in [Precision::Float, Precision::Int8, Precision::Int16] {
            let bytes = encode(&unlimited(inputs), Some(&float), precision, &calibration).unwrap();
            let model = Model::from_bytes(&bytes).unwrap();
            let mut scratch = Scratch::new();
            Batch::of_model(&model).unwrap().evaluate(all.iter().map(Vec::as_slice), |row, outputs| {
                let mut single = [0.0; DEFAULT_OUTPUTS];
                model.network().unwrap().evaluate(&all[row], &mut single, &mut scratch);
                assert_eq!(bits(outputs), bits(&single[..2]), "{hidden:?}, {precision:?}, row {row}");
            });
        }
    }
}

#[test]
fn calibration_sees_the_largest_magnitude_of_every_layer() {
    let mut numbers = Numbers(9);
    let float = network(&mut numbers, 5, &[(11, Relu), (6, Tanh)], 2, true);
    let all = rows(&mut numbers, &float, 200);
    let mut expected = vec![0.0f32; 4];
    for row in &all {
        let mut values: Vec<f32> = (0..5).map(|i| (row[i] - float.input_mean[i]) / float.input_scale[i]).collect();
        for (index, expected) in expected.iter_mut().enumerate() {
            *expected = values.iter().fold(*expected, |largest, value| largest.max(value.abs()));
            if let Some(layer) = float.layers.get(index) {
                values = layer.evaluate(&values);
            }
        }
    }
    assert_eq!(Batch::of_network(&float).largest_magnitudes(all.iter().map(Vec::as_slice)), expected);
    assert_eq!(Batch::of_network(&float).largest_magnitudes([]), [0.0; 4]);
}
