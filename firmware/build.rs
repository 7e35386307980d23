//! Tells the crate whether the target has the instructions of the fast kernels. Nothing here touches the linker: memory map and start-up
//! code belong to the program.

use std::{env, error::Error};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    // The stable compiler does not tell whether a target has the DSP instructions; of its targets, this one has, and the FPU too.
    println!("cargo::rustc-check-cfg=cfg(cortex_m4)");
    if env::var("TARGET")? == "thumbv7em-none-eabihf" {
        println!("cargo::rustc-cfg=cortex_m4");
    }
    Ok(())
}
