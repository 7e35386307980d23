//! The figures for people.

use std::fmt::Write;

use comfy_table::{Cell, CellAlignment, LineStyle, Table, presets};

use super::{
    cores::CoreRow,
    measurement::{Results, Row},
};

/// What the columns mean.
const LEGEND: &str = "\
Instructions are exact (QEMU); cycles are modelled for the STM32F405 at 168 MHz (tests/cycles), +-10 to 15 %. The most of six \
inputs:
four typical ones, zeros, far out of range. Quantising the inputs and scaling the outputs are included; one compiler, the same \
flags for all.
flash:   code and weights in flash, 5 wait states; RAM: the code stays in flash, the weights are in RAM (64 KiB); no wait: as \
if flash had none.
bytes:   flash holds the functions that ran (whole), their tables and the weights; code is the instructions that ran and the \
tables;
         RAM is working memory and stack.
error:   largest difference to the network in f64.
";

/// What the second table shows.
const CORES: &str = "\
Executed instructions on other cores in QEMU, the most of the same inputs; the same bits on all. Model file and code in RAM \
without wait
states: cycles are not modelled. Integer kernels use the DSP extension, float kernels the FPU, where there is one.
";

/// Engines that no package registry has, measured elsewhere with the same model and the same network shape.
const ELSEWHERE: &str = "\
Measured elsewhere with the same model, 12-128x4-6, weights in flash (not part of this run):
  CMSIS-NN s8              122936 instructions, 174k cycles (157k no wait), error .12, RAM  1.2 KB
  TFLite Micro + CMSIS-NN  124572 instructions, 175k cycles (156k no wait), error .12, RAM 11.7 KB
  RLtools f32              262103 instructions, 391k cycles (323k no wait), error 1e-6, RAM 1.1 KB
";

/// The table with its legend and what was left out.
pub fn text(results: &Results) -> String {
    let mut text = String::new();
    let nets = results.rows.iter().map(|row| row.net).chain(results.left_out.iter().map(|left| left.net));
    let mut seen: Vec<&str> = Vec::new();
    for net in nets {
        if !seen.contains(&net) {
            seen.push(net);
        }
    }
    let header = ["net", "kernel", "instructions", "flash", "RAM", "no wait", "flash B", "code B", "RAM B", "error"];
    let mut table = titled(header.map(str::to_owned), 2);
    for row in seen.iter().flat_map(|net| results.rows.iter().filter(move |row| row.net == *net)) {
        table.add_row(aligned(cells(row), 2));
    }
    let table = table.trim_fmt();
    // Writing to a string never fails.
    let _ = writeln!(text, "{LEGEND}\n{table}\n");
    for left in &results.left_out {
        let _ = writeln!(text, "No row for {} on {}: {}.", left.kernel, left.net, left.reason);
    }
    let _ = write!(text, "{}", if results.left_out.is_empty() { "" } else { "\n" });
    if let Some(table) = cores(&results.cores) {
        let _ = writeln!(text, "{CORES}\n{table}\n");
    }
    text += ELSEWHERE;
    text
}

/// The second table, if anything stands in it: a line for each core, a column for each kernel.
fn cores(rows: &[CoreRow]) -> Option<String> {
    let lines: Vec<&[CoreRow]> = rows.chunk_by(|row, next| row.core == next.core).collect();
    let kernels = lines.first()?.iter().map(|row| row.kernel);
    let mut table = titled(["net", "core", "target", "uses"].into_iter().chain(kernels).map(str::to_owned), 4);
    for line in lines {
        let Some(CoreRow { net, core, target, uses, .. }) = line.first() else { continue };
        let names = [net, core, target, uses].map(|name| (*name).to_owned());
        table.add_row(aligned(names.into_iter().chain(line.iter().map(|row| row.instructions.to_string())), 4));
    }
    Some(table.trim_fmt())
}

/// A table with nothing but its header.
fn titled(header: impl IntoIterator<Item = String>, names: usize) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_HORIZONTAL_ONLY.row_separator(LineStyle::none())).set_header(aligned(header, names));
    table
}

/// So many names to the left, then numbers to the right.
fn aligned(texts: impl IntoIterator<Item = String>, names: usize) -> impl Iterator<Item = Cell> {
    let side = move |column| if column < names { CellAlignment::Left } else { CellAlignment::Right };
    texts.into_iter().enumerate().map(move |(column, text)| Cell::new(text).set_alignment(side(column)))
}

fn cells(row: &Row) -> [String; 10] {
    [
        row.net.into(),
        row.kernel.into(),
        row.instructions.to_string(),
        row.cycles_flash.to_string(),
        row.cycles_ram.map_or("-".into(), |cycles| cycles.to_string()),
        row.cycles_no_wait.to_string(),
        row.flash_bytes.to_string(),
        row.code_bytes.to_string(),
        row.ram_bytes.to_string(),
        format!("{:.1e}", row.max_error),
    ]
}
