//! Flies recordings again on the emulated board and compares every bit.

use std::{fs, path::PathBuf, time::Duration};

use anyhow::{Context, Result, bail, ensure};
use impromptu_firmware::model::file;
use impromptu_flight::replay::{ANSWER, Recorded};

use crate::emulator::{FIRMWARE, Output, build_firmware, run, target_folder};

/// Far more than a flight needs: about a second for 7,500 ticks.
const TIMEOUT: Duration = Duration::from_secs(120);

/// Names of the numbers in an answer.
const ANSWER_NAMES: [&str; ANSWER / 4] = [
    "motor 1",
    "motor 2",
    "motor 3",
    "motor 4",
    "reference position x",
    "reference position y",
    "reference position z",
    "reference velocity x",
    "reference velocity y",
    "reference velocity z",
];

/// Builds the emulated board with the bytes of a model file in its flash, or with none; gives the ELF file.
pub fn build(model: Option<&[u8]>) -> Result<PathBuf> {
    let Some(bytes) = model else { return build_firmware("impromptu-board", "netduinoplus2", FIRMWARE, &[]) };
    let folder = target_folder().join("models");
    fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
    let path = folder.join(format!("{:08x}.model", file::checksum(bytes)));
    if fs::read(&path).ok().as_deref() != Some(bytes) {
        fs::write(&path, bytes).with_context(|| format!("cannot write {}", path.display()))?;
    }
    let path = path.canonicalize()?;
    let path = path.to_str().context("the target folder's name is not Unicode")?;
    build_firmware("impromptu-board", "netduinoplus2", FIRMWARE, &[("IMPROMPTU_MODEL", path)])
}

/// Starts the board with a recording in its folder, named after the flight `name`; gives what it printed, and the answers if it
/// wrote any.
pub fn start(name: &str, model: Option<&[u8]>, recording: &[u8]) -> Result<(Output, Option<Vec<u8>>)> {
    let elf = build(model)?;
    let folder = target_folder().join("flights").join(name.replace(|c: char| !c.is_ascii_alphanumeric(), "-"));
    if folder.exists() {
        fs::remove_dir_all(&folder).with_context(|| format!("cannot remove {}", folder.display()))?;
    }
    fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
    fs::write(folder.join("recording.bin"), recording)?;
    let output = run(&elf, &folder, TIMEOUT)?;
    Ok((output, fs::read(folder.join("answers.bin")).ok()))
}

/// Flies `flight` again on the board, with the model file that it was recorded with, and gives the board's report.
///
/// # Errors
/// If the board fails, or at the first bit in which it differs from the recorded answers.
pub fn fly_again(name: &str, model: Option<&[u8]>, flight: &Recorded<Vec<u8>>) -> Result<serde_json::Value> {
    let (output, answers) = start(name, model, &flight.recording)?;
    let report = output.report().with_context(|| name.to_owned())?;
    same_bits(&flight.answers, &answers.unwrap_or_default()).with_context(|| format!("{name}: host and board differ"))?;
    Ok(report)
}

/// Fails at the first bit that differs, with tick and name of the number.
fn same_bits(host: &[u8], board: &[u8]) -> Result<()> {
    for (tick, (host, board)) in host.chunks(ANSWER).zip(board.chunks(ANSWER)).enumerate() {
        let numbers =
            host.as_chunks().0.iter().zip(board.as_chunks().0).map(|(a, b)| (f32::from_le_bytes(*a), f32::from_le_bytes(*b)));
        for ((host, board), name) in numbers.zip(ANSWER_NAMES) {
            if host.to_bits() != board.to_bits() {
                bail!("tick {tick}, {name}: {host} ({:08x}) and {board} ({:08x})", host.to_bits(), board.to_bits());
            }
        }
    }
    ensure!(host.len() == board.len(), "{} and {} ticks of answers", host.len() / ANSWER, board.len() / ANSWER);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_flipped_bit_is_found_and_named() {
        let host = vec![0x3f; 5 * ANSWER];
        let mut board = host.clone();
        assert!(same_bits(&host, &board).is_ok());
        board[3 * ANSWER + 4 * 5] ^= 1;
        let error = same_bits(&host, &board).unwrap_err().to_string();
        assert!(error.contains("tick 3, reference position y"), "{error}");
        assert!(same_bits(&host, &host[..4 * ANSWER]).is_err());
    }
}
