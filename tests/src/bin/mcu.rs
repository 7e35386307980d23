//! `cargo mcu`: what an evaluation costs on the microcontroller, kernel by kernel and network by network.

use std::process::ExitCode;

use anyhow::{Result, ensure};
use clap::{Parser, ValueEnum};
use impromptu_tests::mcu::{measurement::measure, table};

/// Instructions, modelled cycles, memory and error of neural-network kernels on an emulated STM32F405; instructions on other
/// cores.
///
/// Builds for thumbv7em-none-eabihf and the other cores' targets and runs in qemu-system-arm; a C compiler builds the cycle
/// model. Deterministic.
#[derive(Debug, Parser)]
#[command(name = "cargo mcu", version)]
struct Arguments {
    /// How to print the figures.
    #[arg(long, value_enum, default_value_t = Format::Table)]
    format: Format,
    /// Only this kernel.
    #[arg(long, value_name = "NAME")]
    kernel: Option<String>,
    /// Only this network.
    #[arg(long, value_name = "NAME")]
    net: Option<String>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Format {
    /// For people.
    Table,
    /// An array of rows; those of other cores name the core.
    Json,
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("cargo mcu: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<()> {
    let arguments = Arguments::parse();
    let is = |asked: &Option<String>, name: &str| asked.as_ref().is_none_or(|asked| asked == name);
    let results = measure(|kernel, net| is(&arguments.kernel, kernel) && is(&arguments.net, net))?;
    ensure!(
        !results.rows.is_empty() || !results.left_out.is_empty(),
        "no kernel and network of these names; without them all are run"
    );
    match arguments.format {
        Format::Table => print!("{}", table::text(&results)),
        Format::Json => {
            let others = results.cores.iter().map(serde_json::to_value);
            let rows: Vec<_> = results.rows.iter().map(serde_json::to_value).chain(others).collect::<Result<_, _>>()?;
            println!("{}", serde_json::to_string_pretty(&rows)?);
        }
    }
    Ok(())
}
