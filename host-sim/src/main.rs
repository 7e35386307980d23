//! The program `host-sim`; everything is in the library's command line.

use std::process::ExitCode;

use impromptu_host_sim::cli;

fn main() -> ExitCode {
    cli::run(std::env::args_os())
}
