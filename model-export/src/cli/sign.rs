//! `model-export keygen` and `model-export sign`.

use std::{io::Write, path::PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use impromptu_files::{place, replacement::replace, text::line};
use impromptu_firmware::model::LargestModel;
use serde::Serialize;

use super::{
    files::{read, refuse_foreign},
    format::Format,
};
use crate::signing::{PrivateKey, hex, public_path};

/// Arguments of `keygen`.
#[derive(Debug, Args)]
pub(super) struct Keygen {
    /// File for the private key, readable by its owner only; the public one is written to NAME.pub. Neither may exist.
    #[arg(value_name = "NAME")]
    name: PathBuf,
    /// How to print what was written.
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

/// What was written.
#[derive(Debug, Serialize)]
struct Keys {
    private: PathBuf,
    public: PathBuf,
    /// The public key, for the application's list.
    key: String,
}

impl Keygen {
    pub(super) fn run(self, out: &mut dyn Write) -> Result<()> {
        let key = PrivateKey::generate()?;
        key.write(&self.name)?;
        let keys = Keys { public: public_path(&self.name), private: self.name, key: hex(&key.public()) };
        self.format.print(out, &keys, || {
            format!(
                "{}: private key; keep it secret, and a copy of it\n{}: public key {}\n",
                keys.private.display(),
                keys.public.display(),
                keys.key
            )
        })
    }
}

/// Arguments of `sign`.
#[derive(Debug, Args)]
pub(super) struct Sign {
    /// Model file that `export` wrote.
    file: PathBuf,
    /// Private key that `keygen` wrote.
    #[arg(long, value_name = "NAME")]
    key: PathBuf,
    /// Version of the model: a vehicle that has stored one takes no lower one afterwards.
    #[arg(long, value_name = "NUMBER")]
    model_version: u32,
    /// Signed model to write; an older model there is replaced when all went well.
    #[arg(long, value_name = "FILE")]
    output: PathBuf,
    /// Replace FILE even if it is not a model file.
    #[arg(long)]
    force: bool,
    /// How to print what was written.
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

/// What was written.
#[derive(Debug, Serialize)]
struct Signed {
    file: PathBuf,
    bytes: usize,
    version: u32,
    /// The public key of who signed.
    key: String,
}

impl Sign {
    pub(super) fn run(self, out: &mut dyn Write) -> Result<()> {
        let key = PrivateKey::read(&self.key)?;
        let bytes = read(&self.file)?;
        let signed = key.sign(&bytes, self.model_version).with_context(|| self.file.display().to_string())?;
        // Nobody shall vouch for a file that no machine flies.
        LargestModel::sized(&bytes).with_context(|| self.file.display().to_string())?;
        place::check(&self.output)
            .and_then(|()| place::apart(&self.output, [&self.file, &self.key]))
            .with_context(|| format!("--output {}", self.output.display()))?;
        refuse_foreign(&self.output, self.force)?;
        replace(&self.output, &signed).with_context(|| self.output.display().to_string())?;
        let signed = Signed { file: self.output, bytes: signed.len(), version: self.model_version, key: hex(&key.public()) };
        self.format.print(out, &signed, || {
            let Signed { file, bytes, version, key } = &signed;
            format!("{}: {bytes} bytes, version {version}, signed by {key}\n", line(&file.display().to_string()))
        })
    }
}
