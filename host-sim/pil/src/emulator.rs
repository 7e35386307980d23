//! Builds firmware for the microcontroller and runs it in QEMU.
//!
//! Nothing here skips: without the compiler's target or without QEMU a test fails, with the line that installs what is missing.

use std::{
    collections::BTreeSet,
    env,
    ffi::OsString,
    fs::{self, File},
    hash::{DefaultHasher, Hash, Hasher},
    io::{ErrorKind, Read},
    path::{Path, PathBuf},
    process::{Child, Command, ExitStatus, Stdio},
    sync::{Mutex, PoisonError},
    thread,
    time::Duration,
};

use anyhow::{Context, Result, anyhow, bail, ensure};
use wait_timeout::ChildExt;

/// The microcontroller's target.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// How what flies on a vehicle is built: small.
pub const BOARD: &str = "board";
/// How what is measured in instructions is built: fast.
pub const FIRMWARE: &str = "firmware";

/// Names the folder of a toolchain with [`TARGET`], where rustup cannot provide it (see `tests/thumb-toolchain.sh`).
pub const TOOLCHAIN_VARIABLE: &str = "IMPROMPTU_THUMB_TOOLCHAIN";

/// Variables that would change the build (flags of a coverage or sanitiser run, another target, a wrapper) and with it the
/// instruction counts, or break it. The model is named by the test alone.
const FOREIGN_VARIABLES: [&str; 11] = [
    "IMPROMPTU_MODEL",
    "IMPROMPTU_MCU_IMAGES",
    "IMPROMPTU_FLASH_OFFSET",
    "RUSTFLAGS",
    "CARGO_ENCODED_RUSTFLAGS",
    "CARGO_BUILD_RUSTFLAGS",
    "CARGO_BUILD_TARGET",
    "CARGO_TARGET_THUMBV7EM_NONE_EABIHF_RUSTFLAGS",
    "CARGO_INCREMENTAL",
    "RUSTC_WRAPPER",
    "RUSTC_WORKSPACE_WRAPPER",
];

/// What a run of the emulator left behind.
#[derive(Debug)]
pub struct Output {
    /// Exit code of the firmware, or the signal that ended the emulator.
    pub status: ExitStatus,
    /// All that the firmware printed.
    pub stdout: String,
    /// Errors and panics of the firmware, and complaints of the emulator.
    pub stderr: String,
}

impl Output {
    /// The JSON line that a successful run prints.
    pub fn report(&self) -> Result<serde_json::Value> {
        let Self { status, stdout, stderr } = self;
        ensure!(status.success(), "the emulated board failed ({status}):\n{stdout}{stderr}");
        serde_json::from_str(stdout).with_context(|| format!("the emulated board printed no report, but:\n{stdout}{stderr}"))
    }
}

/// Builds the binary `bin` of a package with a profile ([`BOARD`], [`FIRMWARE`]), with additional variables in its environment,
/// and gives the ELF file.
///
/// Once for each environment in a run of the tests. Cargo works in a target folder of its own, so that it neither waits for the
/// build that runs the tests nor disturbs it.
pub fn build_firmware(package: &str, bin: &str, profile: &str, environment: &[(&str, &str)]) -> Result<PathBuf> {
    build_firmware_of(workspace(), package, bin, profile, environment)
}

/// [`build_firmware`] of a package in the Cargo workspace `root`.
pub fn build_firmware_of(root: &Path, package: &str, bin: &str, profile: &str, environment: &[(&str, &str)]) -> Result<PathBuf> {
    static BUILT: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    let folder = target_folder();
    let mut variant = DefaultHasher::new();
    environment.hash(&mut variant);
    let elf = folder.join(format!("{bin}-{:016x}.elf", variant.finish()));
    let mut built = BUILT.lock().unwrap_or_else(PoisonError::into_inner);
    if !built.contains(&elf) {
        build(root, [package, bin, profile], environment, &folder, &elf)?;
        built.insert(elf.clone());
    }
    Ok(elf)
}

