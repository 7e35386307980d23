//! The whole demo, small.

use crate::program::Folder;

/// One vehicle, one condition, three strokes, one design, seconds of training.
const DEMO: &str = "\
vehicles = ['crazyflie']
conditions = ['clean']
speeds = [1.0]
strokes = 3
extra_delay_ms = 0.0
[recipe]
validation_strokes = 2
validation_speeds = [1.0]
[[recipe.training_flights]]
signal = 'strokes'
flights = 6
seconds = 0.0
max_speed = 1.28
max_acceleration = 4.2
shortest_s = 0.0
[recipe.network]
hidden = [8]
epochs = 2
[recipe.fine_tuning]
hidden = [8]
epochs = 1
learning_rate = 1e-4
quantisation = {}
[recipe.lane]
control_weights = [3e-2]
velocity_weights = [0.2]
noise_factors = [4.0]
fast_limits = [0.05]
";

#[test]
fn the_demo_prints_one_document_and_leaves_its_files() {
    let folder = Folder::new();
    folder.write("demo.toml", DEMO);

    let run = folder.fine("--config demo.toml --seed 4 --out here --format json");
    let table = run.json()["table"].as_array().unwrap().clone();
    assert_eq!(table.len(), 11);
    assert_eq!((table[9]["method"].as_str(), table[9]["seed"].as_u64()), (Some("full_int8"), Some(4)));
    assert!(table[9]["reduction_mean"].as_f64().unwrap() > 80.0, "{}", table[9]);
    assert!(run.stderr.contains("seed 4") && run.stderr.contains("here/report.html"), "{}", run.stderr);
    for file in ["report.html", "table.csv", "flights.csv", "results.json"] {
        assert!(!folder.read(&format!("here/{file}")).is_empty());
    }
    assert_eq!(folder.files("here/models", ".impromptu").len(), 1);

    // The same seed gives the same numbers, and quiet means quiet.
    let again = folder.fine("--config demo.toml --seed 4 --out there --format json --quiet");
    assert_eq!((again.json()["table"].as_array().unwrap(), again.stderr.as_str()), (&table, ""));
    let (here, there) = (folder.files("here/models", "").remove(0), folder.files("there/models", "").remove(0));
    assert_eq!(folder.read(&here), folder.read(&there));
}
