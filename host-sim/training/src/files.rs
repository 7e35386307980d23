//! Files that are written whole or not at all: those of a trained model, and flight logs.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use impromptu_files::{
    name::plain,
    replacement::{replace, replace_all},
};
use impromptu_firmware::features::{Feature, Relative, Source};
use impromptu_model_export::{
    Description, FloatNetwork,
    description::{ChannelDescription, Signals, Tie},
};

use impromptu_sim::{
    columns::TableError,
    flight_log::{FlightLog, LogError},
};

use crate::learn::Learned;

/// Writes a flight log, first beside its place and then into it: a failure leaves what was there.
///
/// # Errors
/// If the file cannot be written.
pub fn write_log(log: &FlightLog, path: &Path) -> Result<(), LogError> {
    let file = path.display().to_string();
    let bytes = log.to_csv(&file)?;
    replace(path, &bytes).map_err(|source| TableError::File { file, source }.into())
}

/// Endings of the files of a model, in the order in which they take their places: the model last.
pub const ENDINGS: [&str; 4] = ["safetensors", "json", "rows.csv", "impromptu"];

/// Writes network, description, calibration rows and model: all of them, or what was there stays. The description says which
/// network and rows it belongs to, so that who reads a set that a power cut has mixed can tell.
///
/// # Errors
/// Names the file that cannot be written.
pub fn write_model_files(
    folder: &Path,
    name: &str,
    learned: &Learned,
    description: &Description,
    model: &[u8],
) -> Result<Vec<PathBuf>> {
    write_set(folder, name, (&learned.exported, &learned.rows.calibration), description, model)
}

/// The same of a network and its calibration rows.
///
/// # Errors
/// As [`write_model_files`].
pub fn write_set(
    folder: &Path,
    name: &str,
    (network, calibration): (&FloatNetwork, &[Vec<f32>]),
    description: &Description,
    model: &[u8],
) -> Result<Vec<PathBuf>> {
    let tie = Tie::of(network, calibration);
    let network = network.to_bytes().context("network")?;
    let rows = rows(calibration, description)?;
    let description = Description { tie: Some(tie), ..description.clone() }.to_json();
    let paths = model_files(folder, name)?;
    let contents: [&[u8]; 4] = [&network, description.as_bytes(), &rows, model];
    replace_all(&paths.iter().zip(contents).collect::<Vec<_>>())?;
    Ok(paths)
}

/// Where the files of a model are, in the order of [`ENDINGS`].
///
/// # Errors
/// If the name is no plain file name.
pub fn model_files(folder: &Path, name: &str) -> Result<Vec<PathBuf>> {
    let name = plain(name)?;
    Ok(ENDINGS.iter().map(|ending| folder.join(format!("{name}.{ending}"))).collect())
}

/// The calibration rows, a column for each feature.
fn rows(calibration: &[Vec<f32>], description: &Description) -> Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(description.features.iter().map(|feature| column(feature, &description.signals)))?;
    for row in calibration {
        writer.write_record(row.iter().map(f32::to_string))?;
    }
    writer.into_inner().context("calibration rows")
}

/// A feature's name, such as `desired.position.x@+5`: what is read, and how many sub-rate ticks from now. What is subtracted
/// follows if it is not the same channel of the same signal now.
fn column(feature: &Feature, signals: &Signals) -> String {
    let named = |channels: &[ChannelDescription], signal: &str, channel: u8| {
        let name = channels.get(usize::from(channel)).map_or("?", |channel| channel.name.as_str());
        format!("{signal}.{name}")
    };
    let desired = |channel| named(&signals.desired, "desired", channel);
    let measured = |channel| named(&signals.measured, "measured", channel);
    let quantity = match feature.source {
        Source::Desired => desired(feature.channel),
        Source::Measured => measured(feature.channel),
        Source::Reference => named(&signals.reference, "reference", feature.channel),
    };
    let origin = match feature.relative {
        Relative::Nothing => String::new(),
        Relative::Desired(channel) if feature.source == Source::Desired && channel == feature.channel => String::new(),
        Relative::Desired(channel) => format!("-{}", desired(channel)),
        Relative::Measured(channel) => format!("-{}", measured(channel)),
    };
    format!("{quantity}@{:+}{origin}", feature.offset)
}

#[cfg(test)]
mod tests {
    use impromptu_flight::quadrotor;

    use super::*;

    #[test]
    fn columns_are_named_after_what_they_hold() {
        let signals = Signals::from(&quadrotor::signals());
        let name = |source, channel, offset, relative| column(&Feature { source, channel, offset, relative }, &signals);
        assert_eq!(name(Source::Desired, 0, 5, Relative::Desired(0)), "desired.position.x@+5");
        assert_eq!(name(Source::Desired, 2, -4, Relative::Measured(2)), "desired.position.z@-4-measured.position.z");
        assert_eq!(name(Source::Reference, 3, -1, Relative::Nothing), "reference.velocity.x@-1");
    }
}
