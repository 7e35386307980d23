//! Gives the linker the memory map of the microcontroller and cortex-m-rt's script; the same for both examples.

use std::{env, error::Error, fs, path::Path};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=../build.rs");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let memory = Path::new(&env::var("CARGO_MANIFEST_DIR")?).join("../../../../memory.x");
    println!("cargo::rerun-if-changed={}", memory.display());
    let out = env::var("OUT_DIR")?;
    fs::copy(&memory, Path::new(&out).join("memory.x")).map_err(|error| format!("cannot copy {}: {error}", memory.display()))?;
    println!("cargo::rustc-link-search={out}");
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    // Without this the sections are padded to the host's page size.
    println!("cargo::rustc-link-arg-bins=--nmagic");
    // There are no models beside the one in the program.
    println!("cargo::rustc-link-arg-bins=--defsym=_impromptu_no_models=1");
    // A fault ends the emulator, see firmware/board/build.rs.
    println!("cargo::rustc-link-arg-bins=--defsym=HardFault=0");
    Ok(())
}
