//! The emulated board: an STM32F405, as QEMU's `netduinoplus2`, flies a recorded flight again.
//!
//! - in: the model file that `IMPROMPTU_MODEL` named when this was built (none: the baseline alone), read in place from flash;
//!   `recording.bin` in the folder where the emulator was started ([`impromptu_flight::replay`]), read record by record
//! - out: `answers.bin` beside it, and one line of JSON on standard output: instructions for each stage, depth of the stack
//! - never: touches clocks or pins. QEMU's RCC reads 0, so waiting for a crystal would never end. The time to read or write a
//!   file is never part of a stage
//!
//! `IMPROMPTU_MODEL=FILE cargo board`, in the folder of the recording; FILE is absolute, or starts at the top of the repository.
//! The exit code is 0 on success, 1 if the model or the recording is refused and 101 on a panic; a HardFault aborts the emulator.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod instruments;
#[cfg(target_os = "none")]
mod replay;
#[cfg(target_os = "none")]
mod report;

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
