//! What the library gives to a firmware that links it, and what it takes from it.

use std::{collections::BTreeSet, fs};

use impromptu_tests::c;
use object::{Object, ObjectSymbol};

use super::folder;

/// Names of the header's functions.
fn declared() -> BTreeSet<String> {
    let header = fs::read_to_string(c::include().join("impromptu.h")).unwrap();
    let calls = header.lines().filter(|line| line.starts_with(|first: char| first.is_ascii_lowercase()));
    calls
        .filter_map(|line| line.split_once('(')?.0.rsplit([' ', '*']).next())
        .filter(|name| name.starts_with("impromptu_"))
        .map(str::to_owned)
        .collect()
}

/// Global symbols that the library for a target defines, and those that it needs.
fn symbols(target: Option<&str>) -> [BTreeSet<String>; 2] {
    let place = folder(&format!("c-symbols-{}", target.unwrap_or("here"))).join("impromptu.o");
    let bytes = fs::read(c::library(target, Some(&place)).unwrap()).unwrap();
    let file = object::File::parse(&*bytes).unwrap();
    let mut found = [BTreeSet::new(), BTreeSet::new()];
    for symbol in file.symbols().filter(|symbol| symbol.is_global()) {
        found[usize::from(symbol.is_undefined())].insert(symbol.name().unwrap().to_owned());
    }
    found
}

/// A symbol more would take the place of the firmware's own: its memcpy, its sinf. And where there is no system nothing is needed
/// of the firmware: no part can panic (`impromptu_can_panic`), no call is slower or other than it was tested with.
fn the_library_defines_the_headers_functions_alone(target: Option<&str>) {
    let [defined, needed] = symbols(target);
    assert_eq!(defined, declared(), "{target:?}");
    assert!(defined.len() > 50);
    match target {
        Some(_) => assert_eq!(needed, BTreeSet::new(), "{target:?}"),
        None => assert!(!needed.iter().any(|name| name.contains("impromptu")), "{needed:?}"),
    }
}

#[test]
fn the_library_for_the_crazyflie_and_for_this_machine_defines_the_headers_functions_alone() {
    the_library_defines_the_headers_functions_alone(c::Machine::Board.target());
    the_library_defines_the_headers_functions_alone(None);
}

/// Half a minute each.
#[test]
#[ignore = "long"]
fn long_the_library_defines_the_headers_functions_alone_for_every_microcontroller() {
    for target in [
        "thumbv6m-none-eabi",
        "thumbv7m-none-eabi",
        "thumbv7em-none-eabi",
        "thumbv8m.main-none-eabi",
        "thumbv8m.main-none-eabihf",
        "riscv32imac-unknown-none-elf",
    ] {
        the_library_defines_the_headers_functions_alone(Some(target));
    }
}

#[test]
fn what_cannot_be_built_is_named() {
    let error = c::library(Some("pdp11-unknown-none"), None).unwrap_err().to_string();
    assert!(error.contains("rustup target add pdp11-unknown-none"), "{error}");
}
