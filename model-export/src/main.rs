//! Model export: float network to model file, and what a model file says.

use std::process::ExitCode;

use impromptu_model_export::cli;

fn main() -> ExitCode {
    // Without it a temporary file can stay behind, which does no harm.
    let _ = impromptu_files::interruption::clean_up_when_interrupted();
    ExitCode::from(cli::run(std::env::args_os(), &mut std::io::stdout().lock(), &mut std::io::stderr().lock()))
}
