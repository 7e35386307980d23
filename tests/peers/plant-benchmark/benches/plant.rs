//! Time of one Runge-Kutta step of the crate `peng_quad`, to be read beside those of our plant:
//! `cargo bench -p impromptu-host-sim --bench plant`.
//!
//! Criterion's throughput is vehicle-steps a second (Melem/s: million steps a second and core). `peng_quad` computes in f32 a
//! rigid body under a given thrust and moment: no motors, rotors, wind or saturation.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use impromptu_host_sim::plant::{GRAVITY, Vehicle};

/// Step of the simulation, s.
const STEP: f64 = 0.002;

/// Steps after which a flight starts anew, so that an uncontrolled vehicle stays within ordinary numbers.
const RESTART: usize = 100;

fn peng_quad(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("peng_quad");
    group.throughput(Throughput::Elements(RESTART as u64));
    let vehicle = Vehicle::named("crazyflie").expect("a built-in vehicle");
    let inertia: Vec<f32> = vehicle.inertia.matrix().iter().map(|value| *value as f32).collect();
    let inertia = <[f32; 9]>::try_from(inertia).expect("nine entries");
    let (mass, gravity) = (vehicle.mass as f32, GRAVITY as f32);
    let mut quadrotor = peng_quad::Quadrotor::new(STEP as f32, mass, gravity, 0.001, inertia).expect("an invertible inertia");
    let start = quadrotor.get_state();
    let torque = Default::default();
    group.bench_function("Runge-Kutta step of 1 flight, f32", |bencher| {
        bencher.iter(|| {
            quadrotor.set_state(&start);
            for _ in 0..RESTART {
                quadrotor.update_dynamics_with_controls_rk4(black_box(mass * gravity), &torque);
            }
            quadrotor.get_state()
        });
    });
    group.finish();
}

criterion_group!(benches, peng_quad);
criterion_main!(benches);
