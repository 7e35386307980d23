//! Links the benchmark as the firmware is linked, and embeds the networks that `cargo mcu` prepared.

use std::{collections::BTreeMap, env, error::Error, fs, path::Path};

/// Names a folder with one file for each network, in the form of its kernels.
const IMAGES_VARIABLE: &str = "IMPROMPTU_MCU_IMAGES";
/// Suits every section of a model file.
const ALIGNMENT: usize = 16;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(peers)");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let out = env::var("OUT_DIR")?;
    let memory = Path::new(&env::var("CARGO_MANIFEST_DIR")?).join("../../../memory.x");
    println!("cargo::rerun-if-changed={}", memory.display());
    fs::copy(&memory, Path::new(&out).join("memory.x")).map_err(|error| format!("cannot copy {}: {error}", memory.display()))?;

    println!("cargo::rerun-if-env-changed={IMAGES_VARIABLE}");
    let mut images = BTreeMap::new();
    if let Some(folder) = env::var_os(IMAGES_VARIABLE).filter(|folder| !folder.is_empty()) {
        println!("cargo::rerun-if-changed={}", Path::new(&folder).display());
        for entry in fs::read_dir(&folder).map_err(|error| format!("{IMAGES_VARIABLE}: {error}"))? {
            let entry = entry?;
            println!("cargo::rerun-if-changed={}", entry.path().display());
            let image = fs::read(entry.path()).map_err(|error| format!("{}: {error}", entry.path().display()))?;
            // An engine of the registry takes its network apart while it is compiled.
            fs::write(Path::new(&out).join(entry.file_name()), &image)?;
            images.insert(entry.file_name(), image);
        }
    }
    if images.keys().any(|name| name.as_encoded_bytes().starts_with(b"s8-")) {
        println!("cargo::rustc-cfg=peers");
    }
    // One static: many would be laid out in the order of their hashes, in which the checkout's path takes part, and cycles
    // depend on addresses. The order of the names is the numbering.
    let (mut bytes, mut ranges) = (Vec::new(), Vec::new());
    for image in images.into_values() {
        ranges.push(bytes.len()..bytes.len() + image.len());
        bytes.extend(image);
        bytes.resize(bytes.len().next_multiple_of(ALIGNMENT), 0);
    }
    fs::write(Path::new(&out).join("images.bin"), bytes)?;
    fs::write(
        Path::new(&out).join("images.rs"),
        format!(
            "static BYTES: &Aligned<[u8]> = &Aligned(*include_bytes!(concat!(env!(\"OUT_DIR\"), \"/images.bin\")));\n\
             static IMAGES: &[core::ops::Range<usize>] = &{ranges:?};\n"
        ),
    )?;

    println!("cargo::rustc-link-search={out}");
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    println!("cargo::rustc-link-arg-bins=--nmagic");
    // Its images need the flash of the uploaded models.
    println!("cargo::rustc-link-arg-bins=--defsym=_impromptu_no_models=1");
    // A fault ends the emulator, see firmware/board/build.rs.
    println!("cargo::rustc-link-arg-bins=--defsym=HardFault=0");
    Ok(())
}
