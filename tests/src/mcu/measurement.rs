//! Runs every kernel on every network on the emulated board and puts the figures together.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    time::Duration,
};

use anyhow::{Context, Result, ensure};
use serde::Serialize;

use super::{
    cores::{self, CoreRow},
    counter::{self, Entry, Used},
    kernels::{KERNELS, Kernel},
    memory::Symbols,
    nets::Net,
};
use crate::emulator::{FIRMWARE, build_firmware_of, run, run_with, target_folder, workspace};

/// Far more than the slowest run needs.
const TIMEOUT: Duration = Duration::from_secs(120);
/// Most bytes of weights in RAM: the core-coupled memory of the real chip (`tests/peers/mcu-benchmark/src/request.rs`).
const RAM_FOR_WEIGHTS: usize = 64 * 1024;
/// Bytes of an answer in front of the outputs.
const ANSWER_HEADER: usize = 12;

/// One line of the table: the most that any of the counted inputs cost.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Name of the kernel.
    pub kernel: &'static str,
    /// Name of the network.
    pub net: &'static str,
    /// Executed instructions.
    pub instructions: u64,
    /// Modelled cycles, code and weights in flash.
    pub cycles_flash: u64,
    /// Modelled cycles, code in flash and weights in RAM; none if they do not fit.
    pub cycles_ram: Option<u64>,
    /// Modelled cycles if flash had no wait states.
    pub cycles_no_wait: u64,
    /// Every function that ran, whole, the tables and the weights.
    pub flash_bytes: u64,
    /// Instructions that ran and tables, without weights.
    pub code_bytes: u64,
    /// Static working memory and stack.
    pub ram_bytes: u64,
    /// Largest difference to the exact outputs.
    pub max_error: f64,
    /// Executed instructions of each kind (`tests/cycles/instruction.h`), for the first typical input.
    pub kinds: BTreeMap<String, u64>,
    /// Cycles of each counted input, code and weights in flash: typical rows, then zeros, then far outside of every range.
    #[serde(skip)]
    pub cycles_by_input: Vec<u64>,
}

/// A kernel that a network is too much for.
#[derive(Clone, Debug, Serialize)]
pub struct LeftOut {
    /// Name of the kernel.
    pub kernel: &'static str,
    /// Name of the network.
    pub net: &'static str,
    /// Why.
    pub reason: &'static str,
}

/// Everything that was measured.
#[derive(Clone, Debug)]
pub struct Results {
    /// In the order of networks, then of kernels.
    pub rows: Vec<Row>,
    /// What has no row.
    pub left_out: Vec<LeftOut>,
    /// Our kernels on other cores.
    pub cores: Vec<CoreRow>,
}

/// Builds what is needed and measures the kernels and networks that `wanted` accepts by their names.
///
/// # Errors
/// If a tool is missing, with the line that installs it, or the board fails.
pub fn measure(wanted: impl Fn(&str, &str) -> bool) -> Result<Results> {
    let plugin = counter::build()?;
    let nets = Net::all()?;
    let mut boards = BTreeMap::new();
    let mut results = Results { rows: Vec::new(), left_out: Vec::new(), cores: Vec::new() };
    for net in &nets {
        for kernel in KERNELS.iter().filter(|kernel| wanted(kernel.name, net.name)) {
            if let Some(reason) = kernel.refusal(net) {
                results.left_out.push(LeftOut { kernel: kernel.name, net: net.name, reason });
                continue;
            }
            let board = match boards.entry(kernel.is_ours()) {
                std::collections::btree_map::Entry::Occupied(board) => board.into_mut(),
                std::collections::btree_map::Entry::Vacant(place) => {
                    place.insert(Board::build(kernel.is_ours(), &nets, &plugin)?)
                }
            };
            let row = board.row(kernel, net).with_context(|| format!("{} {}", kernel.name, net.name))?;
            results.rows.push(row);
        }
    }
    results.cores = cores::measure(&plugin, &nets, |kernel| wanted(kernel, cores::NET))?;
    Ok(results)
}

/// A binary with some of the images.
struct Board<'p> {
    elf: PathBuf,
    symbols: Symbols,
    plugin: &'p Path,
    /// Names of its images in their order, with lengths.
    images: BTreeMap<String, usize>,
}

/// What the board answered.
struct Answer {
    stack_pointer: u64,
    working_memory: u64,
    image: u64,
    outputs: Vec<Vec<f32>>,
}

impl<'p> Board<'p> {
    /// Builds the binary for our kernels or for the others.
    fn build(ours: bool, nets: &[Net], plugin: &'p Path) -> Result<Self> {
        let folder = target_folder().join("mcu").join(if ours { "ours" } else { "peers" });
        fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
        let mut images = BTreeMap::new();
        for net in nets {
            for kernel in KERNELS.iter().filter(|kernel| kernel.is_ours() == ours && kernel.refusal(net).is_none()) {
                let image = kernel.form.image(net).with_context(|| format!("{} {}", kernel.name, net.name))?;
                let path = folder.join(kernel.form.image_name(net));
                // Unchanged files build nothing.
                if fs::read(&path).ok().as_ref() != Some(&image) {
                    fs::write(&path, &image).with_context(|| format!("cannot write {}", path.display()))?;
                }
                images.insert(kernel.form.image_name(net), image.len());
            }
        }
        remove_others(&folder, images.keys().map(String::as_str).collect())?;
        let folder = folder.canonicalize()?;
        let folder = folder.to_str().context("the target folder's name is not Unicode")?;
        let (package, environment) = ("impromptu-mcu-benchmark", [("IMPROMPTU_MCU_IMAGES", folder)]);
        let elf = build_firmware_of(&workspace().join("tests/peers"), package, "mcu-benchmark", FIRMWARE, &environment)?;
        Ok(Self { symbols: Symbols::read(&elf)?, elf, plugin, images })
    }

