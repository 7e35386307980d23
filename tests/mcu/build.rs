//! Links the benchmark as the firmware is linked, and embeds the networks that `cargo mcu` prepared.

use std::{env, error::Error, ffi::OsString, fs, path::Path};

/// Names a folder with one file for each network, in the form of its kernels.
const IMAGES_VARIABLE: &str = "IMPROMPTU_MCU_IMAGES";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(peers)");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let out = env::var("OUT_DIR")?;
    let memory = Path::new(&env::var("CARGO_MANIFEST_DIR")?).join("../../firmware/board/memory/stm32f405.x");
    println!("cargo::rerun-if-changed={}", memory.display());
    fs::copy(&memory, Path::new(&out).join("memory.x")).map_err(|error| format!("cannot copy {}: {error}", memory.display()))?;

    println!("cargo::rerun-if-env-changed={IMAGES_VARIABLE}");
    let mut names: Vec<OsString> = Vec::new();
    if let Some(folder) = env::var_os(IMAGES_VARIABLE).filter(|folder| !folder.is_empty()) {
        println!("cargo::rerun-if-changed={}", Path::new(&folder).display());
        for entry in fs::read_dir(&folder).map_err(|error| format!("{IMAGES_VARIABLE}: {error}"))? {
            let entry = entry?;
            println!("cargo::rerun-if-changed={}", entry.path().display());
            fs::copy(entry.path(), Path::new(&out).join(entry.file_name()))?;
            names.push(entry.file_name());
        }
    }
    // The order is the numbering.
    names.sort();
    let mut list = String::from("static IMAGES: &[&Aligned<[u8]>] = &[\n");
    for name in &names {
        let name = name.to_str().ok_or("an image's name is not Unicode")?;
        list += &format!("    &Aligned(*include_bytes!(concat!(env!(\"OUT_DIR\"), \"/{name}\"))),\n");
        if name.starts_with("s8-") {
            println!("cargo::rustc-cfg=peers");
        }
    }
    fs::write(Path::new(&out).join("images.rs"), list + "];\n")?;

    println!("cargo::rustc-link-search={out}");
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    println!("cargo::rustc-link-arg-bins=--nmagic");
    // Its images need the flash of the uploaded models.
    println!("cargo::rustc-link-arg-bins=--defsym=_impromptu_no_models=1");
    // A fault ends the emulator, see firmware/board/build.rs.
    println!("cargo::rustc-link-arg-bins=--defsym=HardFault=0");
    Ok(())
}
