//! What holds for every trajectory, whatever made it.

use super::sample::{distance, norm};
use super::*;
use proptest::prelude::*;
use std::path::Path;

/// One of each kind, short.
const NAMES: [&str; 14] = [
    "strokes:1:0",
    "strokes:1:3",
    "circle",
    "figure8",
    "lissajous",
    "helix",
    "trefoil",
    "star",
    "letters:DSL",
    "multisine:4:30",
    "spline:4:30",
    "tones:60",
    "tone:z",
    "tone:x:0.3:1.5",
];

#[test]
fn velocity_and_acceleration_are_the_derivatives_of_position() {
    const STEP: f64 = 1e-4;
    for name in NAMES {
        let motion = by_name(name).expect(name).scaled(1.3);
        let count = (motion.duration() / 0.0371) as usize;
        for i in 1..count {
            let time = i as f64 * 0.0371;
            let (before, here, after) = (motion.at(time - STEP), motion.at(time), motion.at(time + STEP));
            for k in 0..3 {
                let velocity = (after.position[k] - before.position[k]) / (2.0 * STEP);
                let acceleration = (after.velocity[k] - before.velocity[k]) / (2.0 * STEP);
                assert!((velocity - here.velocity[k]).abs() < 1e-5, "{name} at {time}");
                assert!((acceleration - here.acceleration[k]).abs() < 1e-3, "{name} at {time}");
            }
        }
    }
}

#[test]
fn acceleration_is_continuous_from_hover_to_hover() {
    for name in NAMES {
        let trajectory = Trajectory::by_name(name, 1000.0).expect(name);
        let ends = [trajectory.samples[0], trajectory.samples[trajectory.samples.len() - 1]];
        assert!(ends.iter().all(|s| norm(s.velocity) == 0.0 && norm(s.acceleration) == 0.0));
        for pair in trajectory.samples.windows(2) {
            assert!(distance(pair[0].acceleration, pair[1].acceleration) < 0.06, "{name}");
            assert!(distance(pair[0].velocity, pair[1].velocity) < 0.01, "{name}");
            assert!(pair[0].position[2] > 0.0, "{name}");
        }
    }
}

#[test]
fn the_drawn_part_lies_between_the_hovers() {
    let trajectory = Trajectory::by_name("circle", 100.0).expect("known");
    assert_eq!(trajectory.scored, 100..100 + 1401);
    assert_eq!(trajectory.samples.len(), 1501 + 150);
    assert!((trajectory.drawn_seconds() - 14.0).abs() < 1e-12);
    assert_eq!(trajectory.name, "circle");
}

#[test]
fn before_and_after_the_end_points_are_held_at_rest() {
    let text = "t,x,y,z\n0,0,0,1\n1,1,0,1\n2,2,0,1\n3,3,0,1\n";
    let trajectory = read(text.as_bytes(), "line.csv").and_then(|m| m.sampled(50.0)).expect("good");
    let inside = trajectory.sample_at(50 + 75);
    assert!((inside.position[0] - 1.5).abs() < 1e-12 && (inside.velocity[0] - 1.0).abs() < 1e-12);
    for (tick, x) in [(i64::MIN, 0.0), (-1, 0.0), (0, 0.0), (100_000, 3.0), (i64::MAX, 3.0)] {
        let held = trajectory.sample_at(tick);
        assert!((held.position[0] - x).abs() < 1e-12, "{tick}");
        assert_eq!((held.velocity, held.acceleration), ([0.0; 3], [0.0; 3]));
    }
}

#[test]
fn strokes_never_change() {
    // Every bit counts: trained models and published tables refer to strokes by seed and index.
    let stroke = Trajectory::by_name("strokes:7:0", 100.0).expect("known");
    let crc = crc::Crc::<u64>::new(&crc::CRC_64_XZ);
    let mut digest = crc.digest();
    for sample in &stroke.samples {
        let numbers = [sample.position, sample.velocity, sample.acceleration];
        for number in numbers.as_flattened() {
            digest.update(&number.to_bits().to_le_bytes());
        }
    }
    assert_eq!(digest.finalize(), 4_432_953_872_713_052_210, "stroke of {} samples", stroke.samples.len());
}

