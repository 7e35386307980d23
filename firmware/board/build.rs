//! Gives the linker the memory map of the microcontroller and cortex-m-rt's script.
//!
//! The link arguments are here and not in `RUSTFLAGS`: given twice they fail, and `RUSTFLAGS` in the environment would drop them.

use std::{env, error::Error, fs, path::Path};

/// Where the program starts in flash, bytes from its first, as `0x4000` behind a Crazyflie's boot loader.
const OFFSET_VARIABLE: &str = "IMPROMPTU_FLASH_OFFSET";
/// The line of memory.x that it changes.
const FLASH: &str = "FLASH  : ORIGIN = 0x08000000, LENGTH = 768K";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let memory = Path::new(&env::var("CARGO_MANIFEST_DIR")?).join("../../memory.x");
    let out = env::var("OUT_DIR")?;
    println!("cargo::rerun-if-changed={}", memory.display());
    println!("cargo::rerun-if-env-changed={OFFSET_VARIABLE}");
    let map = fs::read_to_string(&memory).map_err(|error| format!("cannot read {}: {error}", memory.display()))?;
    fs::write(Path::new(&out).join("memory.x"), behind_boot_loader(&map, env::var(OFFSET_VARIABLE).ok().as_deref())?)?;
    println!("cargo::rustc-link-search={out}");
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    // Without this the sections are padded to the host's page size.
    println!("cargo::rustc-link-arg-bins=--nmagic");
    // A fault on the emulated board shall end it. A jump to 0 (not a Thumb address) inside the handler locks the core up: QEMU
    // then prints the registers and aborts.
    println!("cargo::rustc-link-arg-bin=emulated=--defsym=HardFault=0");
    // On the real board it resets, as this handler does, which can be written without unsafe code.
    println!("cargo::rustc-link-arg-bin=crazyflie=--defsym=HardFault=UsageFault");
    Ok(())
}

/// The memory map with the program so many bytes further on.
fn behind_boot_loader(map: &str, offset: Option<&str>) -> Result<String, Box<dyn Error>> {
    let Some(text) = offset.filter(|text| !text.is_empty()) else { return Ok(map.to_owned()) };
    let offset = match text.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16),
        None => text.parse(),
    };
    let offset = offset.ok().filter(|offset| offset.is_multiple_of(0x400) && *offset < 512 * 1024);
    let offset = offset.ok_or_else(|| format!("{OFFSET_VARIABLE}={text}: not a multiple of 0x400 below 512 KiB"))?;
    if !map.contains(FLASH) {
        return Err(format!("memory.x has no line `{FLASH}`").into());
    }
    let moved = format!("FLASH  : ORIGIN = {:#010x}, LENGTH = {}K", 0x0800_0000 + offset, 768 - offset / 1024);
    Ok(map.replace(FLASH, &moved))
}
