//! Gives the linker the memory map of the microcontroller and cortex-m-rt's script, and the binaries their model.
//!
//! The link arguments are here and not in `RUSTFLAGS`: given twice they fail, and `RUSTFLAGS` in the environment would drop them.

use std::{env, error::Error, fs, path::Path};

/// Where the program starts in flash, bytes from its first, as `0x4000` behind a Crazyflie's boot loader.
const OFFSET_VARIABLE: &str = "IMPROMPTU_FLASH_OFFSET";

/// Names the model file that goes into the binary's flash; a relative path starts at the top of the repository.
const MODEL_VARIABLE: &str = "IMPROMPTU_MODEL";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let top = Path::new(&env::var("CARGO_MANIFEST_DIR")?).join("../..");
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

    println!("cargo::rerun-if-env-changed={OFFSET_VARIABLE}");
    if let Some(offset) = env::var(OFFSET_VARIABLE).ok().filter(|text| !text.is_empty()) {
        println!("cargo::rustc-link-arg-bins=--defsym=_impromptu_flash_offset={:#x}", parse(&offset)?);
    }
    println!("cargo::rustc-link-search={out}");
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    // Without this the sections are padded to the host's page size.
    println!("cargo::rustc-link-arg-bins=--nmagic");
    // A fault on the emulated board shall end it. A jump to 0 (not a Thumb address) inside the handler locks the core up: QEMU
    // then prints the registers and aborts. A handler in Rust would have to be an `unsafe fn`.
    for bin in ["emulated", "netduinoplus2"] {
        println!("cargo::rustc-link-arg-bin={bin}=--defsym=HardFault=0");
    }
    // On the real board it resets, as this handler does, which can be written without unsafe code.
    println!("cargo::rustc-link-arg-bin=crazyflie=--defsym=HardFault=UsageFault");
    Ok(())
}

/// An offset at which a vector table may stand.
fn parse(text: &str) -> Result<u32, String> {
    let number = match text.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16),
        None => text.parse(),
    };
    let offset = number.ok().filter(|offset| offset.is_multiple_of(0x400) && *offset < 512 * 1024);
    offset.ok_or_else(|| format!("{OFFSET_VARIABLE}={text}: not a multiple of 0x400 below 512 KiB"))
}
