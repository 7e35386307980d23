//! What an evaluation costs on the microcontroller, how exact it is, and that this is said as it is.

use std::sync::LazyLock;

use impromptu_tests::{
    emulator, golden,
    mcu::{
        measurement::{Results, Row, measure},
        nets::TYPICAL_ROWS,
        table,
    },
};

const GOLDEN: &str = "mcu.txt";
/// The network that the thresholds are about.
const ANCHOR: &str = "12-128x4-6";

/// Modelled cycles from flash depend on where the linker puts what, and that, for microflow, on the folder of the checkout.
const FLASH_COLUMN: usize = 3;
const PLACEMENT: f64 = 1e-4;

/// The whole benchmark, run once for all tests.
static RESULTS: LazyLock<Results> = LazyLock::new(|| measure(|_, _| true).expect("the benchmark runs"));

fn row(kernel: &str, net: &str) -> &'static Row {
    let found = RESULTS.rows.iter().find(|row| row.kernel == kernel && row.net == net);
    found.unwrap_or_else(|| panic!("{kernel} has a row for {net}"))
}

#[test]
fn the_golden_table_holds() {
    let compiler = emulator::compiler().unwrap();
    let text = format!(
        "What `cargo mcu` prints; {}=1 rewrites this table.\ncompiler: {compiler}\n\n{}",
        golden::UPDATE_VARIABLE,
        table::text(&RESULTS)
    );
    golden::compare_within(GOLDEN, &text, FLASH_COLUMN, PLACEMENT).unwrap();
}

#[test]
fn int8_beats_every_engine_of_the_registry_in_the_same_run() {
    for net in [ANCHOR, "36-128x4-6"] {
        let ours = row("int8", net);
        for peer in ["plain_f32", "embedded_nn", "embedded_nn_f32", "microflow"] {
            let peer = row(peer, net);
            assert!(ours.cycles_flash < peer.cycles_flash && ours.instructions < peer.instructions, "{ours:?} against {peer:?}");
        }
        for peer in ["embedded_nn", "microflow"] {
            assert!(ours.max_error < row(peer, net).max_error / 1.5, "{ours:?} against {peer}");
        }
    }
}

/// The thresholds that the kernels promise, one after the other.
#[test]
fn the_kernels_keep_their_promises() {
    let int8 = row("int8", ANCHOR);
    let in_ram = int8.cycles_ram.expect("int8 weights fit into RAM");
    let float = row("f32", ANCHOR);
    let promises = [
        ("int8, weights in flash, cycles", int8.cycles_flash as f64, 85_000.0),
        ("int8, weights in RAM, cycles", in_ram as f64, 68_000.0),
        ("int8, error", int8.max_error, 0.12),
        ("int8, code and tables, bytes", int8.code_bytes as f64, 4096.0),
        ("int8, static memory and stack, bytes", int8.ram_bytes as f64, 0.7 * 1024.0),
        ("f32, weights in flash, cycles", float.cycles_flash as f64, 235_000.0),
        ("f32, error", float.max_error, 1e-5),
        ("3-20-20-1 f32, cycles", row("f32", "3-20-20-1").cycles_flash as f64, 5_500.0),
    ];
    let broken: Vec<String> = promises
        .iter()
        .filter(|(_, found, most)| found > most)
        .map(|(what, found, most)| format!("{what}: {found}, at most {most}"))
        .collect();
    assert!(broken.is_empty(), "{broken:#?}");
}

/// Cores with the DSP extension take the instructions of the M4 and 2 % more at most.
#[test]
fn int8_takes_the_same_on_every_core_with_the_dsp_extension() {
    let instructions = |core: &str| {
        let found = RESULTS.cores.iter().find(|row| row.core == core && row.kernel == "int8");
        found.unwrap_or_else(|| panic!("there is a row for {core}")).instructions
    };
    let most = 1.02 * row("int8", ANCHOR).instructions.min(instructions("M4F")) as f64;
    for core in ["M7", "M33"] {
        assert!(instructions(core) as f64 <= most, "{core}: {} of {most}", instructions(core));
    }
    // A core without it takes the twin.
    assert!(instructions("M3") > 3 * instructions("M4F"));
}

/// Zeros and inputs far out of range take what typical inputs take, to the cycle; with tanh within what the flash lines of its
/// table make, which other values read.
#[test]
fn the_worst_case_of_int8_is_the_typical_case() {
    for row in RESULTS.rows.iter().filter(|row| row.kernel == "int8") {
        let cycles = &row.cycles_by_input;
        assert_eq!(cycles.len(), TYPICAL_ROWS + 2);
        let [least, most] = [cycles.iter().min(), cycles.iter().max()].map(|cycles| *cycles.expect("inputs"));
        let tanh = ["3-20-20-1", "shipped"].contains(&row.net);
        assert!(if tanh { most as f64 <= 1.1 * least as f64 } else { most == least }, "{row:?}");
    }
}

/// The README's table is a part of the golden one.
#[test]
fn the_readme_tells_the_numbers_of_the_benchmark() {
    let readme = include_str!("../../README.md");
    let mut checked = 0;
    for line in readme.lines().filter(|line| line.starts_with(&format!("| {ANCHOR} |"))) {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        let row = row(cells[1], cells[0]);
        let in_ram = row.cycles_ram.map_or("-".to_owned(), |cycles| cycles.to_string());
        let [instructions, cycles] = [row.instructions, row.cycles_flash].map(|number| number.to_string());
        let bytes = [row.flash_bytes, row.ram_bytes].map(|number| number.to_string());
        let cycles = if golden::near(cells[3], &cycles, PLACEMENT) { cells[3] } else { &cycles };
        let found = [&instructions, cycles, &in_ram, &bytes[0], &bytes[1], &format!("{:.1e}", row.max_error)];
        assert_eq!(cells[2..], found, "{line}");
        checked += 1;
    }
    assert!(checked >= 6, "the README has a table of the benchmark");
}
