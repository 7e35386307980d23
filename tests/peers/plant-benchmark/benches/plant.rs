//! Time of one Runge-Kutta step of the crate `peng_quad`, to be read beside those of our plant, whose benchmark is called `plant`
//! as well.
//!
//! Criterion's throughput is vehicle-steps a second (Melem/s: million steps a second and core). `peng_quad` computes in f32 a
//! rigid body under a given thrust and moment: no motors, rotors, wind or saturation.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};

/// Step of the simulation, s.
const STEP: f32 = 0.002;
/// Steps after which a flight starts anew, so that an uncontrolled vehicle stays within ordinary numbers.
const RESTART: usize = 100;
/// m/s²
const GRAVITY: f32 = 9.81;
/// Of a Crazyflie 2.0, kg; what a step costs does not depend on it.
const MASS: f32 = 0.03;
/// Of the same, about the centre of mass, row by row, kg m².
const INERTIA: [f32; 9] = [1.43e-5, 0.0, 0.0, 0.0, 1.43e-5, 0.0, 0.0, 0.0, 2.89e-5];

fn peng_quad(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("peng_quad");
    group.throughput(Throughput::Elements(RESTART as u64));
    let mut quadrotor = peng_quad::Quadrotor::new(STEP, MASS, GRAVITY, 0.001, INERTIA).expect("an invertible inertia");
    let start = quadrotor.get_state();
    let torque = Default::default();
    group.bench_function("Runge-Kutta step of 1 flight, f32", |bencher| {
        bencher.iter(|| {
            quadrotor.set_state(&start);
            for _ in 0..RESTART {
                quadrotor.update_dynamics_with_controls_rk4(black_box(MASS * GRAVITY), &torque);
            }
            quadrotor.get_state()
        });
    });
    group.finish();
}

criterion_group!(benches, peng_quad);
criterion_main!(benches);