fn build(root: &Path, [package, bin, profile]: [&str; 3], environment: &[(&str, &str)], folder: &Path, elf: &Path) -> Result<()> {
    require_target()?;
    fs::create_dir_all(folder).with_context(|| format!("cannot create {}", folder.display()))?;
    // Held until the ELF is copied: a build with another environment, in another process, writes to the same name.
    let lock = File::create(folder.join("emulator.lock"))?;
    lock.lock()?;
    let built = tool("cargo")
        .current_dir(root)
        .args(["build", "--package", package, "--bin", bin])
        .args(["--target", TARGET, "--profile", profile, "--locked"])
        .arg("--target-dir")
        .arg(folder)
        .envs(environment.iter().copied())
        .output()
        .context("cannot start cargo")?;
    ensure!(built.status.success(), "the firmware does not build:\n{}", String::from_utf8_lossy(&built.stderr));
    // Renamed when complete: another process may be starting the same board.
    let copy = folder.join("emulator.copy");
    fs::copy(folder.join(TARGET).join(profile).join(bin), &copy)
        .and_then(|_| fs::rename(&copy, elf))
        .with_context(|| format!("cannot copy the binary to {}", elf.display()))
}

/// Runs `elf` on the emulated board in `working_dir`, where it finds and leaves its files, for at most `timeout`.
pub fn run(elf: &Path, working_dir: &Path, timeout: Duration) -> Result<Output> {
    run_with(&[], elf, working_dir, timeout)
}

/// [`run`] with further arguments for the emulator.
pub fn run_with(further: &[&str], elf: &Path, working_dir: &Path, timeout: Duration) -> Result<Output> {
    run_by(&runner()?, further, elf, working_dir, timeout)
}

/// [`run_with`] on another machine that the emulator knows.
pub fn run_on(machine: &str, further: &[&str], elf: &Path, working_dir: &Path, timeout: Duration) -> Result<Output> {
    let mut runner = runner()?;
    set(&mut runner, "-machine", machine)?;
    run_by(&runner, further, elf, working_dir, timeout)
}

fn run_by(runner: &[String], further: &[&str], elf: &Path, working_dir: &Path, timeout: Duration) -> Result<Output> {
    let (program, arguments) = runner.split_first().context("the runner is empty")?;
    ensure!(working_dir.is_dir(), "cannot start {program} in {}", working_dir.display());
    let mut command = Command::new(program);
    command.args(further).args(arguments).arg(elf).current_dir(working_dir);
    let mut child = spawn(command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()))?;
    // Drained while it runs: a full pipe would stop the emulator.
    let stdout = drain(child.stdout.take());
    let stderr = drain(child.stderr.take());
    let ended = child.wait_timeout(timeout)?;
    if ended.is_none() {
        child.kill()?;
        child.wait()?;
    }
    let stdout = stdout.join().unwrap_or_default();
    let stderr = stderr.join().unwrap_or_default();
    let Some(status) = ended else {
        bail!("{} did not end within {} s and was stopped; it printed:\n{stdout}{stderr}", elf.display(), timeout.as_secs_f64());
    };
    Ok(Output { status, stdout, stderr })
}

/// The emulator as cargo would start it, but with further arguments, this virtual clock and this serial port; the ELF file comes
/// next.
pub fn command(further: &[&str], icount: &str, serial: &str) -> Result<Command> {
    let mut runner = runner()?;
    for (option, value) in [("-icount", icount), ("-serial", serial)] {
        set(&mut runner, option, value)?;
    }
    let (program, arguments) = runner.split_first().context("the runner is empty")?;
    let mut command = Command::new(program);
    command.args(further).args(arguments);
    Ok(command)
}

/// Gives an option of the runner another value.
fn set(runner: &mut [String], option: &str, value: &str) -> Result<()> {
    let place = runner.iter().position(|word| word == option).and_then(|place| runner.get_mut(place + 1));
    *place.with_context(|| format!("the runner has no option {option}"))? = value.into();
    Ok(())
}

/// Starts the emulator.
///
/// # Errors
/// If it is not installed, with the line that installs it.
pub fn spawn(command: &mut Command) -> Result<Child> {
    command.spawn().map_err(|error| {
        let program = command.get_program().to_string_lossy().into_owned();
        match error.kind() {
            ErrorKind::NotFound => missing_emulator(&program),
            _ => anyhow!(error).context(format!("cannot start {program}")),
        }
    })
}

/// Reads a pipe to its end in the background.
fn drain(pipe: Option<impl Read + Send + 'static>) -> thread::JoinHandle<String> {
    thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut pipe) = pipe {
            // What came before an error is still worth showing.
            let _ = pipe.read_to_end(&mut bytes);
        }
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

