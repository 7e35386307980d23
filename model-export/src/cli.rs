//! The command line: `export`, `inspect`, `verify`, `keygen`, `sign`.
//!
//! *in* arguments; *out* results on stdout, messages on stderr, an exit code; *never* a file that is half written, or a file
//! replaced when something failed.

mod ambiguous;
mod export;
mod files;
mod format;
mod sign;
mod verify;

use std::{
    ffi::OsString,
    io::{ErrorKind, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use clap::{Parser, Subcommand};
use impromptu_files::text::line;
use impromptu_firmware::{
    learning::{Kept, NotKept},
    model::LargestModel,
};

use self::{
    ambiguous::Ambiguous,
    export::Export,
    files::{read, unsigned},
    format::Format,
    sign::{Keygen, Sign},
    verify::Verify,
};
use crate::inspection::{Inspection, LearnedInspection};

/// Exit code: all is well.
pub const FINE: u8 = 0;
/// Exit code: a file was refused or a check failed.
pub const FAILED: u8 = 1;
/// Exit code: the arguments make no sense.
pub const USAGE: u8 = 2;

const EXAMPLES: &str = "\
Exit codes: 0 fine, 1 a file was refused or a check failed, 2 wrong arguments, or an option is needed that settles something.

Examples:
  model-export export --network out/net.safetensors --output out/net.model
      finds out/net.json and out/net.rows.csv beside the network
  model-export export --network net.safetensors --precision float --output net.model
  model-export inspect net.model
  model-export inspect net.model --format json
  model-export verify net.model
  model-export verify net.model --network net.safetensors --data flights.csv --max-rms-percent 1
  model-export keygen fleet.key
      writes the private key, and fleet.key.pub for the vehicles
  model-export sign net.model --key fleet.key --model-version 3 --output net.signed.model
  model-export verify net.signed.model --key fleet.key.pub";

#[derive(Debug, Parser)]
#[command(
    name = "model-export",
    version,
    about = "Float network to calibrated, quantised, checked and self-describing model file",
    after_help = EXAMPLES
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Writes a model file from a float network and its description.
    Export(Export),
    /// Prints what a model file, or what was learned in flight and kept, says of itself.
    Inspect {
        /// Model file, or kept state of a learner.
        file: PathBuf,
        /// How to print it.
        #[arg(long, value_enum, default_value_t)]
        format: Format,
    },
    /// Re-runs a model file's probes, and compares it with the float network over rows of features.
    Verify(Verify),
    /// Makes a key with which models are signed.
    Keygen(Keygen),
    /// Signs a model file for vehicles that store signed models only.
    Sign(Sign),
}

/// Runs the program on `arguments` (the first of them is its name). Returns the exit code.
pub fn run<I, T>(arguments: I, out: &mut dyn Write, messages: &mut dyn Write) -> u8
where
    I: IntoIterator<Item = T>,
    T: Into<OsString> + Clone,
{
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            // Help and version are results, everything else is a message. Nothing can be done if even that cannot be written.
            let text = error.render();
            let _ = if error.use_stderr() { write!(messages, "{text}") } else { write!(out, "{text}") };
            return if error.use_stderr() { USAGE } else { FINE };
        }
    };
    let outcome = match arguments.command {
        Command::Export(export) => export.run(out, messages).map(|()| true),
        Command::Inspect { file, format } => inspect(&file, format, out).map(|()| true),
        Command::Verify(verify) => verify.run(out, messages),
        Command::Keygen(keygen) => keygen.run(out).map(|()| true),
        Command::Sign(sign) => sign.run(out).map(|()| true),
    };
    match outcome {
        Ok(true) => FINE,
        Ok(false) => FAILED,
        // The reader has seen enough, `inspect … | head`.
        Err(error) if error.downcast_ref::<std::io::Error>().is_some_and(|error| error.kind() == ErrorKind::BrokenPipe) => FINE,
        Err(error) => {
            let _ = writeln!(messages, "model-export: {}", line(&format!("{error:#}")));
            if error.is::<Ambiguous>() { USAGE } else { FAILED }
        }
    }
}

fn inspect(file: &Path, format: Format, out: &mut dyn Write) -> Result<()> {
    let bytes = read(file)?;
    match Kept::read(&bytes) {
        Ok(kept) => {
            let inspection = LearnedInspection::new(&kept);
            return format.print(out, &inspection, || inspection.to_string());
        }
        // No file of this kind: a model, or nothing.
        Err(NotKept::Nothing) => {}
        Err(reason) => return Err(reason).with_context(|| file.display().to_string()),
    }
    let bytes = unsigned(&bytes);
    let model = LargestModel::sized(bytes).with_context(|| file.display().to_string())?;
    let inspection = Inspection::new(&model, bytes);
    format.print(out, &inspection, || inspection.to_string())
}
