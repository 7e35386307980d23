//! Rows evaluated in batches against the same rows one by one, in one run: float network and int8 model of the 12-128x4-6 net and
//! of a 3-20-20-1 tanh net. The lines before Criterion's print the ratio of the fastest of many passes, which other work on the
//! machine disturbs least.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use impromptu_firmware::{
    features::{Feature, Relative, Source},
    model::{DEFAULT_OUTPUTS, Model},
    network::Scratch,
    preview::EndRule,
};
use impromptu_model_export::{
    Batch, Description, FloatNetwork, Precision,
    description::{ChannelDescription, Provenance, Signals, Timing},
    encode,
    float_network::{Activation, DenseLayer},
};
use std::{hint::black_box, time::Instant};

const ROWS: usize = 1024;

/// One evaluation of all rows.
type Pass<'a> = Box<dyn FnMut() + 'a>;

/// Within ±1, the same in every run.
fn number(state: &mut u64) -> f32 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 40) as f32 / 8_388_608.0 - 1.0
}

fn network(widths: &[usize], activation: Activation) -> FloatNetwork {
    let mut state = 1;
    let layers = widths.windows(2).enumerate().map(|(index, pair)| DenseLayer {
        weights: (0..pair[0] * pair[1]).map(|_| number(&mut state) * (3.0 / pair[0] as f32).sqrt()).collect(),
        bias: (0..pair[1]).map(|_| 0.1 * number(&mut state)).collect(),
        activation: if index + 2 == widths.len() { Activation::Linear } else { activation },
    });
    let (inputs, outputs) = (widths[0], widths[widths.len() - 1]);
    FloatNetwork {
        input_mean: vec![0.0; inputs],
        input_scale: vec![1.0; inputs],
        layers: layers.collect(),
        skip: None,
        output_mean: vec![0.0; outputs],
        output_scale: vec![1.0; outputs],
        notes: Default::default(),
    }
}

fn description(inputs: usize, outputs: usize) -> Description {
    let channel = |index: usize| ChannelDescription {
        name: format!("channel.{index}"),
        unit: "m".into(),
        frame: "world ENU".into(),
        end: EndRule::Hold,
    };
    let channels: Vec<_> = (0..outputs).map(channel).collect();
    Description {
        name: "bench".into(),
        provenance: Provenance::default(),
        signals: Signals { desired: channels.clone(), measured: vec![], reference: channels },
        timing: Timing {
            reference_rate_hz: 100.0,
            divisor: 2,
            interpolation: impromptu_firmware::model::Interpolation::Hold,
            measurement_delay_s: 0.0,
            fade_s: 0.0,
        },
        features: (0..inputs)
            .map(|offset| Feature { source: Source::Desired, channel: 0, offset: offset as i16, relative: Relative::Nothing })
            .collect(),
        outputs: (0..outputs)
            .map(|channel| impromptu_firmware::model::Output { channel: channel as u8, limit: 1.0, slew: 1.0 })
            .collect(),
        envelope: vec![(-1.0, 1.0); inputs],
        feedback_lane: None,
        monitor: None,
        tie: None,
    }
}

/// Fastest of many passes, ns a row.
fn fastest(mut pass: impl FnMut()) -> f64 {
    let times = (0..40).map(|_| {
        let start = Instant::now();
        pass();
        start.elapsed().as_secs_f64() * 1e9 / ROWS as f64
    });
    times.fold(f64::INFINITY, f64::min)
}

fn batch(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("batch");
    group.throughput(Throughput::Elements(ROWS as u64));
    let nets: [(&str, &[usize], Activation); 2] =
        [("12-128x4-6", &[12, 128, 128, 128, 128, 6], Activation::Relu), ("3-20-20-1 tanh", &[3, 20, 20, 1], Activation::Tanh)];
    for (name, widths, activation) in nets {
        let float = network(widths, activation);
        let mut state = 2;
        let rows: Vec<Vec<f32>> = (0..ROWS)
            .map(|_| widths[..1].iter().flat_map(|&n| (0..n).map(|_| number(&mut state)).collect::<Vec<_>>()).collect())
            .collect();
        let slices = || rows.iter().map(Vec::as_slice);
        let bytes = encode(&description(widths[0], float.outputs()), Some(&float), Precision::Int8, &rows).expect("fits");
        let model = Model::from_bytes(&bytes).expect("just made");
        let integer = model.network().expect("has one");
        let mut float_batch = Batch::of_network(&float);
        let mut integer_batch = Batch::of_model(&model).expect("has one");
        let mut scratch = Scratch::new();
        let mut outputs = [0.0; DEFAULT_OUTPUTS];
        let mut passes: [(&str, Pass<'_>); 4] = [
            ("float, one by one", Box::new(|| rows.iter().for_each(|row| drop(black_box(float.evaluate(row)))))),
            (
                "float, batch",
                Box::new(|| {
                    float_batch.evaluate(slices(), |_, outputs| {
                        black_box(outputs[0]);
                    })
                }),
            ),
            (
                "int8, one by one",
                Box::new(|| {
                    for row in &rows {
                        integer.evaluate(row, &mut outputs, &mut scratch);
                        black_box(outputs[0]);
                    }
                }),
            ),
            (
                "int8, batch",
                Box::new(|| {
                    integer_batch.evaluate(slices(), |_, outputs| {
                        black_box(outputs[0]);
                    })
                }),
            ),
        ];
        let times = passes.each_mut().map(|(_, pass)| fastest(pass));
        for pair in 0..2 {
            let (one, many) = (times[2 * pair], times[2 * pair + 1]);
            println!(
                "{name:<16} {:<18} {one:9.0} ns, {:<14} {many:8.0} ns a row: ratio {:.1}",
                passes[2 * pair].0,
                passes[2 * pair + 1].0,
                one / many
            );
        }
        for (kind, pass) in &mut passes {
            group.bench_function(format!("{name}, {kind}"), |bencher| bencher.iter(&mut **pass));
        }
    }
    group.finish();
}

criterion_group! { name = benches; config = Criterion::default().sample_size(20); targets = batch }
criterion_main!(benches);
