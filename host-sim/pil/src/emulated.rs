//! Starts the emulated board with a model in its folder.

use std::{
    fs, io,
    path::{Path, PathBuf},
    process::{Child, Stdio},
    time::Duration,
};

use anyhow::{Context as _, Result};
use impromptu_files::interruption::TemporaryFolder;

use crate::{
    board::Board,
    connection::{self, LinkKind},
    emulator,
    error::PilError,
    flash,
    line::Line,
};

/// How long the board may take to start.
const START: Duration = Duration::from_secs(20);

/// A running emulator; it ends with this value.
pub struct Emulated {
    child: Child,
    folder: TemporaryFolder,
    elf: PathBuf,
    link: LinkKind,
    shift: u32,
}

/// Files that stand for the slots of the flash, in its order: the firmware writes them when it stores something.
const SLOTS: [&str; flash::SLOTS] = ["learned.bin", "slot0.bin", "slot1.bin"];

impl Drop for Emulated {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Emulated {
    /// What the firmware and the emulator complained of.
    pub fn complaints(&self) -> String {
        fs::read_to_string(self.folder.path().join("stderr")).unwrap_or_default()
    }

    /// Waits until the firmware has ended by itself, and gives its exit code.
    ///
    /// # Errors
    /// If it does not.
    pub fn ended(&mut self) -> Result<Option<i32>> {
        use wait_timeout::ChildExt as _;
        let status = self.child.wait_timeout(START)?.context("the emulator does not end")?;
        Ok(status.code())
    }
}

/// Builds the firmware of the emulated board, if it is not built; the ELF file.
///
/// # Errors
/// If the target is missing, with the line that installs it, or the build fails.
pub fn firmware() -> Result<PathBuf> {
    emulator::build_firmware("impromptu-board", "emulated", emulator::BOARD, &[])
}

/// Builds the firmware if need be, starts it with the bytes of a model file, or with none, and opens the line. `shift`: an
/// instruction takes 2^shift nanoseconds.
///
/// # Errors
/// If the target or the emulator is missing, with the line that installs it; if the firmware does not start.
pub fn start(model: Option<&[u8]>, link: LinkKind, shift: u32) -> Result<(Emulated, Board<Box<dyn Line>>), PilError> {
    start_recalling(model, &[], link, shift)
}

/// [`start`], with what was kept of a learner in the flash too.
///
/// # Errors
/// As [`start`].
pub fn start_recalling(
    model: Option<&[u8]>,
    learned: &[u8],
    link: LinkKind,
    shift: u32,
) -> Result<(Emulated, Board<Box<dyn Line>>), PilError> {
    let folder = flashed(model, learned)?;
    let (emulated, line) = power(folder, firmware()?, &[], link, shift)?;
    Ok((emulated, Board::new(line, link == LinkKind::Lockstep)))
}

/// [`start`] with a binary that is built and further arguments for the emulator, to the line alone.
///
/// # Errors
/// If the emulator is missing or the firmware does not start.
pub fn connect(
    elf: &Path,
    further: &[&str],
    model: Option<&[u8]>,
    link: LinkKind,
    shift: u32,
) -> Result<(Emulated, Box<dyn Line>), PilError> {
    power(flashed(model, &[])?, elf.to_owned(), further, link, shift)
}

/// A folder with what the flash holds at the start.
fn flashed(model: Option<&[u8]>, learned: &[u8]) -> Result<TemporaryFolder> {
    let folder = TemporaryFolder::new().context("cannot make a folder for the emulator")?;
    for (name, bytes) in SLOTS.into_iter().zip([learned.to_vec(), model.map_or_else(Vec::new, flash::slot)]) {
        fs::write(folder.path().join(name), bytes).context("cannot write what the flash holds")?;
    }
    Ok(folder)
}

/// Power off and on again: the models in flash stay.
///
/// # Errors
/// As [`start`].
pub fn restart(mut emulated: Emulated) -> Result<(Emulated, Board<Box<dyn Line>>), PilError> {
    let _ = emulated.child.kill();
    let _ = emulated.child.wait();
    let folder = std::mem::replace(&mut emulated.folder, TemporaryFolder::new().context("cannot make a folder")?);
    let link = emulated.link;
    let (emulated, line) = power(folder, emulated.elf.clone(), &[], link, emulated.shift)?;
    Ok((emulated, Board::new(line, link == LinkKind::Lockstep)))
}

/// Starts the emulator in a folder with what its flash holds.
fn power(
    folder: TemporaryFolder,
    elf: PathBuf,
    further: &[&str],
    link: LinkKind,
    shift: u32,
) -> Result<(Emulated, Box<dyn Line>), PilError> {
    let slots = SLOTS.map(|name| fs::read(folder.path().join(name)).unwrap_or_default());
    let flashed = folder.path().join("flashed.elf");
    let program = fs::read(&elf).with_context(|| format!("cannot read {}", elf.display()))?;
    fs::write(&flashed, flash::flash(&program, &slots)?).context("cannot write the flashed binary")?;
    let serial = connection::prepare(link, folder.path())?;
    let mut command = emulator::command(further, &format!("shift={shift},sleep=off"), &serial)?;
    let stderr = fs::File::create(folder.path().join("stderr")).context("cannot write")?;
    command.arg(&flashed).current_dir(folder.path()).stdin(Stdio::null()).stdout(Stdio::null()).stderr(stderr);
    let child = emulator::spawn(&mut command)?;
    let mut emulated = Emulated { child, folder, elf, link, shift };
    let path = emulated.folder.path().to_owned();
    let alive = || match emulated.child.try_wait()? {
        Some(status) => Err(io::Error::other(format!("the emulator ended ({status})"))),
        None => Ok(()),
    };
    let line = connection::open(link, &path, START, alive).map_err(|error| PilError::Line(error, emulated.complaints()))?;
    Ok((emulated, line))
}
