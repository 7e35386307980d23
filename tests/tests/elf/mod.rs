//! What a control tick can reach in the binary that is flashed, and that the analysis which says so finds what is planted.

mod instruction;
mod planted;

use std::path::Path;

use impromptu_firmware::adapter::Lanes;
use impromptu_firmware::model::Model;
use impromptu_model_export::Precision;
use impromptu_tests::{
    board,
    elf::{Elf, proof::Finding},
    emulator, golden,
};

use crate::board::{flight, model};

const GOLDEN: &str = "elf.txt";
/// A control tick: baseline loop, add-on with both lanes.
const TICK: &str = "netduinoplus2::replay::step";
/// The kernels in assembly that jump to their own labels by address.
const LABELLED: [&str; 4] =
    ["cortex_m::float::float_kernel", "cortex_m::float::float_six_kernel", "cortex_m::integer::int8", "cortex_m::integer::int16"];

/// A binary whose kernels can be followed.
pub(crate) fn read(elf: &Path) -> Elf {
    let mut image = Elf::read(elf).unwrap();
    LABELLED.iter().for_each(|name| image.declare_labels(name).unwrap());
    image
}

fn lines(findings: &[Finding]) -> String {
    findings.iter().map(|finding| format!("{finding}\n")).collect()
}

#[test]
fn a_control_tick_reaches_no_panic_no_heap_no_recursion_and_no_f64() {
    let image = read(&board::build(None).unwrap());
    let graph = image.call_graph().unwrap();
    let proof = graph.from_roots(&[TICK]).unwrap();
    for what in
        ["AxisState::step", "Network::run", "cortex_m::integer::int8", "portable::integer", "cortex_m::float::float_kernel"]
    {
        assert!(proof.reached().iter().any(|name| name.contains(what)), "the tick has all lanes and kernels: {what}");
    }
    let findings = [proof.flaws(), proof.panics(), proof.allocations(), proof.indirect(), proof.double_precision()];
    assert_eq!(findings.map(|findings| lines(&findings)), [""; 5], "flaws, panics, allocations, indirect calls, f64");
    assert_eq!(proof.recursion(), Vec::<Vec<String>>::new());
}

#[test]
fn the_stack_bound_holds_what_the_board_measures_and_not_half_as_much_again() {
    for precision in [Precision::Int8, Precision::Float] {
        let file = model::file(&model::TANH, precision);
        let image = read(&board::build(Some(&file)).unwrap());
        let graph = image.call_graph().unwrap();
        let chain = ["Reset", "main", "__cortex_m_rt_main", "netduinoplus2::replay::fly", TICK];
        let bound = graph.stack_along(&chain).unwrap();
        let model = Model::from_bytes(&file).unwrap();
        let flight = flight::fly(Some((&model, Lanes::BOTH)), 500, |_| None);
        let report = board::fly_again(&format!("stack {precision:?}"), Some(&file), &flight).unwrap();
        let measured = u32::try_from(report["stack_bytes"]["flight"].as_u64().unwrap()).unwrap();
        println!("{precision:?}: bound {bound}, measured {measured}");
        assert!((measured..=measured * 3 / 2).contains(&bound), "{precision:?}: bound {bound}, measured {measured}");
    }
}

#[test]
fn the_golden_memory_holds() {
    let file = model::file(&model::TANH, Precision::Int8);
    let image = read(&board::build(Some(&file)).unwrap());
    let footprint = image.footprint(&["netduinoplus2::replay::MODEL"]).unwrap();
    assert_eq!(footprint.weights as usize, file.len().next_multiple_of(16), "the model, on its boundary, is told apart");
    let graph = image.call_graph().unwrap();
    let path = graph.from_roots(&[TICK]).unwrap().stack_path().unwrap();
    let stack: u32 = path.iter().map(|(_, bytes)| bytes).sum();
    let path: String = path.iter().map(|(name, bytes)| format!("{bytes:>7} {name}\n")).collect();
    let compiler = emulator::compiler().unwrap();
    let text = format!(
        "Bytes of the emulated board's binary and of the deepest stack of a control tick; {}=1 rewrites this table.\n\
         compiler: {compiler}\n\n{}\n{stack:>7} stack of a control tick\n\n{path}",
        golden::UPDATE_VARIABLE,
        footprint.table(12)
    );
    golden::compare(GOLDEN, &text).unwrap();
}

#[test]
fn the_tasks_of_the_board_reach_no_panic_no_heap_no_recursion_and_no_f64() {
    let image = read(&emulator::build_firmware("impromptu-board", "crazyflie", emulator::BOARD, &[]).unwrap());
    let graph = image.call_graph().unwrap();
    let proof = graph.from_roots(&["SysTick", "DCMI", "USART3"]).unwrap();
    let findings = [proof.flaws(), proof.panics(), proof.allocations(), proof.indirect(), proof.double_precision()];
    assert_eq!(findings.map(|findings| lines(&findings)), [""; 5], "flaws, panics, allocations, indirect calls, f64");
    assert_eq!(proof.recursion(), Vec::<Vec<String>>::new());
}
