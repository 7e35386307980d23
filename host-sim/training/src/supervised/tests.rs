use super::quantisation::with_rounded_weights;
use super::*;
use rand_distr::StandardNormal;

/// Three labels of four inputs: mostly linear, with a smooth nonlinear rest.
fn toy(rows: usize, seed: u64, noise: f32) -> Dataset {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut normal = || -> f32 { StandardNormal.sample(&mut generator) };
    let (mut inputs, mut labels) = (RowMatrix::new(4), RowMatrix::new(3));
    for _ in 0..rows {
        let x: [f32; 4] = std::array::from_fn(|_| normal());
        let y =
            [5.0 + 2.0 * x[0] - x[1] + 0.3 * (2.0 * x[0]).sin(), 0.01 * (x[2] + 0.3 * x[0] * x[3]), -x[3] + 0.2 * x[1] * x[1]];
        inputs.push(&x.map(|value| 10.0 * value + 3.0));
        labels.push(&[y[0] + noise * normal(), y[1] + 0.01 * noise * normal(), y[2] + noise * normal()]);
    }
    Dataset::new(inputs, labels).unwrap()
}

fn settings() -> TrainingSettings {
    TrainingSettings { hidden: vec![24, 24], epochs: 25, batch: 64, learning_rate: 5e-3, seed: 3, ..Default::default() }
}

fn run(settings: &TrainingSettings, training: &Dataset, validation: &Dataset) -> Training {
    train(settings, training, validation, &mut |_| {}).unwrap()
}

/// Mean square of the normalised errors of the network as others evaluate it.
fn error(network: &FloatNetwork, data: &Dataset) -> f64 {
    let total: f64 = (0..data.rows())
        .flat_map(|row| {
            let outputs = network.evaluate(data.inputs().row(row));
            let labels = data.labels().row(row).to_vec();
            outputs.into_iter().zip(labels).zip(&network.output_scale)
        })
        .map(|((output, label), scale)| f64::from((output - label) / scale).powi(2))
        .sum();
    total / (data.rows() * network.outputs()) as f64
}

#[test]
fn a_network_beats_the_ridge_it_refines() {
    let (training, validation) = (toy(2000, 1, 0.0), toy(300, 2, 0.0));
    let ridge = error(&Ridge::fit(&training, 1e-6).unwrap().to_network(), &validation);
    for (skip, activation) in
        [(Skip::Frozen, Activation::Tanh), (Skip::Joint, Activation::Relu), (Skip::Absent, Activation::Tanh)]
    {
        let result = run(&TrainingSettings { skip, activation, ..settings() }, &training, &validation);
        let found = error(&result.network, &validation);
        assert!(found < 0.1 * ridge, "{skip:?} {activation:?}: {found} against ridge {ridge}");
        let reported = result.history[result.best].validation_loss;
        assert!((found / reported - 1.0).abs() < 1e-3, "{skip:?}: reported {reported}, evaluated {found}");
        assert_eq!(result.network.skip.is_some(), skip != Skip::Absent);
        let linear = Ridge::fit(&training, 1e-6).unwrap().to_network().skip;
        assert_eq!(result.network.skip == linear, skip == Skip::Frozen);
    }
}

#[test]
fn same_seed_same_bytes_on_parallel_threads() {
    let (training, validation) = (toy(500, 1, 0.1), toy(100, 2, 0.1));
    let bytes = |seed| {
        let settings = TrainingSettings { seed, epochs: 4, gradient_clip: Some(0.5), weight_decay: 0.01, ..settings() };
        run(&settings, &training, &validation).network.to_bytes().unwrap()
    };
    let alone = bytes(7);
    std::thread::scope(|scope| {
        let threads = [7, 8, 7].map(|seed| scope.spawn(move || bytes(seed)));
        let [first, other, second] = threads.map(|thread| thread.join().unwrap());
        assert!(alone == first && first == second && other != first);
    });
}

#[test]
fn early_stopping_keeps_the_best_epoch() {
    // 40 noisy rows and a wide network: it must overfit.
    let (training, validation) = (toy(40, 1, 1.0), toy(200, 2, 1.0));
    let overfitting = TrainingSettings {
        hidden: vec![64],
        epochs: 400,
        learning_rate: 2e-2,
        schedule: Schedule::Constant,
        patience: Some(10),
        ..settings()
    };
    let mut calls = 0;
    let result = train(&overfitting, &training, &validation, &mut |progress| {
        assert_eq!((progress.epoch, progress.of), (calls, 400));
        calls += 1;
    })
    .unwrap();
    assert_eq!(calls, result.history.len());
    assert_eq!(result.history.len(), result.best + 11, "stops ten epochs after the best");
    let least = result.history.iter().map(|record| record.validation_loss).fold(f64::INFINITY, f64::min);
    assert!((error(&result.network, &validation) / least - 1.0).abs() < 1e-3);
}