#[test]
fn names_are_refused_with_the_list_of_known_ones() {
    for (name, part) in [
        ("circel", "`circel` is not a known name"),
        ("", "is not a known name"),
        ("strokes:1", "INDEX is missing"),
        ("strokes:one:1", "SEED is `one`"),
        ("circle:3", "argument `3` is surplus"),
        ("multisine:1:1e9", "expected a number from 6 to 3600"),
        ("multisine:1:NaN", "expected a number from 6 to 3600"),
        ("tone:w", "expected x, y or z"),
    ] {
        let error = by_name(name).expect_err(name).to_string();
        assert!(error.contains(part) && error.contains("letters:TEXT"), "{error}");
    }
    for rate in [0.0, -1.0, f64::NAN, 1e6] {
        assert!(matches!(Trajectory::by_name("circle", rate), Err(TrajectoryError::Rate { .. })));
    }
    let error = Trajectory::load(Path::new("no/such/file.csv"), 100.0).expect_err("absent");
    assert!(error.to_string().contains("no/such/file.csv: cannot be read"));
}

#[test]
fn a_file_that_lasts_for_ever_is_refused() {
    let text = "t,x,y,z\n0,0,0,1\n1,1,0,1\n2,2,0,1\n1e300,3,0,1\n";
    let motion = read(text.as_bytes(), "long.csv").expect("finite numbers");
    assert!(matches!(motion.sampled(100.0), Err(TrajectoryError::TooLong { .. })));
}

/// Fields as they appear in broken files.
fn field() -> impl Strategy<Value = String> {
    prop_oneof![
        6 => (-3.0..3.0_f64).prop_map(|x| x.to_string()),
        1 => any::<f64>().prop_map(|x| x.to_string()),
        1 => prop::sample::select(vec!["", "NaN", "inf", "-0", "1e308", "1e-320", "\"", "x", "0x1", "1,2", "\u{feff}"])
            .prop_map(String::from),
    ]
}

/// A file that is nearly right: a good header, rows of roughly the right length, growing times.
fn nearly_right() -> impl Strategy<Value = String> {
    let row = |columns: usize| prop::collection::vec(field(), columns.saturating_sub(1)..=columns);
    let rows = |columns: usize| prop::collection::vec(row(columns), 0..8);
    let table = rows(4).prop_map(|rows| {
        let lines = rows.iter().enumerate().map(|(t, row)| format!("{t},{}\n", row.join(",")));
        format!("t,x,y,z,yaw\n{}", lines.collect::<String>())
    });
    let segments = rows(33).prop_map(|rows| {
        let powers = |axis: &str| (0..8).map(|p| format!(",{axis}^{p}")).collect::<String>();
        let lines = rows.iter().map(|row| row.join(",") + "\n");
        let header = ["x", "y", "z", "yaw"].map(powers).concat();
        format!("duration{header}\n{}", lines.collect::<String>())
    });
    prop_oneof![table, segments]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(400) })]

    #[test]
    fn any_bytes_are_flown_finitely_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let _ = read(&bytes[..], "bytes");
    }

    #[test]
    fn nearly_right_files_are_flown_finitely_or_refused(text in nearly_right()) {
        match read(text.as_bytes(), "f.csv").and_then(|motion| motion.sampled(20.0)) {
            Ok(trajectory) => prop_assert!(trajectory.samples.iter().all(Sample::is_finite)),
            Err(error) => prop_assert!(error.to_string().starts_with("f.csv")),
        }
    }

    #[test]
    fn any_name_is_known_or_refused(name in "[a-z0-9:]{0,20}|tone:[xyz]:[0-9.e-]{1,4}:[0-9.e-]{1,4}|letters:.{0,4}") {
        let _ = by_name(&name);
    }
}
