//! Runs the network kernels on the emulated board, beside their portable twin.
//!
//! - in: `cases.bin` in the folder where the emulator was started: layers with weights and inputs (laid out in `case.rs`)
//! - out: `outputs.bin` beside it: for each case the words that the assembly gave; and one line that counts the cases in which the twin,
//!   compiled for the same processor, gave others, and those whose stream was not aligned, which the twin alone can run
//! - never: judges by itself whether the outputs are right; the host does, with its own twin
//!
//! The exit code is 0 if every case was run, 1 if the file cannot be read.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod case;

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    match case::run() {
        Ok(counts) => {
            semihosting::println!("{counts}");
            semihosting::process::exit(0)
        }
        Err(error) => {
            semihosting::eprintln!("kernels: {error}");
            semihosting::process::exit(1)
        }
    }
}

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!("this program is for the emulated board; `cargo test -p impromptu-tests kernels` runs it");
    std::process::ExitCode::FAILURE
}
