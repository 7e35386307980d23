//! `model-export verify`.

use std::{io::Write, path::PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use impromptu_files::text::line;
use impromptu_firmware::model::LargestModel;
use serde::Serialize;

use super::{
    files::{beside, read, unsigned},
    format::Format,
};
use crate::{
    FloatNetwork, rows,
    signing::{read_public, verify},
    verify::{Comparison, compare},
};

/// Arguments of `verify`.
#[derive(Debug, Args)]
pub(super) struct Verify {
    /// Model file.
    file: PathBuf,
    /// Float network that the file was made from, to compare with.
    #[arg(long, value_name = "NET.safetensors")]
    network: Option<PathBuf>,
    /// Rows of features to compare over, as for `export --calibration`; NET.rows.csv beside the network if not given.
    #[arg(long, value_name = "ROWS.csv", requires = "network")]
    data: Option<PathBuf>,
    /// Fail if the RMS difference of any output is larger, in the output's unit.
    #[arg(long, value_name = "VALUE", requires = "network", value_parser = limit)]
    max_rms: Option<f64>,
    /// Fail if the RMS difference of any output is larger, in percent of the RMS of its correction.
    #[arg(long, value_name = "PERCENT", requires = "network", value_parser = limit)]
    max_rms_percent: Option<f64>,
    /// Fail if the owner of this public key has not signed the model.
    #[arg(long, value_name = "NAME.pub")]
    key: Option<PathBuf>,
    /// How to print the result.
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

fn limit(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|value: &f64| *value >= 0.0).ok_or_else(|| "not a number from 0 upwards".into())
}

/// What was checked.
#[derive(Debug, Serialize)]
struct Verified {
    file: PathBuf,
    crc: String,
    /// Version that the owner of the key has signed; none without a key.
    signed_version: Option<u32>,
    /// Probes of the network lane that gave their bits.
    network_probes: u8,
    /// Axes of the feedback lane whose probe gave its bits.
    feedback_lane_probes: usize,
    comparison: Option<Comparison>,
    /// Every limit that is exceeded.
    failures: Vec<String>,
}

impl Verify {
    /// Whether every check passed.
    pub(super) fn run(self, out: &mut dyn Write, messages: &mut dyn Write) -> Result<bool> {
        let bytes = read(&self.file)?;
        let signed_version = match &self.key {
            Some(path) => {
                let key = read_public(path)?;
                Some(verify(&bytes, &key).with_context(|| self.file.display().to_string())?.version)
            }
            None => None,
        };
        let model = LargestModel::sized(unsigned(&bytes)).with_context(|| self.file.display().to_string())?;
        let comparison = match &self.network {
            Some(path) => {
                let network = FloatNetwork::read(path)?;
                let data = self.data.clone().unwrap_or_else(|| beside(path, "rows.csv"));
                let rows = rows::read(&data, model.card().features.len())?;
                Some(compare(&model, &network, &rows).with_context(|| path.display().to_string())?)
            }
            None => None,
        };
        let failures = comparison.as_ref().map_or_else(Vec::new, |comparison| self.failures(comparison));
        let verified = Verified {
            crc: format!("{:08x}", model.checksum()),
            signed_version,
            network_probes: if model.network().is_some() { model.card().probes.count } else { 0 },
            feedback_lane_probes: model.feedback().map_or(0, |lane| lane.axes().len()),
            comparison,
            failures,
            file: self.file,
        };
        for failure in &verified.failures {
            writeln!(messages, "model-export: {}", line(failure))?;
        }
        self.format.print(out, &verified, || verified.text())?;
        Ok(verified.failures.is_empty())
    }

    fn failures(&self, comparison: &Comparison) -> Vec<String> {
        let mut failures = Vec::new();
        for output in &comparison.outputs {
            let name = &output.name;
            if let Some(limit) = self.max_rms.filter(|limit| output.rms > *limit) {
                failures.push(format!("output {name}: RMS difference {:.3e} {}, --max-rms is {limit}", output.rms, output.unit));
            }
            if let Some(limit) = self.max_rms_percent.filter(|limit| output.rms > 0.01 * limit * output.correction_rms) {
                let found = output.rms_percent.map_or("without a correction".into(), |percent| format!("{percent:.3} %"));
                failures.push(format!("output {name}: RMS difference {found}, --max-rms-percent is {limit}"));
            }
        }
        failures
    }
}

impl Verified {
    fn text(&self) -> String {
        let mut text = format!("{}: loads, CRC {}\n", line(&self.file.display().to_string()), self.crc);
        if let Some(version) = self.signed_version {
            text += &format!("signed by this key as version {version}\n");
        }
        text += &format!(
            "same bits on this machine: {} network probes, {} feedback lane axes\n",
            self.network_probes, self.feedback_lane_probes
        );
        if let Some(comparison) = &self.comparison {
            text += &format!("against the float network over {} rows:\n{comparison}\n", comparison.rows);
        }
        text
    }
}
