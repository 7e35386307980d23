//! Gives the linker the memory map of the microcontroller and cortex-m-rt's script, and the binaries their model.
//!
//! The link arguments are here and not in `RUSTFLAGS`: given twice they fail, and `RUSTFLAGS` in the environment would drop them.

use std::{env, error::Error, fs, path::Path};

/// Names the model file that goes into the binary's flash; a relative path starts at the top of the repository.
const MODEL_VARIABLE: &str = "IMPROMPTU_MODEL";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    // The stable compiler does not tell whether a target has the DSP instructions; of its targets, this one has, and the FPU too.
    println!("cargo::rustc-check-cfg=cfg(cortex_m4)");
    if env::var("TARGET")? == "thumbv7em-none-eabihf" {
        println!("cargo::rustc-cfg=cortex_m4");
    }
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let top = Path::new(&env::var("CARGO_MANIFEST_DIR")?).join("..");
    let out = env::var("OUT_DIR")?;

    let memory = top.join("memory.x");
    println!("cargo::rerun-if-changed={}", memory.display());
    fs::copy(&memory, Path::new(&out).join("memory.x")).map_err(|error| format!("cannot copy {}: {error}", memory.display()))?;

    // No bytes mean no model: such a binary flies the baseline alone.
    println!("cargo::rerun-if-env-changed={MODEL_VARIABLE}");
    let bytes = match env::var_os(MODEL_VARIABLE).filter(|path| !path.is_empty()) {
        Some(path) => {
            let path = top.join(path);
            println!("cargo::rerun-if-changed={}", path.display());
            fs::read(&path).map_err(|error| format!("{MODEL_VARIABLE}: cannot read {}: {error}", path.display()))?
        }
        None => Vec::new(),
    };
    fs::write(Path::new(&out).join("model"), bytes)?;

    println!("cargo::rustc-link-search={out}");
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    // Without this the sections are padded to the host's page size.
    println!("cargo::rustc-link-arg-bins=--nmagic");
    // A fault on the emulated board shall end it. A jump to 0 (not a Thumb address) inside the handler locks the core up: QEMU
    // then prints the registers and aborts. A handler in Rust would have to be an `unsafe fn`.
    for bin in ["netduinoplus2", "kernels"] {
        println!("cargo::rustc-link-arg-bin={bin}=--defsym=HardFault=0");
    }
    Ok(())
}
