//! Time of one Runge-Kutta step of the plant, for each vehicle, and of the whole closed loop.
//!
//! Criterion's throughput is vehicle-steps a second (Melem/s: million steps a second and core). `tests/peers/plant-benchmark`
//! measures another simulator.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use impromptu_sim::{
    condition::Condition,
    controller::Controller,
    plant::{BATCH, Disturbance, GRAVITY, Plant, State, States, Variation, Vehicle},
    rollout::{self, FlightPlan},
    trajectory::Trajectory,
};

/// Step of the simulation, s.
const STEP: f64 = 0.002;

/// Steps after which a flight starts anew, so that an uncontrolled vehicle stays within ordinary numbers.
const RESTART: usize = 100;

fn plant(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("plant");
    group.throughput(Throughput::Elements((BATCH * RESTART) as u64));
    for name in Vehicle::names() {
        let vehicle = Vehicle::named(name).expect("a built-in vehicle");
        let plant = Plant::new(&vehicle, [Variation::default(); BATCH]);
        let hover = (vehicle.mass * GRAVITY / (4.0 * vehicle.thrust_coefficient)).sqrt();
        let start = States::splat(&State { velocity: [1.0, 0.5, 0.2], rotor_speeds: [hover; 4], ..State::at_rest([0.0; 3]) });
        let commands = [1.0, 1.001, 1.0, 0.999].map(|factor| [factor * hover; BATCH]);
        let mut disturbance = Disturbance::default();
        disturbance.set_member(0, [1.0, 0.0, 0.0], [0.05, 0.0, 0.0]);
        group.bench_function(BenchmarkId::new("step of 8 flights", name), |bencher| {
            bencher.iter(|| {
                let mut states = start;
                for _ in 0..RESTART {
                    plant.step(&mut states, black_box(&commands), &disturbance, STEP);
                }
                states
            });
        });
    }
    group.finish();
}

/// The whole closed loop on one core: position and attitude loop of the firmware in f32, rotors, drag, Runge-Kutta in f64.
fn closed_loop(criterion: &mut Criterion) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    let vehicle = Vehicle::named("crazyflie").expect("a built-in vehicle");
    let settings = rollout::settings(&vehicle, "stock").expect("built-in gains");
    let condition = Condition::named("clean").expect("a built-in condition");
    let trajectory = Trajectory::by_name("figure8", 100.0).expect("a built-in trajectory");
    let plans: Vec<FlightPlan<'_>> = (0..8 * BATCH as u64).map(|seed| FlightPlan::new(&trajectory, seed)).collect();
    let mut group = criterion.benchmark_group("closed loop");
    group.throughput(Throughput::Elements((plans.len() * trajectory.samples.len() * 5) as u64));
    group.sample_size(20);
    group.bench_function("500 Hz steps on one core", |bencher| {
        bencher.iter(|| {
            pool.install(|| rollout::fly(&vehicle, Controller::Se3, &settings, &condition, black_box(&plans)).expect("flights"))
        });
    });
    group.finish();
}

criterion_group!(benches, plant, closed_loop);
criterion_main!(benches);
