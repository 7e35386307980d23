//! The machines that run the program in `firmware/board/twins`: Cortex-M cores in QEMU. Nothing skips: without a target or the
//! emulator it fails, with the line that installs what is missing.

use std::{
    env,
    fs::{self, File},
    path::PathBuf,
    time::Duration,
};

use anyhow::{Context, Result, ensure};
use serde_json::json;

use super::cases::Cases;
use crate::emulator::{FIRMWARE, require, run_on, target_folder, tool};

/// Far more than the slowest run needs.
const TIMEOUT: Duration = Duration::from_secs(120);

/// A core, and how a program for it is built.
#[derive(Clone, Copy, Debug)]
pub struct Core {
    /// What people call it.
    pub name: &'static str,
    /// The machine in QEMU.
    pub machine: &'static str,
    /// The compiler's target.
    pub target: &'static str,
    /// Cargo features of the program.
    pub features: &'static [&'static str],
    /// Which kernels run ([`impromptu_firmware::network::kernel::NAME`]).
    pub kernels: &'static str,
    /// Most bytes of a layer's stream or a model file.
    pub room: usize,
    /// Whether its memory suffices for a flight.
    pub flies: bool,
}

/// A machine of ARM's series MPS2.
const fn core(name: &'static str, machine: &'static str, target: &'static str, kernels: &'static str) -> Core {
    Core { name, machine, target, features: &[], kernels, room: 256 * 1024, flies: true }
}

/// All cores, from the smallest on.
pub const CORES: [Core; 7] = [
    Core { room: 6144, flies: false, ..core("M0", "microbit", "thumbv6m-none-eabi", "portable") },
    core("M3", "mps2-an385", "thumbv7m-none-eabi", "portable"),
    core("M4", "mps2-an386", "thumbv7em-none-eabi", "DSP"),
    core("M4F", "mps2-an386", "thumbv7em-none-eabihf", "DSP and FPU"),
    core("M7", "mps2-an500", "thumbv7em-none-eabihf", "DSP and FPU"),
    core("M33, no DSP", "mps2-an505", "thumbv8m.main-none-eabihf", "FPU"),
    Core { features: &["dsp"], ..core("M33", "mps2-an505", "thumbv8m.main-none-eabihf", "DSP and FPU") },
];

impl Core {
    /// The core of that name.
    ///
    /// # Panics
    /// If there is none.
    pub fn named(name: &str) -> &'static Self {
        CORES.iter().find(|core| core.name == name).unwrap_or_else(|| panic!("{name} is one of {CORES:?}"))
    }

    /// Runs cases and compares their bits with those of this machine, with further arguments for the emulator.
    ///
    /// # Errors
    /// If a tool is missing, with the line that installs it; if the core fails, runs other kernels than it should, or gives other
    /// bits.
    pub fn run(&self, cases: &Cases, further: &[&str]) -> Result<()> {
        self.run_all(cases, further).with_context(|| format!("{} on {}", self.name, self.machine))
    }

    fn run_all(&self, cases: &Cases, further: &[&str]) -> Result<()> {
        let elf = program(self.target, self.features)?;
        let folder = tempfile::tempdir()?;
        fs::write(folder.path().join("cases.bin"), cases.file())?;
        let report = run_on(self.machine, further, &elf, folder.path(), TIMEOUT)?.report()?;
        let expected = json!({
            "kernel": self.kernels, "cases": cases.count(), "different": 0, "unaligned": cases.unaligned(),
        });
        ensure!(report == expected, "the core reports {report}, not {expected}");
        cases.compare(&fs::read(folder.path().join("outputs.bin"))?)
    }
}

/// Builds the program for a target and gives its file.
///
/// # Errors
/// If the target is missing, with the line that installs it, or it does not build.
pub fn program(target: &str, features: &[&str]) -> Result<PathBuf> {
    require(target)?;
    let folder = target_folder();
    fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
    // Held until the program is copied: with other features it has the same name.
    let lock = File::create(folder.join("twins.lock"))?;
    lock.lock()?;
    let mut cargo = tool("cargo");
    for (variable, _) in env::vars_os() {
        let name = variable.to_string_lossy();
        if name.starts_with("CARGO_TARGET_") && name.ends_with("RUSTFLAGS") {
            cargo.env_remove(&variable);
        }
    }
    cargo.args([
        "build",
        "--package",
        "impromptu-twins",
        "--bin",
        "twins",
        "--target",
        target,
        "--profile",
        FIRMWARE,
        "--locked",
    ]);
    if !features.is_empty() {
        cargo.args(["--features", &features.join(",")]);
    }
    let built = cargo.arg("--target-dir").arg(&folder).output().context("cannot start cargo")?;
    ensure!(built.status.success(), "the program does not build:\n{}", String::from_utf8_lossy(&built.stderr));
    let name = if target.starts_with("wasm32") { "twins.wasm" } else { "twins" };
    // Complete before it has its own name: another process may be starting it.
    let (program, part) = (folder.join(format!("twins-{target}-{}", features.join("-"))), folder.join("twins.part"));
    let copied = fs::copy(folder.join(target).join(FIRMWARE).join(name), &part).and_then(|_| fs::rename(&part, &program));
    copied.with_context(|| format!("cannot copy the program to {}", program.display()))?;
    Ok(program)
}
