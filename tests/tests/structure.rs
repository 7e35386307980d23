//! The crates are houses with floors: no circle between files, and every use runs down the layers that the crate's first page
//! states.

use std::process::Command;

use impromptu_tests::{
    emulator::workspace,
    structure::{Structure, libraries},
};

#[test]
fn no_files_use_each_other_in_a_circle() {
    for library in libraries(workspace()).unwrap() {
        let circles = Structure::read(&library).unwrap().circles();
        assert!(circles.is_empty(), "{}:\n  {}", library.display(), circles.join("\n\n  "));
    }
}

#[test]
fn every_use_runs_down_the_layers_that_the_crates_first_page_states() {
    for library in libraries(workspace()).unwrap() {
        let structure = Structure::read(&library).unwrap();
        assert!(!structure.layers().is_empty(), "{} states no layers", library.display());
        let found = structure.contradictions();
        assert!(found.is_empty(), "{}:\n  {}", library.display(), found.join("\n  "));
    }
}

/// Whoever adds the library gets no board with it: nothing of a Cortex-M, of a microcontroller or of a debugger in its tree, and
/// no build script that touches the linker.
#[test]
fn the_library_knows_no_board() {
    let tree = Command::new(env!("CARGO"))
        .args(["tree", "--locked", "--all-features", "--edges", "normal,build", "--prefix", "none", "--format", "{p}"])
        .args(["--target", "thumbv7em-none-eabihf", "--package", "impromptu-firmware", "--package", "impromptu-flight"])
        .current_dir(workspace())
        .output()
        .unwrap();
    assert!(tree.status.success(), "{}", String::from_utf8_lossy(&tree.stderr));
    let tree = String::from_utf8(tree.stdout).unwrap();
    assert!(tree.contains("impromptu-flight") && tree.contains("heapless"));
    let boards: Vec<&str> =
        tree.lines().filter(|line| ["cortex", "stm32", "semihosting"].iter().any(|board| line.contains(board))).collect();
    assert!(boards.is_empty(), "{boards:#?}");
    for script in ["firmware/build.rs", "firmware/flight/build.rs"] {
        let text = std::fs::read_to_string(workspace().join(script)).unwrap_or_default();
        assert!(!text.contains("rustc-link"), "{script} gives the linker arguments");
    }
}
