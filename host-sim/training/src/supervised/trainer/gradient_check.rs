//! The analytic gradient in f32 against central differences of a plain loss in f64.

use super::super::dataset::RowMatrix;
use super::*;
use impromptu_model_export::float_network::DenseLayer;

/// Smooth but irregular numbers round zero.
fn irregular(index: usize) -> f32 {
    ((index as f32 * 12.9898).sin() * 43_758.547).fract() - 0.5
}

fn network(hidden: Activation) -> FloatNetwork {
    let mut counter = 0;
    let mut some = |count: usize, scale: f32| -> Vec<f32> {
        counter += count;
        (counter - count..counter).map(|index| scale * irregular(index)).collect()
    };
    let layers = [(5, 20, hidden), (20, 17, hidden), (17, 3, Activation::Linear)];
    FloatNetwork {
        input_mean: some(5, 1.0),
        input_scale: vec![0.5, 1.0, 2.0, 1.5, 0.8],
        layers: layers
            .map(|(inputs, outputs, activation)| DenseLayer {
                weights: some(inputs * outputs, 1.2),
                bias: some(outputs, 0.5),
                activation,
            })
            .to_vec(),
        skip: Some(some(15, 1.0)),
        output_mean: vec![0.1, 0.2, -0.3],
        output_scale: vec![1.0, 2.0, 0.5],
        notes: Default::default(),
    }
}

fn dataset(rows: usize) -> Dataset {
    let table = |columns: usize, from: usize| {
        RowMatrix::from_values(columns, (0..rows * columns).map(|index| 3.0 * irregular(from + index)).collect()).unwrap()
    };
    let weights = (0..rows).map(|row| 0.5 + (row % 3) as f32).collect();
    Dataset::new(table(5, 10_000), table(3, 20_000)).unwrap().with_row_weights(weights).unwrap()
}

/// The mean loss in f64, written from the definitions.
fn plain_loss(network: &FloatNetwork, parameters: &[Vec<f64>], data: &Dataset, settings: &TrainingSettings) -> f64 {
    let mut total = 0.0;
    for (row, row_weight) in data.relative_row_weights().iter().enumerate() {
        let inputs = data.inputs().row(row).iter().zip(network.input_mean.iter().zip(&network.input_scale));
        let normalised: Vec<f64> = inputs.map(|(x, (mean, scale))| f64::from((x - mean) / scale)).collect();
        let mut values = normalised.clone();
        let times = |weights: &[f64], values: &[f64], output: usize| -> f64 {
            weights[output * values.len()..].iter().zip(values).map(|(weight, value)| weight * value).sum()
        };
        for (index, layer) in network.layers.iter().enumerate() {
            let (weights, bias) = (&parameters[2 * index], &parameters[2 * index + 1]);
            let sums = bias.iter().enumerate().map(|(output, bias)| bias + times(weights, &values, output));
            values = sums
                .map(|sum| match layer.activation {
                    Activation::Relu => sum.max(0.0),
                    Activation::Tanh => sum.tanh(),
                    Activation::Linear => sum,
                })
                .collect();
        }
        for (output, value) in values.iter().enumerate() {
            let answer = value + times(&parameters[2 * network.layers.len()], &normalised, output);
            let label = data.labels().row(row)[output] - network.output_mean[output];
            let error = (answer - f64::from(label / network.output_scale[output])).abs();
            let loss = match settings.loss {
                Loss::Huber { delta } if error > f64::from(delta) => f64::from(delta) * (2.0 * error - f64::from(delta)),
                _ => error * error,
            };
            total += row_weight * f64::from(settings.output_weights[output]) * loss;
        }
    }
    total / (data.rows() * network.outputs()) as f64
}

/// The largest error of any component of the gradient, relative to the largest component of its tensor.
fn worst_error(hidden: Activation, loss: Loss) -> f64 {
    let (network, data) = (network(hidden), dataset(37));
    let output_weights = vec![1.0, 0.5, 2.0];
    let settings = TrainingSettings { skip: Skip::Joint, loss, output_weights, batch: 64, ..Default::default() };
    let mut trainer = NetworkTrainer::new(&network, &settings, &data).unwrap();
    trainer.gradient_from(0);
    let gain = f64::from(trainer.gain);
    let gradient = |parameter: &Parameter| {
        let gradient = Parameter::new(parameter.gradient.clone()).to_rows_of_outputs();
        // The loss is gain² times the plain one; what adds up to the output is gain times the plain weights.
        gradient.iter().map(|value| f64::from(*value)).collect::<Vec<f64>>()
    };
    let mut analytic: Vec<Vec<f64>> =
        trainer.engine.layers.iter().flat_map(|layer| [gradient(&layer.weights), gradient(&layer.bias)]).collect();
    analytic.push(gradient(trainer.engine.skip.as_ref().unwrap()));
    let wide = |values: &[f32]| values.iter().map(|value| f64::from(*value)).collect::<Vec<_>>();
    let mut parameters: Vec<Vec<f64>> =
        network.layers.iter().flat_map(|layer| [wide(&layer.weights), wide(&layer.bias)]).collect();
    parameters.push(wide(network.skip.as_ref().unwrap()));

    let mut worst = 0.0f64;
    for tensor in 0..parameters.len() {
        let scale = if tensor >= 4 { gain } else { gain * gain };
        let largest = analytic[tensor].iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
        assert!(largest > 0.0, "tensor {tensor} has a gradient");
        for index in 0..parameters[tensor].len() {
            let middle = parameters[tensor][index];
            let step = 1e-6;
            let mut at = |value: f64| {
                parameters[tensor][index] = value;
                plain_loss(&network, &parameters, &data, &settings)
            };
            let difference = (at(middle + step) - at(middle - step)) / (2.0 * step) * scale;
            at(middle);
            worst = worst.max((difference - analytic[tensor][index]).abs() / largest);
        }
    }
    worst
}

#[test]
fn gradients_equal_central_differences() {
    for (hidden, loss) in [
        (Activation::Relu, Loss::MeanSquare),
        (Activation::Tanh, Loss::MeanSquare),
        (Activation::Tanh, Loss::Huber { delta: 0.7 }),
    ] {
        let worst = worst_error(hidden, loss);
        println!("{hidden:?} {loss:?}: largest relative error of the gradient {worst:.1e}");
        assert!(worst < 5e-6, "{hidden:?} {loss:?}: {worst}");
    }
}
