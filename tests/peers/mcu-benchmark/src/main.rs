//! Evaluates one network with one kernel on the emulated STM32F405, between markers that the cycle model counts.
//!
//! - in: networks in flash, embedded when this was built (`IMPROMPTU_MCU_IMAGES`, see `build.rs`); `request.bin` in the folder
//!   where the emulator was started: which kernel, which network, where its weights lie, then rows of inputs (`request.rs`)
//! - out: `answer.bin` beside it: stack pointer of the caller, bytes of working memory, then the outputs of each row
//! - markers: the instruction SEV before and after each evaluation, which does nothing on a single core. No kernel contains it
//!
//! `cargo mcu` builds and starts this, see `tests/src/mcu` on the host.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(all(target_os = "none", peers))]
mod embedded_nn;
#[cfg(target_os = "none")]
mod engine;
#[cfg(target_os = "none")]
mod kernel;
#[cfg(all(target_os = "none", peers))]
mod microflow;
#[cfg(all(target_os = "none", peers))]
mod plain;
#[cfg(all(target_os = "none", peers))]
mod reader;
#[cfg(target_os = "none")]
mod request;

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    match request::run() {
        Ok(()) => semihosting::process::exit(0),
        Err(reason) => {
            semihosting::eprintln!("mcu-benchmark: {reason}");
            semihosting::process::exit(1)
        }
    }
}

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!("this program is for the emulated board; run `cargo mcu`");
    std::process::ExitCode::FAILURE
}
