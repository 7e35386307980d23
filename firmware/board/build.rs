//! Gives the linker the memory map of the microcontroller and cortex-m-rt's script.
//!
//! The link arguments are here and not in `RUSTFLAGS`: given twice they fail, and `RUSTFLAGS` in the environment would drop them.

use std::{env, error::Error, fs, path::Path};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let memory = Path::new(&env::var("CARGO_MANIFEST_DIR")?).join("../../memory.x");
    let out = env::var("OUT_DIR")?;
    println!("cargo::rerun-if-changed={}", memory.display());
    fs::copy(&memory, Path::new(&out).join("memory.x")).map_err(|error| format!("cannot copy {}: {error}", memory.display()))?;
    println!("cargo::rustc-link-search={out}");
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    // Without this the sections are padded to the host's page size.
    println!("cargo::rustc-link-arg-bins=--nmagic");
    // A fault on the emulated board shall end it. A jump to 0 (not a Thumb address) inside the handler locks the core up: QEMU
    // then prints the registers and aborts.
    println!("cargo::rustc-link-arg-bin=emulated=--defsym=HardFault=0");
    Ok(())
}