/// Major and minor version of the emulator.
pub fn emulator_version() -> Result<(u32, u32)> {
    let runner = runner()?;
    let program = runner.first().context("the runner is empty")?;
    let asked = Command::new(program).arg("--version").output().map_err(|error| match error.kind() {
        ErrorKind::NotFound => missing_emulator(program),
        _ => anyhow!(error).context(format!("cannot start {program}")),
    })?;
    let text = String::from_utf8_lossy(&asked.stdout);
    let numbers = text.split_whitespace().find_map(|word| {
        let mut parts = word.split('.').map_while(|part| part.parse().ok());
        Some((parts.next()?, parts.next()?))
    });
    numbers.with_context(|| format!("{program} --version says no version, but: {text}"))
}

/// The error for a machine without QEMU.
fn missing_emulator(program: &str) -> anyhow::Error {
    let install = if cfg!(target_os = "macos") { "brew install qemu" } else { "sudo apt-get install qemu-system-arm" };
    anyhow!("{program} is not installed; run: {install}")
}

/// Fails, with what to do, if the compiler has no library for [`TARGET`].
pub fn require_target() -> Result<()> {
    require(TARGET).map_err(|error| {
        anyhow!(
            "{error}\n(without rustup, on Debian or Ubuntu: tests/thumb-toolchain.sh FOLDER, then set \
             {TOOLCHAIN_VARIABLE}=FOLDER)"
        )
    })
}

/// Fails, with what to do, if the compiler has no library for a target.
pub fn require(target: &str) -> Result<()> {
    let asked = tool("rustc").args(["--print", "target-libdir", "--target", target]).output().context("cannot start rustc")?;
    let folder = String::from_utf8_lossy(&asked.stdout).trim().to_owned();
    ensure!(
        asked.status.success() && Path::new(&folder).is_dir(),
        "the compiler has no target {target}; run: rustup target add {target}"
    );
    Ok(())
}

/// `cargo` or `rustc` of the toolchain that has [`TARGET`], free of what the running tests inherited.
pub fn tool(name: &str) -> Command {
    let mut command = match env::var_os(TOOLCHAIN_VARIABLE).filter(|value| !value.is_empty()) {
        Some(toolchain) => {
            let programs = workspace().join(toolchain).join("bin");
            let mut command = Command::new(programs.join(name));
            let inherited = env::var_os("PATH").unwrap_or_default();
            let path = env::join_paths([programs].into_iter().chain(env::split_paths(&inherited)));
            command.env("PATH", path.unwrap_or(inherited));
            for variable in ["CARGO", "RUSTC", "RUSTDOC", "RUSTUP_TOOLCHAIN"] {
                command.env_remove(variable);
            }
            command
        }
        // The variables name the tools that run these tests.
        None => Command::new(env::var_os(name.to_uppercase()).unwrap_or(OsString::from(name))),
    };
    for variable in FOREIGN_VARIABLES {
        command.env_remove(variable);
    }
    command.current_dir(workspace());
    command
}

/// How cargo itself would start the emulator: the runner in `.cargo/config.toml`.
fn runner() -> Result<Vec<String>> {
    let path = workspace().join(".cargo/config.toml");
    let text = fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let config: toml::Table = toml::from_str(&text).with_context(|| format!("cannot read {}", path.display()))?;
    let runner = config["target"][TARGET]["runner"].clone();
    runner.try_into().with_context(|| format!("{}: target.{TARGET}.runner is not a list", path.display()))
}

/// The folder of the workspace.
pub fn workspace() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

/// The compiler that builds the firmware, as it calls itself. A toolchain made by hand has a core library of its own and says so.
pub fn compiler() -> Result<String> {
    let asked = tool("rustc").arg("--version").output().context("cannot start rustc")?;
    let own = env::var_os(TOOLCHAIN_VARIABLE).is_some_and(|value| !value.is_empty());
    let version = String::from_utf8_lossy(&asked.stdout).trim().to_owned();
    Ok(if own { format!("{version}, core library of {TOOLCHAIN_VARIABLE}") } else { version })
}

/// Where the firmware is built and flown.
pub fn target_folder() -> PathBuf {
    match env::var_os("CARGO_TARGET_DIR") {
        Some(folder) => workspace().join(folder).join("firmware"),
        None => workspace().join("target/firmware"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_emulator_is_named_with_the_line_that_installs_it() {
        let message = missing_emulator("qemu-system-arm").to_string();
        assert!(message.starts_with("qemu-system-arm is not installed; run: "));
        assert!(message.contains("install qemu"));
    }

    #[test]
    fn the_runner_counts_instructions() {
        let runner = runner().unwrap();
        assert!(runner.contains(&"shift=0,sleep=off".to_owned()));
        assert_eq!(runner.last().map(String::as_str), Some("-kernel"));
    }
}