    fn row(&self, kernel: &Kernel, net: &Net) -> Result<Row> {
        let counted = net.counted_inputs();
        let found = self.ask(kernel, net, false, &net.inputs, None)?;
        let (answer, entries, used) = self.count(kernel, net, false, &counted)?;
        let length = self.images.get(&kernel.form.image_name(net)).copied().unwrap_or_default();
        let needed = self.symbols.needed(&used, answer.image, length as u64);
        // Who does not read the image has the same weights among its constants.
        let weights = length as u64;
        let (beside, inside) = if needed.reads_image { (weights, 0) } else { (0, weights) };
        let cycles_ram = if kernel.takes_weights_in_ram() && length <= RAM_FOR_WEIGHTS {
            let (in_ram, entries, _) = self.count(kernel, net, true, &counted)?;
            ensure!(in_ram.outputs == answer.outputs, "other outputs with the weights in RAM than in flash");
            Some(most(&entries, Entry::cycles_with_waits))
        } else {
            None
        };
        let lowest = entries.iter().map(|entry| entry.lowest_store.min(answer.stack_pointer)).min().unwrap_or_default();
        Ok(Row {
            kernel: kernel.name,
            net: net.name,
            instructions: most(&entries, |entry| entry.instructions),
            cycles_flash: most(&entries, Entry::cycles_with_waits),
            cycles_ram,
            cycles_no_wait: most(&entries, |entry| entry.cycles),
            flash_bytes: needed.whole + beside,
            code_bytes: needed.path - inside,
            ram_bytes: answer.working_memory + (answer.stack_pointer - lowest),
            max_error: net.largest_error(&found.outputs),
            kinds: entries.first().map(|entry| entry.kinds.clone()).unwrap_or_default(),
            cycles_by_input: entries.iter().map(Entry::cycles_with_waits).collect(),
        })
    }

    /// Evaluates `inputs` under the cycle model. The first row runs twice and counts once: flash lines are then as they are in
    /// flight.
    fn count(&self, kernel: &Kernel, net: &Net, in_ram: bool, inputs: &[Vec<f32>]) -> Result<(Answer, Vec<Entry>, Used)> {
        let warm: Vec<Vec<f32>> = inputs.iter().take(1).chain(inputs).cloned().collect();
        let counts = self.folder(kernel, net).join("counts.json");
        let arguments = format!("{},out={},stack={}", self.plugin.display(), counts.display(), self.symbols.stack_end);
        let answer = self.ask(kernel, net, in_ram, &warm, Some(&arguments))?;
        let (mut entries, used) = counter::read(&counts)?;
        ensure!(entries.len() == warm.len(), "{} evaluations were counted, not {}", entries.len(), warm.len());
        entries.remove(0);
        Ok((answer, entries, used))
    }

    /// Evaluates `inputs` on the board, under a plugin or not.
    fn ask(&self, kernel: &Kernel, net: &Net, in_ram: bool, inputs: &[Vec<f32>], plugin: Option<&str>) -> Result<Answer> {
        let folder = self.folder(kernel, net);
        fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
        let name = kernel.form.image_name(net);
        let image = self.images.keys().position(|image| *image == name).context("the board has no such image")?;
        let header = [kernel.number, image as u32, u32::from(in_ram), inputs.len() as u32];
        let mut request: Vec<u8> = header.into_iter().flat_map(u32::to_le_bytes).collect();
        request.extend(inputs.iter().flatten().flat_map(|value| value.to_le_bytes()));
        fs::write(folder.join("request.bin"), request)?;
        let output = match plugin {
            Some(plugin) => run_with(&["-plugin", plugin], &self.elf, &folder, TIMEOUT)?,
            None => run(&self.elf, &folder, TIMEOUT)?,
        };
        ensure!(output.status.success(), "the emulated board failed ({}):\n{}{}", output.status, output.stdout, output.stderr);
        let answer = fs::read(folder.join("answer.bin")).context("the board left no answer")?;
        let (header, outputs) = answer.split_at_checked(ANSWER_HEADER).context("the answer is too short")?;
        let words: Vec<u64> = header.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word).into()).collect();
        let outputs: Vec<f32> = outputs.as_chunks().0.iter().map(|word| f32::from_le_bytes(*word)).collect();
        let outputs: Vec<Vec<f32>> = outputs.chunks(net.network.outputs()).map(<[f32]>::to_vec).collect();
        ensure!(outputs.len() == inputs.len(), "{} answers to {} rows", outputs.len(), inputs.len());
        Ok(Answer { stack_pointer: words[0], working_memory: words[1], image: words[2], outputs })
    }

    fn folder(&self, kernel: &Kernel, net: &Net) -> PathBuf {
        target_folder().join("mcu").join("runs").join(format!("{}-{}", kernel.name, net.name))
    }
}

/// The largest figure of the entries.
fn most(entries: &[Entry], figure: impl Fn(&Entry) -> u64) -> u64 {
    entries.iter().map(figure).max().unwrap_or_default()
}

/// Images of former runs are no part of the binary.
fn remove_others(folder: &Path, wanted: BTreeSet<&str>) -> Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if !entry.file_name().to_str().is_some_and(|name| wanted.contains(name)) {
            fs::remove_file(entry.path()).with_context(|| format!("cannot remove {}", entry.path().display()))?;
        }
    }
    Ok(())
}
