//! The program in a WebAssembly interpreter: what it reads and writes lies in its memory
//! (`firmware/board/twins/src/letterbox.rs`).

use std::fs;

use impromptu_tests::twins::{cases::Cases, cores};
use wasmi::{Engine, Linker, Memory, Module, Store};

use super::cases;

const TARGET: &str = "wasm32-unknown-unknown";
/// What stands in front of the letterbox's address and length.
const MARKER: [u8; 16] = *b"impromptu twins.";

/// Words of the memory from an address on.
fn words(memory: &[u8], address: usize, count: usize) -> Vec<u32> {
    memory[address..][..4 * count].as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect()
}

/// The only address at which a letterbox stands.
fn letterbox(memory: &[u8]) -> (usize, usize) {
    let places: Vec<usize> = (0..memory.len() - 24).step_by(4).filter(|at| memory[*at..].starts_with(&MARKER)).collect();
    let [place] = places[..] else { panic!("the marker stands {} times in the memory", places.len()) };
    let found = words(memory, place + MARKER.len(), 2);
    (found[0] as usize, found[1] as usize)
}

/// Outputs and counts: cases, different ones, not aligned ones.
fn run(cases: &Cases) -> (Vec<u8>, Vec<u32>) {
    let program = fs::read(cores::program(TARGET, &[]).unwrap()).unwrap();
    let engine = Engine::default();
    let module = Module::new(&engine, &program).unwrap();
    assert_eq!(module.imports().count(), 0, "it needs nothing of its host");
    let mut store = Store::new(&engine, ());
    let instance = Linker::new(&engine).instantiate_and_start(&mut store, &module).unwrap();
    let memory: Memory = instance.get_memory(&store, "memory").unwrap();

    let (address, length) = letterbox(memory.data(&store));
    let file = cases.file();
    assert!(4 + file.len() <= 4 * length, "{} bytes of cases do not fit", file.len());
    memory.write(&mut store, address, &(file.len() as u32).to_le_bytes()).unwrap();
    memory.write(&mut store, address + 4, &file).unwrap();
    let main = instance.get_typed_func::<(i32, i32), i32>(&store, "main").unwrap();
    assert_eq!(main.call(&mut store, (0, 0)).unwrap(), 0);

    let data = memory.data(&store);
    let bytes = words(data, address, 1)[0] as usize;
    assert!(4 + bytes <= 4 * length, "the program says that it failed");
    (data[address + 4..][..bytes].to_vec(), words(data, address + 4 + bytes, 3))
}

#[test]
fn the_same_bits_in_web_assembly() {
    let cases = cases(300, 256 * 1024, true);
    let (outputs, counts) = run(&cases);
    cases.compare(&outputs).unwrap();
    assert_eq!(counts, [cases.count() as u32, 0, cases.unaligned() as u32]);
}