/// A network with random weights and data that it explains exactly, so that all of its error comes from rounding.
fn exact(rows: usize, seed: u64) -> (FloatNetwork, Dataset) {
    let settings = TrainingSettings { hidden: vec![16, 16], initial_output_gain: 1.0, ..settings() };
    let network = FloatNetwork {
        input_mean: vec![3.0; 4],
        input_scale: vec![10.0; 4],
        layers: initial_layers(4, 2, &settings, 1.0),
        skip: None,
        output_mean: vec![1.0; 2],
        output_scale: vec![0.5; 2],
        notes: Default::default(),
    };
    let inputs = toy(rows, seed, 0.0).inputs().clone();
    let mut labels = RowMatrix::new(2);
    inputs.iter().for_each(|row| labels.push(&network.evaluate(row)));
    (network, Dataset::new(inputs, labels).unwrap())
}

#[test]
fn quantisation_aware_training_loses_less_to_rounding() {
    let ((network, training), (_, validation)) = (exact(2000, 1), exact(500, 2));
    let rounded = error(&with_rounded_weights(&network), &validation);
    let aware = TrainingSettings {
        skip: Skip::Absent,
        epochs: 20,
        learning_rate: 5e-4,
        quantisation: Some(FakeQuantisation { activation_bits: Some(14) }),
        ..settings()
    };
    let tuned = fine_tune(&network, &aware, &training, &validation, &mut |_| {}).unwrap();
    let tuned_rounded = error(&with_rounded_weights(&tuned.network), &validation);
    let reported = tuned.history[tuned.best].validation_loss;
    println!("rounded {rounded:.2e}, after aware training {tuned_rounded:.2e}");
    assert!(tuned_rounded < 0.5 * rounded, "{tuned_rounded} against {rounded}");
    // What training imitates is what rounding does; 14 bits of activation add next to nothing.
    assert!((tuned_rounded / reported - 1.0).abs() < 0.05, "{tuned_rounded} reported as {reported}");
}

#[test]
fn outliers_pull_less_with_huber_and_without_weight_not_at_all() {
    let clean = toy(600, 1, 0.0);
    let mut labels = RowMatrix::new(3);
    let mut weights = vec![1.0; 600];
    for (row, weight) in weights.iter_mut().enumerate() {
        let is_outlier = row % 10 == 0;
        let outlier = if is_outlier { 8.0 } else { 0.0 };
        *weight = if is_outlier { 0.0 } else { 1.0 };
        let label = clean.labels().row(row);
        labels.push(&[label[0] + outlier, label[1], label[2] + outlier]);
    }
    let spoilt = Dataset::new(clean.inputs().clone(), labels).unwrap();
    let validation = toy(300, 2, 0.0);
    let absent = TrainingSettings { skip: Skip::Absent, epochs: 100, ..settings() };
    let square = error(&run(&absent, &spoilt, &spoilt).network, &validation);
    let huber_loss = TrainingSettings { loss: Loss::Huber { delta: 0.1 }, ..absent.clone() };
    let huber = error(&run(&huber_loss, &spoilt, &spoilt).network, &validation);
    let ignored = spoilt.with_row_weights(weights).unwrap();
    let weighted = error(&run(&absent, &ignored, &ignored).network, &validation);
    assert!(huber < 0.5 * square && weighted < 0.1 * square, "{square} {huber} {weighted}");
}

#[test]
fn unusable_trainings_are_refused() {
    let (data, wide) = (toy(50, 1, 0.0), Dataset::new(toy(9, 1, 0.0).labels().clone(), toy(9, 1, 0.0).labels().clone()));
    let error = |settings: &TrainingSettings, validation: &Dataset| {
        train(settings, &data, validation, &mut |_| {}).unwrap_err().to_string()
    };
    assert!(error(&settings(), &wide.unwrap()).contains("3 inputs; the network has 4"));
    assert!(error(&TrainingSettings { batch: 0, ..settings() }, &data).contains("`batch`"));
    // What no training has is refused by its name before the first epoch; what is in range one by one may still diverge together.
    let unheard = TrainingSettings { learning_rate: 1e30, ..settings() };
    assert!(error(&unheard, &data).contains("`learning_rate` is 1e30"));
    let explosive = TrainingSettings { learning_rate: 10.0, weight_decay: 1e3, activation: Activation::Relu, ..settings() };
    assert!(error(&explosive, &data).contains("diverged in epoch"));
    let linear = Ridge::fit(&data, 0.1).unwrap().to_network();
    assert_eq!(fine_tune(&linear, &settings(), &data, &data, &mut |_| {}), Err(TrainingError::LastLayer));
}
