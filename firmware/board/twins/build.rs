//! Links the program for the machine that QEMU has for the target.

use std::{env, error::Error, fs, path::Path};

/// Where a machine has its memory: start and length of that for code and of that for data.
struct Machine {
    flash: [u32; 2],
    ram: [u32; 2],
}

const KIB: u32 = 1024;
const MIB: u32 = 1024 * KIB;
/// `microbit`: an nRF51822, Cortex-M0.
const MICROBIT: Machine = Machine { flash: [0, 256 * KIB], ram: [0x2000_0000, 16 * KIB] };
/// `mps2-an385` (Cortex-M3), `mps2-an386` (M4) and `mps2-an500` (M7).
const MPS2: Machine = Machine { flash: [0, 4 * MIB], ram: [0x2000_0000, 4 * MIB] };
/// `mps2-an505` (Cortex-M33), which starts in the secure state: the secure aliases.
const MPS2_AN505: Machine = Machine { flash: [0x1000_0000, 4 * MIB], ram: [0x3800_0000, 4 * MIB] };

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(small)");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let machine = match env::var("TARGET")?.split('-').next() {
        Some("thumbv6m") => MICROBIT,
        Some("thumbv8m.main") => MPS2_AN505,
        _ => MPS2,
    };
    if machine.ram[1] < 64 * KIB {
        println!("cargo::rustc-cfg=small");
    }
    let memory = Path::new(&env::var("CARGO_MANIFEST_DIR")?).join("../../../memory.x");
    println!("cargo::rerun-if-changed={}", memory.display());
    let out = env::var("OUT_DIR")?;
    fs::copy(&memory, Path::new(&out).join("memory.x")).map_err(|error| format!("cannot copy {}: {error}", memory.display()))?;
    println!("cargo::rustc-link-search={out}");
    let symbols = [("flash", machine.flash), ("ram", machine.ram)];
    for (name, [origin, length]) in symbols {
        println!("cargo::rustc-link-arg-bins=--defsym=_impromptu_{name}={origin:#x}");
        println!("cargo::rustc-link-arg-bins=--defsym=_impromptu_{name}_length={length:#x}");
    }
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    println!("cargo::rustc-link-arg-bins=--nmagic");
    // A fault ends the emulator, see firmware/board/build.rs.
    println!("cargo::rustc-link-arg-bins=--defsym=HardFault=0");
    Ok(())
}
