//! The emulated microcontroller computes the same bits as the host, and its instruction counts repeat.

use std::{fs, path::PathBuf, time::Duration};

use impromptu_tests::emulator::{build_firmware, run};
use nalgebra::{UnitQuaternion, Vector3};

#[path = "../../firmware/src/bin/netduinoplus2/rotation.rs"]
mod rotation;

/// Far more than a run needs: about 0.2 s for 5,000 ticks.
const TIMEOUT: Duration = Duration::from_secs(60);

/// An empty folder for the test `name`.
fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn bytes(values: impl IntoIterator<Item = f32>) -> Vec<u8> {
    values.into_iter().flat_map(f32::to_le_bytes).collect()
}

#[test]
fn every_bit_equals_the_host_and_instruction_counts_repeat() {
    let elf = build_firmware("netduinoplus2", &[]).unwrap();
    let folder = folder("emulator-bits");
    let rates: Vec<_> = (0..5_000u16)
        .map(|tick| {
            let time = f32::from(tick) * 0.002;
            Vector3::new(3.0 * (5.0 * time).sin(), 2.0 * (6.5 * time).cos(), time.sin())
        })
        .collect();
    let input = bytes(rates.iter().flat_map(|rate| [rate.x, rate.y, rate.z]));
    fs::write(folder.join("input.bin"), input).unwrap();

    let first = run(&elf, &folder, TIMEOUT).unwrap().report().unwrap();
    let output = fs::read(folder.join("output.bin")).unwrap();
    let second = run(&elf, &folder, TIMEOUT).unwrap().report().unwrap();

    assert_eq!(output.len(), rates.len() * 16);
    let mut attitude = UnitQuaternion::identity();
    for (tick, (rate, record)) in rates.iter().zip(output.chunks_exact(16)).enumerate() {
        attitude = rotation::step(&attitude, rate);
        let expected = bytes([attitude.w, attitude.i, attitude.j, attitude.k]);
        assert_eq!(record, expected, "first difference at tick {tick}");
    }

    assert_eq!(first, second, "two runs of the same input");
    assert_eq!(first["ticks"], 5_000);
    assert_eq!(first["instructions"]["step"]["runs"], 5_000);
    assert!(first["instructions"]["step"]["most"].as_u64().unwrap() > 100);
    let stack = first["stack_used_bytes"].as_u64().unwrap();
    assert!((64..8_192).contains(&stack), "{stack} bytes of stack");
}

#[test]
fn bad_input_ends_the_board_with_a_reason() {
    let elf = build_firmware("netduinoplus2", &[]).unwrap();
    let folder = folder("emulator-refuses");
    let missing = run(&elf, &folder, TIMEOUT).unwrap();
    assert_eq!(missing.status.code(), Some(1));
    assert!(missing.stderr.contains("input.bin"), "{missing:?}");

    fs::write(folder.join("input.bin"), [0; 13]).unwrap();
    let broken = run(&elf, &folder, TIMEOUT).unwrap();
    assert_eq!(broken.status.code(), Some(1));
    assert!(broken.stderr.contains("13 bytes"), "{broken:?}");
    assert!(!folder.join("output.bin").exists());
    assert!(broken.report().is_err());
}

#[test]
fn a_board_that_does_not_end_is_stopped() {
    let elf = build_firmware("netduinoplus2", &[]).unwrap();
    let error = run(&elf, &folder("emulator-timeout"), Duration::ZERO).unwrap_err();
    assert!(error.to_string().contains("did not end within 0 s"), "{error}");
}
