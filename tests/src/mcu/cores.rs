//! What an evaluation costs on other cores, in executed instructions: the same files, the same bits, weights in RAM.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde::Serialize;

use super::{counter, kernels::KERNELS, nets::Net};
use crate::twins::{
    cases::Cases,
    cores::{CORES, Core},
};

/// The network that is evaluated.
pub const NET: &str = "12-128x4-6";

/// One of our kernels on one core.
#[derive(Clone, Debug, Serialize)]
pub struct CoreRow {
    /// What people call the core.
    pub core: &'static str,
    /// The compiler's target.
    pub target: &'static str,
    /// Which instructions beside the usual ones the kernels use there.
    pub uses: &'static str,
    /// Name of the kernel.
    pub kernel: &'static str,
    /// Name of the network.
    pub net: &'static str,
    /// Executed instructions, the most of [`Net::counted_inputs`].
    pub instructions: u64,
}

/// Measures our kernels that `wanted` accepts by their names on every core whose memory suffices.
///
/// # Errors
/// If a tool is missing, with the line that installs it, a core fails, or gives other bits than this machine.
pub fn measure(plugin: &Path, nets: &[Net], wanted: impl Fn(&str) -> bool) -> Result<Vec<CoreRow>> {
    let net = nets.iter().find(|net| net.name == NET).context("there is no such network")?;
    let kernels = KERNELS.iter().filter(|kernel| kernel.is_ours() && wanted(kernel.name));
    let mut files = Vec::new();
    for kernel in kernels {
        files.push((kernel.name, kernel.form.image(net)?));
    }
    let largest = files.iter().map(|(_, file)| file.len()).max().unwrap_or_default();
    let cores = CORES.iter().filter(|core| largest > 0 && largest <= core.room);
    let rows = cores.map(|core| rows(core, plugin, net, &files));
    Ok(rows.collect::<Result<Vec<_>>>()?.concat())
}

fn rows(core: &Core, plugin: &Path, net: &Net, files: &[(&'static str, Vec<u8>)]) -> Result<Vec<CoreRow>> {
    let inputs = net.counted_inputs();
    let mut cases = Cases::default();
    for (name, file) in files {
        cases.network(name, file, &inputs)?;
    }
    let counts = tempfile::NamedTempFile::new()?;
    let arguments = format!("{},out={}", plugin.display(), counts.path().display());
    core.run(&cases, &["-plugin", &arguments])?;
    let (entries, _) = counter::read(counts.path())?;
    ensure!(entries.len() == files.len() * inputs.len(), "{} evaluations were counted", entries.len());
    let rows = files.iter().zip(entries.chunks(inputs.len())).map(|((kernel, _), entries)| {
        let instructions = entries.iter().map(|entry| entry.instructions).max().unwrap_or_default();
        CoreRow { core: core.name, target: core.target, uses: core.kernels, kernel, net: NET, instructions }
    });
    Ok(rows.collect())
}
