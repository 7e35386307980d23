//! A full training step (gathering the batch, forward, backward, Adam) of the paper's network, 12-128x4-6 ReLU, with 256
//! rows on one core, beside large and small products of the same kernel and of nalgebra (the `matrixmultiply` crate).
//!
//! Criterion's throughput column counts floating-point operations: elements per second are FLOP/s. On a machine that is shared
//! with other work the fastest of many runs says more than the mean; the lines before Criterion's print it, with the median.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use impromptu_model_export::float_network::Activation;
use impromptu_training::supervised::{
    Dataset, NetworkTrainer, RowMatrix, TrainingSettings, matrix_kernel::multiply, padded_matrix::PaddedMatrix, train,
};
use nalgebra::DMatrix;
use std::hint::black_box;
use std::time::Instant;

const BATCH: usize = 256;
const WIDTHS: [usize; 6] = [12, 128, 128, 128, 128, 6];

/// Multiplications and additions of one step: each weight twice forward, twice for its gradient, and, the first layer
/// excepted, twice for the gradient of its inputs.
fn operations_of_a_step() -> u64 {
    let weights: usize = WIDTHS.windows(2).map(|pair| pair[0] * pair[1]).sum();
    (2 * BATCH * (3 * weights - WIDTHS[0] * WIDTHS[1])) as u64
}

fn trainer(activation: Activation) -> NetworkTrainer {
    let (inputs, outputs) = (WIDTHS[0], WIDTHS[5]);
    let table = |columns: usize| {
        let values = (0..BATCH * columns).map(|index| ((index * 7919) % 1009) as f32 / 1009.0);
        RowMatrix::from_values(columns, values.collect()).expect("whole rows")
    };
    let data = Dataset::new(table(inputs), table(outputs)).expect("finite rows");
    let settings = TrainingSettings { hidden: WIDTHS[1..5].to_vec(), activation, epochs: 0, ..Default::default() };
    let network = train(&settings, &data, &data, &mut |_| {}).expect("usable settings").network;
    NetworkTrainer::new(&network, &settings, &data).expect("usable settings")
}

/// Prints the fastest and the median of `runs` runs.
fn print_fastest(name: &str, operations: u64, runs: usize, mut run: impl FnMut()) {
    let mut micros: Vec<f64> = (0..runs)
        .map(|_| {
            let start = Instant::now();
            run();
            start.elapsed().as_secs_f64() * 1e6
        })
        .collect();
    micros.sort_by(f64::total_cmp);
    let (fastest, median) = (micros[0], micros[runs / 2]);
    let rate = |micros: f64| operations as f64 / micros * 1e-3;
    println!(
        "{name:<38} fastest {fastest:7.0} µs {:6.1} GFLOP/s, median {median:7.0} µs {:6.1} GFLOP/s",
        rate(fastest),
        rate(median)
    );
}

fn training(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("training");
    for activation in [Activation::Relu, Activation::Tanh] {
        let mut trainer = trainer(activation);
        let mut step = || {
            trainer.step();
        };
        let name = format!("step 12-128x4-6 {}, batch {BATCH}", activation.name());
        print_fastest(&name, operations_of_a_step(), 2000, &mut step);
        group.throughput(Throughput::Elements(operations_of_a_step()));
        group.bench_function(&name, |bencher| bencher.iter(&mut step));
    }
    let arch = pulp::Arch::new();
    for (rows, depth, columns) in [(1024, 1024, 1024), (256, 128, 128)] {
        let operations = (2 * rows * depth * columns) as u64;
        let runs = if rows > 256 { 30 } else { 2000 };
        group.throughput(Throughput::Elements(operations));
        let fill = |row: usize, column: usize| ((row + 3 * column) % 17) as f32;
        let a = PaddedMatrix::from_fn(rows, depth, fill);
        let b = PaddedMatrix::from_fn(depth, columns, fill);
        let mut c = PaddedMatrix::zeros(rows, columns);
        let mut own = || multiply(arch, black_box(&a), black_box(&b), &mut c);
        let name = format!("product {rows}x{depth}x{columns}");
        print_fastest(&name, operations, runs, &mut own);
        group.bench_function(&name, |bencher| bencher.iter(&mut own));
        let a = DMatrix::from_fn(rows, depth, fill);
        let b = DMatrix::from_fn(depth, columns, fill);
        let mut c = DMatrix::<f32>::zeros(rows, columns);
        let mut other = || c.gemm(1.0, black_box(&a), black_box(&b), 0.0);
        let name = format!("{name}, nalgebra");
        print_fastest(&name, operations, runs, &mut other);
        group.bench_function(&name, |bencher| bencher.iter(&mut other));
    }
    group.finish();
}

criterion_group!(benches, training);
criterion_main!(benches);
