//! `model-export export`.

use std::{
    io::Write,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use impromptu_files::{place, replacement::replace, text::line};
use impromptu_firmware::model::LargestModel;
use serde::Serialize;

use super::{
    ambiguous::Ambiguous,
    files::{beside, read, refuse_foreign},
    format::Format,
};
use crate::{
    Description, FloatNetwork, Precision, encode, rows,
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
    /// Take a description that belongs to another network or does not say to which: shapes alone are checked.
    #[arg(long)]
    untied: bool,
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
    pub(super) fn run(self, out: &mut dyn Write, messages: &mut dyn Write) -> Result<()> {
        let description_path = match (&self.description, &self.network) {
            (Some(path), _) => path.clone(),
            (None, Some(network)) => beside(network, "json"),
            (None, None) => bail!("give --network or --description"),
        };
        let text = String::from_utf8(read(&description_path)?).with_context(|| description_path.display().to_string())?;
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
        let inputs = [Some(&description_path), self.network.as_ref(), calibration_path.as_ref()];
        place::check(&self.output)
            .and_then(|()| place::apart(&self.output, inputs.into_iter().flatten()))
            .with_context(|| format!("--output {}", self.output.display()))?;
        if let Some(network) = &network {
            self.check_tie(&description, &description_path, network, &calibration, messages)?;
        }
        refuse_foreign(&self.output, self.force)?;
        let precision = match self.precision {
            PrecisionName::Float => Precision::Float,
            PrecisionName::Int8 => Precision::Int8,
            PrecisionName::Int16 => Precision::Int16,
        };
        let bytes = encode(&description, network.as_ref(), precision, &calibration)?;
        let model = LargestModel::sized(&bytes)?;
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

    /// Network, description and rows must be of one training: another one's limits, features and scales would fly with them.
    fn check_tie(
        &self,
        description: &Description,
        path: &Path,
        network: &FloatNetwork,
        rows: &[Vec<f32>],
        messages: &mut dyn Write,
    ) -> Result<()> {
        let name = self.network.as_deref().unwrap_or(path).display();
        let path = path.display();
        match description.tie.map(|tie| tie.differs(network, rows)) {
            Some(None) => Ok(()),
            _ if self.untied => {
                let remark =
                    format!("model-export: {path}: not known to belong to {name}, taken with --untied; shapes are checked");
                Ok(writeln!(messages, "{}", line(&remark))?)
            }
            Some(Some(what)) => bail!(
                "{path}: belongs to another training than {name} (the {what} differ): give the files of one training; \
                 `host-sim train` with the same logs, --name and --out writes all of them anew; \
                 --untied if they were changed by hand"
            ),
            None if self.is_beside() => Ok(()),
            None => Err(Ambiguous(format!(
                "{path}: does not say which network it belongs to, and is not the .json beside {name}: give --untied if it \
                 belongs to it, or the description of that network"
            ))
            .into()),
        }
    }

    /// Files of other tools, and older ones, have no tie: the description beside the network, under its name, is its own.
    fn is_beside(&self) -> bool {
        match (&self.description, &self.network) {
            (Some(description), Some(network)) => place::same(description, &beside(network, "json")),
            _ => true,
        }
    }
}

impl Written {
    fn text(&self) -> String {
        let mut text = format!("{}: {} bytes, CRC {}\n", line(&self.file.display().to_string()), self.bytes, self.crc);
        if let Some(comparison) = &self.comparison {
            text += &format!("against the float network over {} calibration rows:\n{comparison}\n", self.calibration_rows);
        }
        text
    }
}
