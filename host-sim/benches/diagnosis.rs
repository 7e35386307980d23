//! The diagnosis of a quarter of an hour at 1 kHz, 900,000 rows, beside that of a minute at 50 Hz.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use impromptu_diagnosis::{Record, Settings, diagnose};

/// A loop of 1.2 Hz under steps that a linear congruence draws, with as much noise as a motion-capture system has.
fn record(rate_hz: f64, seconds: f64) -> Record {
    let mut state = 7u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1u32 << 31) - 0.5
    };
    let (natural, period) = (std::f64::consts::TAU * 1.2, 1.0 / rate_hz);
    let (mut height, mut left, mut place, mut speed) = (0.0, 0.0, 0.0, 0.0);
    let rows = (seconds * rate_hz) as usize;
    let (mut time, mut reference, mut measured) = (Vec::new(), Vec::new(), Vec::new());
    for row in 0..rows {
        if left <= 0.0 {
            (height, left) = (2.0 * uniform(), 0.3 + 2.7 * (uniform() + 0.5));
        }
        left -= period;
        time.push(row as f64 * period);
        reference.push(height);
        measured.push(place + 0.006 * uniform());
        speed += period * (natural * natural * (height - place) - 1.4 * natural * speed);
        place += period * speed;
    }
    Record::new(&time, &reference, &measured).expect("finite and even")
}

fn bench(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("diagnosis");
    group.sample_size(10);
    for (name, rate_hz, seconds) in [("a quarter of an hour at 1 kHz", 1000.0, 900.0), ("a minute at 50 Hz", 50.0, 60.0)] {
        let record = record(rate_hz, seconds);
        group.bench_function(name, |bencher| {
            bencher.iter(|| diagnose(black_box(&record), &Settings::default()).expect("a loop that is found"))
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
