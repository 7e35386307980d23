//! Model export: float network to model file, and what a model file says.

use std::process::ExitCode;

use impromptu_model_export::cli;

fn main() -> ExitCode {
    ExitCode::from(cli::run(std::env::args_os(), &mut std::io::stdout().lock(), &mut std::io::stderr().lock()))
}
