//! The emulated microcontroller refuses bad input by name, and the tests never hang on it.

use std::{fs, path::PathBuf, time::Duration};

use impromptu_tests::{
    board,
    emulator::{FIRMWARE, build_firmware, run},
};

use crate::board::{flight, model};

/// An empty folder for the test `name`.
fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    fs::create_dir_all(&folder).unwrap();
    folder
}

#[test]
fn a_recording_that_cannot_be_flown_again_ends_the_board_with_a_reason() {
    let flight = flight::fly(None, 20, |_| None);
    let length = flight.recording.len();
    let damaged = |at: usize, byte: u8| {
        let mut recording = flight.recording.clone();
        recording[at] = byte;
        recording
    };
    let record = impromptu_flight::replay::RECORD;
    let cases = [
        ("missing", Vec::new(), "recording.bin in the folder"),
        ("truncated", flight.recording[..length - record].to_vec(), "recording.bin in the folder"),
        ("not a recording", damaged(0, b'X'), "not a recorded flight"),
        ("version", damaged(8, 9), "format version 9"),
        ("kind", damaged(length - 2 * record, 77), "tick 19: a record of unknown kind 77"),
        ("ticks", damaged(length - record + 4, 21), "20 ticks and says 21"),
        ("model", damaged(10, 1), "this binary holds none: build with IMPROMPTU_MODEL=FILE"),
    ];
    for (name, recording, reason) in cases {
        let (output, _) = board::start(&format!("refused {name}"), None, &recording).unwrap();
        assert_eq!(output.status.code(), Some(1), "{name}: {output:?}");
        assert!(output.stderr.contains(reason), "{name}: {output:?}");
        assert!(output.report().is_err());
    }
}

#[test]
fn a_damaged_model_ends_the_board_with_the_refusal() {
    let flight = flight::fly(None, 20, |_| None);
    let mut file = model::file(&model::Shape { hidden: &[], ..model::TANH }, impromptu_model_export::Precision::Float);
    let last = file.len() - 1;
    file[last] ^= 1;
    let (output, answers) = board::start("refused damaged model", Some(&file), &flight.recording).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(output.stderr.contains("the model in this binary: check sum"), "{output:?}");
    assert_eq!(answers, None);
}

#[test]
fn a_board_that_does_not_end_is_stopped() {
    let elf = build_firmware("impromptu-board", "netduinoplus2", FIRMWARE, &[]).unwrap();
    let error = run(&elf, &folder("emulator-timeout"), Duration::ZERO).unwrap_err();
    assert!(error.to_string().contains("did not end within 0 s"), "{error}");
}
