//! Gives the linker cortex-m-rt's script; the memory map is that of the library on which the boards rest
//! (firmware/build.rs).
//!
//! The link arguments are here and not in `RUSTFLAGS`: given twice they fail, and `RUSTFLAGS` in the environment would drop them.

use std::{env, error::Error};

/// Where the program starts in flash, bytes from its first, as `0x4000` behind a Crazyflie's boot loader.
const OFFSET_VARIABLE: &str = "IMPROMPTU_FLASH_OFFSET";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    println!("cargo::rerun-if-env-changed={OFFSET_VARIABLE}");
    if let Some(offset) = env::var(OFFSET_VARIABLE).ok().filter(|text| !text.is_empty()) {
        println!("cargo::rustc-link-arg-bins=--defsym=_impromptu_flash_offset={:#x}", parse(&offset)?);
    }
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

/// An offset at which a vector table may stand.
fn parse(text: &str) -> Result<u32, String> {
    let number = match text.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16),
        None => text.parse(),
    };
    let offset = number.ok().filter(|offset| offset.is_multiple_of(0x400) && *offset < 512 * 1024);
    offset.ok_or_else(|| format!("{OFFSET_VARIABLE}={text}: not a multiple of 0x400 below 512 KiB"))
}
