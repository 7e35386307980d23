//! `host-sim completions` and `host-sim manual`: what a shell and `man` want to know of the commands.

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, CommandFactory as _};
use clap_complete::Shell;

use super::{Arguments, Invocation, output};

/// Arguments of `completions`.
#[derive(Debug, Args)]
#[command(after_help = "\
Prints a script that completes commands and options.

Examples:
  host-sim completions bash
  host-sim completions bash > ~/.local/share/bash-completion/completions/host-sim
  host-sim completions zsh > ~/.zfunc/_host-sim
  host-sim completions fish > ~/.config/fish/completions/host-sim.fish")]
pub(super) struct Completions {
    /// The shell that shall complete.
    shell: Shell,
}

impl Completions {
    pub(super) fn run(self) -> Result<()> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Arguments::command(), "host-sim", &mut script);
        output::print(&String::from_utf8(script)?)
    }
}

/// Arguments of `manual`.
#[derive(Debug, Args)]
#[command(after_help = "\
Writes a page of `man` for the program and one for each of its commands into the folder of --out.

Examples:
  host-sim manual --out manual
  man manual/host-sim-fly.1")]
pub(super) struct Manual {}

impl Manual {
    pub(super) fn run(self, invocation: &Invocation) -> Result<()> {
        let folder = invocation.configuration.folder()?;
        let mut root = Arguments::command();
        root.build();
        let mut pages = Vec::new();
        page(&root, "host-sim", &mut pages)?;
        let pages: Vec<(PathBuf, Vec<u8>)> = pages.into_iter().map(|(name, bytes)| (folder.join(name + ".1"), bytes)).collect();
        let files: Vec<_> = pages.iter().map(|(path, bytes)| (path.as_path(), bytes.as_slice())).collect();
        output::write_all(&files)?;
        invocation.console.note(&format!("{} pages written: {}", files.len(), folder.display()));
        Ok(())
    }
}

/// The pages of a command and of those below it, each with its name.
fn page(command: &clap::Command, name: &str, pages: &mut Vec<(String, Vec<u8>)>) -> Result<()> {
    let mut bytes = Vec::new();
    clap_mangen::Man::new(command.clone().display_name(name.to_owned())).title(name.to_uppercase()).render(&mut bytes)?;
    pages.push((name.to_owned(), bytes));
    for below in command.get_subcommands().filter(|below| below.get_name() != "help") {
        page(below, &format!("{name}-{}", below.get_name()), pages)?;
    }
    Ok(())
}
