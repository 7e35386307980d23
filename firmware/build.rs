//! Tells the crate whether the target has the instructions of the fast kernels. Nothing here touches the linker: memory map and
//! start-up code belong to the program.

use std::{env, error::Error};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(armv8m, dsp, fpu)");
    // The stable compiler does not say what a Cortex-M target has; the targets' names do.
    let target = env::var("TARGET")?;
    let (armv7em, armv8m) = (target.starts_with("thumbv7em-"), target.starts_with("thumbv8m.main-"));
    // The DSP extension.
    if armv7em || armv8m && env::var_os("CARGO_FEATURE_DSP").is_some() {
        println!("cargo::rustc-cfg=dsp");
    }
    // An FPU for f32, which is in use if arguments are passed in its registers.
    if (armv7em || armv8m) && env::var("CARGO_CFG_TARGET_ABI").as_deref() == Ok("eabihf") {
        println!("cargo::rustc-cfg=fpu");
    }
    // The assembler concludes the DSP extension from Armv7E-M, but not from this.
    if armv8m {
        println!("cargo::rustc-cfg=armv8m");
    }
    Ok(())
}
