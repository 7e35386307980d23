//! Levenberg-Marquardt to convergence on both systems of the paper: the 3-20-20-1 networks of `study lti`, default settings, on
//! all cores.

use std::time::Instant;

use impromptu_reproduction::siso::{FeatureSet, fixtures, learn, learning::Settings};

fn main() {
    let settings = Settings::default();
    let mut total = 0.0;
    for (name, system) in [("S1", fixtures::minimum_phase()), ("S2", fixtures::non_minimum_phase())] {
        let degree = system.relative_degree();
        for (features, set) in
            [("state-space", FeatureSet::state_space(2, degree)), ("transfer-function", FeatureSet::transfer_function(2, degree))]
        {
            let start = Instant::now();
            let learned = learn(&system, &set, &settings).expect("a network that the firmware takes");
            let seconds = start.elapsed().as_secs_f64();
            total += seconds;
            println!(
                "{name}, {features:<17} {:>2} restarts {seconds:6.2} s, {:>3} steps of the chosen one, f32 kernel's error {:.1e}",
                settings.restarts,
                learned.fit.steps(),
                learned.held_out
            );
        }
    }
    println!("all {total:6.2} s on {} threads", rayon::current_num_threads());
}
