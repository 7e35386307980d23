//! Links the program for the machine that QEMU has for the target.

use std::{env, error::Error, fs, path::Path};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(small)");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let target = env::var("TARGET")?;
    let name = match target.split('-').next() {
        Some("thumbv6m") => "microbit.x",
        Some("thumbv8m.main") => "mps2-an505.x",
        _ => "mps2.x",
    };
    if name == "microbit.x" {
        println!("cargo::rustc-cfg=small");
    }
    let memory = Path::new(&env::var("CARGO_MANIFEST_DIR")?).join("../memory").join(name);
    println!("cargo::rerun-if-changed={}", memory.display());
    let out = env::var("OUT_DIR")?;
    fs::copy(&memory, Path::new(&out).join("memory.x")).map_err(|error| format!("cannot copy {}: {error}", memory.display()))?;
    println!("cargo::rustc-link-search={out}");
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    println!("cargo::rustc-link-arg-bins=--nmagic");
    // A fault ends the emulator, see firmware/board/build.rs.
    println!("cargo::rustc-link-arg-bins=--defsym=HardFault=0");
    Ok(())
}
