//! The emulated board: an STM32F405, as QEMU's `netduinoplus2` (`cargo board`, in the folder of the input).
//!
//! - in: `input.bin` in the folder where the emulator was started, read through semihosting, tick by tick
//! - out: `output.bin` beside it, and one line of JSON on standard output: instructions for each stage, depth of the stack
//! - never: touches clocks or pins. QEMU's RCC reads 0, so waiting for a crystal would never end. The time to read or write a
//!   file is never part of a stage
//!
//! The exit code is 0 on success, 1 on bad input and 101 on a panic; a HardFault aborts the emulator.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod instruments;
#[cfg(target_os = "none")]
mod replay;
#[cfg(target_os = "none")]
mod rotation;

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    match replay::run() {
        Ok(report) => {
            semihosting::println!("{report}");
            semihosting::process::exit(0)
        }
        Err(error) => {
            semihosting::eprintln!("netduinoplus2: {error}");
            semihosting::process::exit(1)
        }
    }
}

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!("this program is for the emulated board; run it with `cargo board`");
    std::process::ExitCode::FAILURE
}
