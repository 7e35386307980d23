//! The command line of `host-sim`: the whole demo, or one of its steps on files.
//!
//! *in* arguments, TOML, CSV, JSON and model files; *out* results on stdout, progress and messages on stderr, an exit code;
//! *never* a file that is half written, or one replaced although something failed.

mod collect;
mod configuration;
mod demo;
mod describe;
mod diagnose;
mod doctor;
mod evaluate;
mod fly;
mod learn;
mod learned_file;
mod log_reading;
mod machine;
mod model_file;
mod output;
mod processor;
mod progress;
mod report;
mod shell;
mod situation;
mod study;
mod train;
mod trajectory;

use std::{
    ffi::OsString,
    io::{ErrorKind, Write as _},
    path::{Path, PathBuf},
    process::ExitCode,
};

use anyhow::{Context as _, Result};
use clap::{Args, CommandFactory as _, Parser, Subcommand};
use impromptu_files::{place, text::line};

use self::{configuration::Configuration, output::Format, progress::Console};

/// Exit code: a file was refused or a step failed.
const FAILED: u8 = 1;
/// Exit code: the arguments leave open what is meant, as a file shows.
const WRONG_ARGUMENTS: u8 = 2;

const EXAMPLES: &str = "\
Without a command the whole demo runs: flights, training, quantisation, export, test flights, report.

Results go to stdout, progress and messages to stderr. Exit codes: 0 fine, 1 failed, 2 wrong arguments.
The same seed gives the same bytes, on any number of threads (RAYON_NUM_THREADS=N limits them).

