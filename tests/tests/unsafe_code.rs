//! One module alone contains unsafe code, and says of every block why it is sound.

use std::{fs, path::Path};

/// Where the assembly is.
const KERNELS: &str = "firmware/src/network/cortex_m4.rs";

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
fn unsafe_code_is_in_the_kernels_alone_and_explained() {
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
        assert!(lines == 0 || place == KERNELS, "{place} contains {keyword} code");
    }
    let (_, kernels) = files.iter().find(|(place, _)| place == KERNELS).unwrap();
    let lines: Vec<&str> = kernels.lines().collect();
    for (index, line) in lines.iter().enumerate() {
        let mut above = lines[..index].iter().rev().take_while(|line| line.trim_start().starts_with("//") || line.contains("#["));
        let mut explained = |words: &str| above.any(|line| line.contains(words));
        if line.contains(&format!("{keyword} {{")) {
            assert!(explained("SAFETY:"), "{KERNELS}:{}: without a reason", index + 1);
        }
        if line.contains(&format!("{keyword} extern")) {
            assert!(explained("# Safety"), "{KERNELS}:{}: without its conditions", index + 1);
        }
    }
}
