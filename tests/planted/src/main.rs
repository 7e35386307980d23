//! Each function of `plants` has one thing that flight code must not have. `tests/tests/elf.rs` looks for all of them.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod plants;

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    let result = plants::run(core::hint::black_box(7));
    semihosting::println!("{result}");
    semihosting::process::exit(0)
}

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!("this program is for the emulated board; `cargo test -p impromptu-tests elf` reads it");
    std::process::ExitCode::FAILURE
}
