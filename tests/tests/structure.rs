//! The crates are houses with floors: no circle between files, and every use runs down the layers that the crate's first page
//! states.

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
