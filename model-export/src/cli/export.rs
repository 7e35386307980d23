//! `model-export export`.

use std::{
    io::Write,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use impromptu_firmware::model::{Model, file};
use serde::Serialize;

use super::{files::beside, format::Format};
use crate::{
    Description, FloatNetwork, Precision, encode,
    replacement::replace,
    rows,
    verify::{Comparison, compare},
};

/// Arguments of `export`.
#[derive(Debug, Args)]
pub(super) struct Export {
    /// Float network (safetensors). Without it, the description's feedback lane alone is exported.
    #[arg(long, value_name = "NET.safetensors", required_unless_present = "description")]
    network: Option<PathBuf>,
    /// Description; NET.json beside the network if not given.
    #[arg(long, value_name = "NET.json")]
    description: Option<PathBuf>,
    /// Rows of features to calibrate int8 or int16 on and to take probes from, a column for each feature in the description's
    /// order and units, below a header; NET.rows.csv beside the network if not given and there.
    #[arg(long, value_name = "ROWS.csv", requires = "network")]
    calibration: Option<PathBuf>,
    /// Number format of the dense layers.
    #[arg(long, value_enum, default_value_t = PrecisionName::Int8)]
    precision: PrecisionName,
    /// Model file to write; an older model there is replaced when all went well.
    #[arg(long, value_name = "FILE")]
    output: PathBuf,
    /// Replace FILE even if it is not a model file.
    #[arg(long)]
    force: bool,
    /// How to print what was written.
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum PrecisionName {
    /// f32 weights and activations.
    Float,
    /// int8 weights with a scale for each row, activations of up to 16 bits.
    Int8,
    /// int16 weights with a scale for each row, activations of up to 16 bits.
    Int16,
}

/// What was written.
#[derive(Debug, Serialize)]
struct Written {
    file: PathBuf,
    bytes: usize,
    crc: String,
    calibration_rows: usize,
    /// Against the float network over the calibration rows.
    comparison: Option<Comparison>,
}

impl Export {
    pub(super) fn run(self, out: &mut dyn Write) -> Result<()> {
        let description_path = match (&self.description, &self.network) {
            (Some(path), _) => path.clone(),
            (None, Some(network)) => beside(network, "json"),
            (None, None) => bail!("give --network or --description"),
        };
        let text = std::fs::read_to_string(&description_path).with_context(|| description_path.display().to_string())?;
        let description = Description::from_json(&text).with_context(|| description_path.display().to_string())?;
        if self.network.is_none() && !description.features.is_empty() {
            bail!("{}: lists `features`, so give the --network that reads them", description_path.display());
        }
        let network = self.network.as_deref().map(FloatNetwork::read).transpose()?;
        let calibration_path = self.calibration.clone().or_else(|| {
            let path = beside(self.network.as_deref()?, "rows.csv");
            path.exists().then_some(path)
        });
        let calibration = match &calibration_path {
            Some(path) => rows::read(path, description.features.len())?,
            None => Vec::new(),
        };
        for input in [Some(&description_path), self.network.as_ref(), calibration_path.as_ref()].into_iter().flatten() {
            if same_file(input, &self.output) {
                bail!("{}: is an input, give another --output", self.output.display());
            }
        }
        self.refuse_foreign()?;
        let precision = match self.precision {
            PrecisionName::Float => Precision::Float,
            PrecisionName::Int8 => Precision::Int8,
            PrecisionName::Int16 => Precision::Int16,
        };
        let bytes = encode(&description, network.as_ref(), precision, &calibration)?;
        let model = Model::from_bytes(&bytes)?;
        let comparison = match &network {
            Some(network) if !calibration.is_empty() => Some(compare(&model, network, &calibration)?),
            _ => None,
        };
        replace(&self.output, &bytes).with_context(|| self.output.display().to_string())?;
        let written = Written {
            file: self.output,
            bytes: bytes.len(),
            crc: format!("{:08x}", model.checksum()),
            calibration_rows: calibration.len(),
            comparison,
        };
        self.format.print(out, &written, || written.text())
    }

    /// A slip such as `--output notes.txt` must not cost the notes.
    fn refuse_foreign(&self) -> Result<()> {
        let is_model = |path: &Path| -> std::io::Result<bool> {
            let mut magic = Vec::new();
            std::io::Read::read_to_end(&mut std::io::Read::take(std::fs::File::open(path)?, 8), &mut magic)?;
            Ok(magic == file::MAGIC)
        };
        let path = &self.output;
        if path.is_dir() {
            bail!("{}: is a folder, give a file", path.display());
        }
        if !self.force && path.exists() && !is_model(path).with_context(|| path.display().to_string())? {
            bail!("{}: exists and is not a model file; give another --output, or --force to replace it", path.display());
        }
        Ok(())
    }
}

fn same_file(one: &Path, other: &Path) -> bool {
    one == other || matches!((one.canonicalize(), other.canonicalize()), (Ok(one), Ok(other)) if one == other)
}

impl Written {
    fn text(&self) -> String {
        let mut text = format!("{}: {} bytes, CRC {}\n", self.file.display(), self.bytes, self.crc);
        if let Some(comparison) = &self.comparison {
            text += &format!("against the float network over {} calibration rows:\n{comparison}\n", self.calibration_rows);
        }
        text
    }
}
