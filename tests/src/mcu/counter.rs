//! Compiles the cycle model in `tests/cycles` and reads what it counted.

use std::{
    collections::BTreeMap,
    env,
    ffi::OsString,
    fs,
    io::ErrorKind,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, Result, anyhow, bail, ensure};
use serde::Deserialize;

use crate::emulator::{emulator_version, target_folder};

/// What one evaluation cost.
#[derive(Clone, Debug, Deserialize)]
pub struct Entry {
    /// Executed instructions, exact.
    pub instructions: u64,
    /// Modelled cycles without flash wait states.
    pub cycles: u64,
    /// Modelled waits for instructions from flash.
    pub code_waits: u64,
    /// Modelled waits for data from flash.
    pub data_waits: u64,
    /// Lowest address of the stack that was written; `u64::MAX`: none.
    pub lowest_store: u64,
    /// Executed instructions of each kind.
    pub kinds: BTreeMap<String, u64>,
}

impl Entry {
    /// Cycles with all waits.
    pub fn cycles_with_waits(&self) -> u64 {
        self.cycles + self.code_waits + self.data_waits
    }
}

/// What was used of the flash: (offset, length) of each piece.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct Used {
    /// Executed.
    pub executed: Vec<(u64, u64)>,
    /// Read as data.
    pub loaded: Vec<(u64, u64)>,
}

/// What the plugin wrote.
///
/// # Errors
/// If it is not what the plugin writes.
pub fn read(path: &Path) -> Result<(Vec<Entry>, Used)> {
    let text = fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let mut lines: Vec<&str> = text.lines().collect();
    let used = lines.pop().context("the cycle model wrote nothing")?;
    let entries = lines.into_iter().map(serde_json::from_str).collect::<Result<_, _>>()?;
    Ok((entries, serde_json::from_str(used)?))
}

/// Compiles the plugin for the emulator that is installed.
///
/// # Errors
/// If there is no C compiler or no emulator, with the line that installs it.
pub fn build() -> Result<PathBuf> {
    let version = emulator_version()?;
    // Where QEMU's plugin interface changed.
    let interface = match version {
        (..=8, _) => 1,
        (9, 0) => 2,
        _ => 3,
    };
    ensure!(version >= (7, 0), "QEMU {}.{} is too old for the cycle model; 7.0 at least", version.0, version.1);
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("cycles");
    let folder = target_folder();
    fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
    // In a place of its own, then renamed: another test or process may just load it, or make it too.
    let made = tempfile::tempdir_in(&folder).with_context(|| format!("cannot write to {}", folder.display()))?;
    let own = made.path().join("cycles.so");
    let compiler = env::var_os("CC").filter(|name| !name.is_empty()).unwrap_or(OsString::from("cc"));
    let mut command = Command::new(&compiler);
    command.args(["-std=gnu11", "-O2", "-fPIC", "-shared", "-fvisibility=hidden"]).arg(format!("-DPLUGIN_API={interface}"));
    if cfg!(target_os = "macos") {
        // QEMU's functions are found when it loads the plugin.
        command.args(["-undefined", "dynamic_lookup"]);
    }
    let compiled = command.arg("-o").arg(&own).args(["cycles.c", "instruction.c"].map(|name| sources.join(name))).output();
    let compiled = compiled.map_err(|error| match error.kind() {
        ErrorKind::NotFound => missing_compiler(&compiler.to_string_lossy()),
        _ => anyhow!(error).context("cannot start the C compiler"),
    })?;
    if !compiled.status.success() {
        bail!("the cycle model does not compile:\n{}", String::from_utf8_lossy(&compiled.stderr));
    }
    let plugin = folder.join("cycles.so");
    fs::rename(&own, &plugin).with_context(|| format!("cannot write {}", plugin.display()))?;
    plugin.canonicalize().with_context(|| format!("cannot find {}", plugin.display()))
}

/// The error for a machine without a C compiler.
fn missing_compiler(name: &str) -> anyhow::Error {
    let install = if cfg!(target_os = "macos") { "xcode-select --install" } else { "sudo apt-get install gcc libc6-dev" };
    anyhow!("the C compiler {name} is not installed (CC names another one); run: {install}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_compiler_is_named_with_the_line_that_installs_it() {
        let message = missing_compiler("cc").to_string();
        assert!(message.starts_with("the C compiler cc is not installed") && message.contains("install"), "{message}");
    }
}
