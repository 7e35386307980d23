//! Each thing that flight code must not have is found where it is planted, and only there.

use std::sync::LazyLock;

use impromptu_tests::{
    elf::{
        Elf,
        graph::CallGraph,
        proof::{Finding, Proof},
        reach::EXCEPTION_FRAME,
    },
    emulator::{FIRMWARE, build_firmware},
};

static IMAGE: LazyLock<Elf> =
    LazyLock::new(|| Elf::read(&build_firmware("impromptu-planted", "planted", FIRMWARE, &[]).unwrap()).unwrap());

/// Whether something was found, by the name of what was looked for.
fn found(proof: &Proof<'_>) -> Vec<&'static str> {
    let found = [
        ("panic", !proof.panics().is_empty()),
        ("f64", !proof.double_precision().is_empty()),
        ("allocation", !proof.allocations().is_empty()),
        ("recursion", !proof.recursion().is_empty()),
        ("flaw", !proof.flaws().is_empty()),
        ("indirect call", !proof.indirect().is_empty()),
        ("no stack bound", proof.stack_bytes().is_err()),
    ];
    found.into_iter().filter(|(_, found)| *found).map(|(what, _)| what).collect()
}

fn plant<'g>(graph: &'g CallGraph<'g>, name: &str) -> Proof<'g> {
    graph.from_roots(&[&format!("planted::plants::{name}")]).unwrap()
}

#[test]
fn each_plant_is_found_by_its_own_name() {
    let graph = IMAGE.call_graph().unwrap();
    // A panic comes with the formatting of its message.
    let panic = ["panic", "recursion", "indirect call", "no stack bound"].as_slice();
    let plants: [(&str, &[&str]); 11] = [
        ("harmless", &[]),
        ("bounds_check", panic),
        ("behind_a_table", panic),
        ("behind_a_tail_call", panic),
        ("double_precision", &["f64"]),
        ("recursion", &["recursion", "no stack bound"]),
        ("mutual_recursion", &["recursion", "no stack bound"]),
        ("indirect", &["indirect call", "no stack bound"]),
        ("calculated_stack", &["flaw", "no stack bound"]),
        ("deep", &[]),
        ("shallow", &[]),
    ];
    for (name, what) in plants {
        assert_eq!(found(&plant(&graph, name)), what, "{name}");
    }
}

#[test]
fn a_panic_is_told_with_its_chain_of_callers() {
    let graph = IMAGE.call_graph().unwrap();
    let panics = plant(&graph, "behind_a_table").panics();
    let chain = "planted::plants::behind_a_table -> planted::plants::bounds_check -> core::panicking::panic_bounds_check";
    assert!(panics.iter().map(Finding::to_string).any(|line| line.ends_with(chain)), "{panics:#?}");
}

#[test]
fn a_declared_target_of_an_indirect_call_is_followed() {
    let mut graph = IMAGE.call_graph().unwrap();
    graph.declare("plants::indirect", &["plants::harmless", "plants::double_precision"]).unwrap();
    assert_eq!(found(&plant(&graph, "indirect")), ["f64"]);
    let error = graph.declare("plants::harmless", &["plants::deep"]).unwrap_err().to_string();
    assert!(error.contains("makes no indirect call"), "{error}");
    let error = graph.declare("plants::indirect", &["plants::nobody"]).unwrap_err().to_string();
    assert!(error.contains("plants::nobody"), "{error}");
    assert!(graph.from_roots(&["plants::nobody"]).is_err());
}

#[test]
fn the_stack_adds_up_along_calls_and_over_nested_interrupts() {
    let graph = IMAGE.call_graph().unwrap();
    let [deep, shallow] = ["deep", "shallow"].map(|name| plant(&graph, name).stack_bytes().unwrap());
    assert!((40..200).contains(&shallow) && (400 + shallow..600).contains(&deep), "{deep}, {shallow}");
    let path = plant(&graph, "deep").stack_path().unwrap();
    assert_eq!(path.iter().map(|(_, bytes)| bytes).sum::<u32>(), deep);
    assert_eq!(path.last(), Some(&("planted::plants::shallow".to_owned(), shallow)));
    assert_eq!(graph.stack_along(&["plants::deep", "plants::shallow"]).unwrap(), deep);
    assert!(graph.stack_along(&["plants::shallow", "plants::deep"]).is_err());
    let nested = graph.nested_stack_bytes(&["plants::harmless"], &[&["plants::deep", "plants::shallow"], &["plants::shallow"]]);
    let harmless = plant(&graph, "harmless").stack_bytes().unwrap();
    assert_eq!(nested.unwrap(), harmless + EXCEPTION_FRAME + deep + EXCEPTION_FRAME + shallow);
    assert!(graph.nested_stack_bytes(&["plants::harmless"], &[&["plants::recursion"]]).is_err());
}

#[test]
fn memory_is_counted_once_and_weights_apart() {
    let whole = IMAGE.footprint(&[]).unwrap();
    let without = IMAGE.footprint(&["planted::plants::TABLE", ".vector_table"]).unwrap();
    assert_eq!(whole.weights, 0);
    assert_eq!(without.flash + without.weights, whole.flash);
    assert_eq!(without.weights, 32 + 1024);
    assert_eq!(whole.flash + whole.ram, whole.sections.iter().map(|(_, bytes)| bytes).sum::<u32>());
    assert!(IMAGE.footprint(&["NOBODY"]).is_err());
}