Examples:
  host-sim                                      the demo: table on stdout, report and models in ./out
  host-sim --format json > results.json         the same as one JSON document
  host-sim --seed 7 --config demo.toml --out run7
  host-sim trajectory --list
  host-sim collect --condition lab --flights 20 --out logs
  host-sim collect --condition lab --dither 0.01 --out dithered
  host-sim diagnose --log logs/*.csv
  host-sim describe --log motor.csv --output motor.toml
  host-sim train --loop motor.toml --log motor-*.csv --delay-ms 5 --out models
  host-sim learn --log monday.csv tuesday.csv wednesday.csv
  host-sim train --log logs/*.csv --dithered dithered/*.csv --vehicle crazyflie --out models
  host-sim train --learned own.learned --vehicle crazyflie --name flown --out models
  host-sim fly --model models/model.impromptu --trajectory figure8 --log figure8.csv
  host-sim evaluate --model models/model.impromptu --speed 1,1.7
  host-sim report out/results.json --out again";

#[derive(Debug, Parser)]
#[command(
    name = "host-sim",
    version,
    about = "Simulates a quadrotor, trains the add-on that corrects its loop's references, and flies with it",
    after_help = EXAMPLES
)]
struct Arguments {
    #[command(flatten)]
    global: Global,
    #[command(subcommand)]
    command: Option<Command>,
}

/// Options of every command.
#[derive(Debug, Args)]
#[command(next_help_heading = "Options of every command")]
struct Global {
    /// Settings of the demo as TOML; the other commands use its `seed` and `[recipe]`. Unknown keys are refused.
    #[arg(long, global = true, value_name = "FILE.toml")]
    config: Option<PathBuf>,
    /// Seed of everything random; the configuration's (1) if not given.
    #[arg(long, global = true, value_name = "N")]
    seed: Option<u64>,
    /// Folder for files that are written, made if it is not there [default: out].
    #[arg(long, global = true, value_name = "DIR")]
    out: Option<PathBuf>,
    /// How results are printed on stdout.
    #[arg(long, global = true, value_enum, default_value_t)]
    format: Format,
    /// No progress on stderr, only errors.
    #[arg(long, short, global = true)]
    quiet: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Flies the baseline and writes flight logs to learn from.
    Collect(collect::Collect),
    /// Drafts the description of a loop from the header of a log, for `train --loop`.
    Describe(describe::Describe),
    /// Says of a loop, from its logs or from a test in the simulator, whether an add-on will help, and how much.
    Diagnose(diagnose::Diagnose),
    /// Replays logs of any loop through the learner: predicts what it would have left of each next flight's error.
    Learn(learn::Learn),
    /// Writes logs of a simulated machine that is no quadrotor, or moves it with a model.
    Machine(machine::MachineCommand),
    /// Makes a model from flight logs, simulated or real.
    Train(train::Train),
    /// Flies a trajectory with the baseline and with a model.
    Fly(fly::Fly),
    /// Flies models over unseen strokes, lane by lane.
    Evaluate(evaluate::Evaluate),
    /// Makes the report of stored results again.
    Report(report::Report),
    /// Reproduces the paper row by row.
    Study(study::Study),
    /// Writes a trajectory as CSV, or lists the known ones.
    Trajectory(trajectory::TrajectoryCommand),
    /// Says which tools are installed, which are missing, what for, and how to get them.
    Doctor(doctor::Doctor),
    /// Prints a script with which a shell completes the commands.
    Completions(shell::Completions),
    /// Writes the pages of `man`.
    Manual(shell::Manual),
}

impl Command {
    /// Why the arguments do not go together, if they do not: what clap cannot be told.
    fn conflict(&self) -> Option<String> {
        match self {
            Self::Collect(command) => command.conflict(),
            Self::Train(command) => command.conflict(),
            Self::Fly(command) => command.conflict(),
            Self::Evaluate(command) => command.conflict(),
            Self::Study(command) => command.conflict(),
            _ => None,
        }
    }
}

/// What a command is given beside its own arguments.
struct Invocation {
    configuration: Configuration,
    format: Format,
    console: Console,
    /// The command that repeats the run.
    command: String,
    /// The file of the configuration, if there is one.
    config: Option<PathBuf>,
}

impl Invocation {
    /// Refuses an output that cannot be written, or that is one of the inputs by whatever name. Asked before minutes of work;
    /// a vehicle or condition of the program's own is no file and cannot be one.
    fn check_output<'a>(&'a self, output: &Path, inputs: impl IntoIterator<Item = &'a Path>) -> Result<()> {
        let inputs = inputs.into_iter().chain(self.config.as_deref());
        place::check(output).and_then(|()| place::apart(output, inputs)).with_context(|| output.display().to_string())
    }
}

/// Runs the program; the first of the arguments is its name.
pub fn run<I, T>(arguments: I) -> ExitCode
where
    I: IntoIterator<Item = T>,
    T: Into<OsString> + Clone,
{
    let words: Vec<OsString> = arguments.into_iter().map(Into::into).collect();
    let arguments = match Arguments::try_parse_from(&words) {
        Ok(arguments) => arguments,
        // Prints help and version on stdout with code 0, everything else on stderr with code 2.
        Err(error) => error.exit(),
    };
    if let Some(reason) = arguments.command.as_ref().and_then(Command::conflict) {
        Arguments::command().error(clap::error::ErrorKind::ArgumentConflict, reason).exit();
    }
    let console = Console::new(arguments.global.quiet);
    let outcome = execute(arguments, &console, repeated(&words));
    console.finish();
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        // The reader has seen enough, as in `host-sim trajectory circle | head`.
        Err(error) if error.downcast_ref::<std::io::Error>().is_some_and(|error| error.kind() == ErrorKind::BrokenPipe) => {
            ExitCode::SUCCESS
        }
        Err(error) => {
            // Nothing can be done if even that cannot be written.
            let _ = writeln!(std::io::stderr(), "error: {}", line(&message(&error)));
            ExitCode::from(if log_reading::leaves_open(&error) { WRONG_ARGUMENTS } else { FAILED })
        }
    }
}

/// An error with its causes on one line; a cause that the text before it already says is left out.
fn message(error: &anyhow::Error) -> String {
    error.chain().map(ToString::to_string).fold(String::new(), |text, cause| {
        if text.is_empty() {
            cause
        } else if text.ends_with(&cause) {
            text
        } else {
            format!("{text}: {cause}")
        }
    })
}

/// The command line that repeats the run.
fn repeated(words: &[OsString]) -> String {
    let arguments: Vec<_> = words.iter().skip(1).map(|word| word.to_string_lossy()).collect();
    if arguments.is_empty() { "cargo run --release".into() } else { format!("cargo run --release -- {}", arguments.join(" ")) }
}

fn execute(arguments: Arguments, console: &Console, command: String) -> Result<()> {
    let Global { config, seed, out, format, .. } = arguments.global;
    let configuration = Configuration::load(config.as_deref(), seed, out)?;
    let invocation = Invocation { configuration, format, console: console.clone(), command, config };
    match arguments.command {
        None => demo::run(&invocation),
        Some(Command::Collect(command)) => command.run(&invocation),
        Some(Command::Describe(command)) => command.run(&invocation),
        Some(Command::Diagnose(command)) => command.run(&invocation),
        Some(Command::Learn(command)) => command.run(&invocation),
        Some(Command::Machine(command)) => command.run(&invocation),
        Some(Command::Train(command)) => command.run(&invocation),
        Some(Command::Fly(command)) => command.run(&invocation),
        Some(Command::Evaluate(command)) => command.run(&invocation),
        Some(Command::Report(command)) => command.run(&invocation),
        Some(Command::Study(command)) => command.run(&invocation),
        Some(Command::Trajectory(command)) => command.run(&invocation),
        Some(Command::Doctor(command)) => command.run(&invocation),
        Some(Command::Completions(command)) => command.run(),
        Some(Command::Manual(command)) => command.run(&invocation),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_says_every_cause_once() {
        let cause = || std::io::Error::other("disk full");
        let error = impromptu_sim::flight_log::LogError::from(impromptu_sim::columns::TableError::File {
            file: "a.csv".into(),
            source: cause(),
        });
        assert_eq!(message(&anyhow::Error::new(error).context("--log")), "--log: a.csv: disk full");
        assert_eq!(message(&anyhow::Error::new(cause()).context("b.csv")), "b.csv: disk full");
    }

    #[test]
    fn the_arguments_are_consistent() {
        Arguments::command().debug_assert();
    }
}
