//! The program `host-sim`; everything is in the library's command line.

use std::process::ExitCode;

use impromptu_host_sim::cli;

fn main() -> ExitCode {
    // Without it a temporary file can stay behind, which does no harm.
    let _ = impromptu_files::interruption::clean_up_when_interrupted();
    cli::run(std::env::args_os())
}
