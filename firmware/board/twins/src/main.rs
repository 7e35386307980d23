//! Runs cases ([`impromptu_twins`]) on an emulated board or in a WebAssembly interpreter.
//!
//! - in, on a board: `cases.bin` in the folder where the emulator was started; out: `outputs.bin` beside it and one line of JSON
//!   that counts. The exit code is 0 if every case was run, 1 if not; a HardFault aborts the emulator
//! - in and out, in WebAssembly: the `letterbox`
//!
//! Which machine: `build.rs` and `tests/src/cores.rs`, which builds and starts this.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod board;
#[cfg(target_family = "wasm")]
mod letterbox;

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    match board::run() {
        Ok(counts) => {
            semihosting::println!("{counts}");
            semihosting::process::exit(0)
        }
        Err(reason) => {
            semihosting::eprintln!("twins: {reason}");
            semihosting::process::exit(1)
        }
    }
}

#[cfg(target_family = "wasm")]
fn main() {
    letterbox::run();
}

#[cfg(not(any(target_os = "none", target_family = "wasm")))]
fn main() -> std::process::ExitCode {
    eprintln!("this program is for emulated machines; `cargo test -p impromptu-tests twins` runs it");
    std::process::ExitCode::FAILURE
}
