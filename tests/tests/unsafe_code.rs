//! Two places alone contain unsafe code, the assembly and the C face, and say of every block why it is sound.

use std::{fs, path::Path};

/// Where the assembly is.
const KERNELS: &str = "firmware/src/network/cortex_m4.rs";
/// Where pointers of C become values. The permission for the folder, and the conditions of every function, are in the first file.
const EDGE: [&str; 6] = [
    "firmware/c-abi/src/edge/mod.rs",
    "firmware/c-abi/src/edge/adapter.rs",
    "firmware/c-abi/src/edge/flight.rs",
    "firmware/c-abi/src/edge/model.rs",
    "firmware/c-abi/src/edge/panic.rs",
    "firmware/c-abi/src/edge/signals.rs",
];

/// Rust files below `folder`, as paths from `top`, with their text.
fn sources(top: &Path, folder: &Path, found: &mut Vec<(String, String)>) {
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let (path, name) = (entry.path(), entry.file_name());
        if path.is_dir() {
            if name != "target" && !name.to_string_lossy().starts_with('.') {
                sources(top, &path, found);
            }
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let place = path.strip_prefix(top).unwrap().to_string_lossy().replace('\\', "/");
            found.push((place, fs::read_to_string(&path).unwrap()));
        }
    }
}

#[test]
fn unsafe_code_is_in_the_kernels_and_the_c_face_alone_and_explained() {
    let top = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).canonicalize().unwrap();
    let mut files = Vec::new();
    sources(&top, &top, &mut files);
    assert!(files.len() > 100);
    // Written so that this file does not contain what it looks for.
    let keyword = concat!("un", "safe");
    let permission = format!("allow({keyword}_code");
    for (place, text) in &files {
        let uses = |line: &&str| {
            let code = line.split("//").next().unwrap_or_default();
            let words = code.split(|c: char| !(c.is_alphanumeric() || c == '_'));
            code.contains(&permission) || words.into_iter().any(|word| word == keyword)
        };
        let lines = text.lines().filter(uses).count();
        assert!(lines == 0 || place == KERNELS || EDGE.contains(&place.as_str()), "{place} contains {keyword} code");
    }
    let permitted =
        files.iter().filter(|(_, text)| text.lines().any(|line| line.trim().starts_with(&format!("#![{permission}"))));
    assert!(permitted.count() <= 2, "a module has a permission of its own");
    for place in [KERNELS].iter().chain(&EDGE) {
        let (_, text) = files.iter().find(|(file, _)| file == place).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        for (index, line) in lines.iter().enumerate() {
            let mut above =
                lines[..index].iter().rev().take_while(|line| line.trim_start().starts_with("//") || line.contains("#["));
            let mut explained = |words: &str| above.any(|line| line.contains(words));
            if line.contains(&format!("{keyword} {{")) && !line.trim_start().starts_with("//") {
                assert!(explained("SAFETY:"), "{place}:{}: without a reason", index + 1);
            }
            if *place == KERNELS && line.contains(&format!("{keyword} extern")) {
                assert!(explained("# Safety"), "{place}:{}: without its conditions", index + 1);
            }
        }
    }
    let (_, edge) = files.iter().find(|(file, _)| file == EDGE[0]).unwrap();
    assert!(edge.contains("//! # Safety"), "{} states the conditions of every function", EDGE[0]);
}
