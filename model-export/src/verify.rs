//! Float against quantised, over rows.

use std::fmt;

use comfy_table::{Table, presets};
use impromptu_files::text::line;
use impromptu_firmware::model::Model;
use serde::Serialize;

use crate::{batch::Batch, float_network::FloatNetwork};

/// Difference between a float network and a model file over rows of features.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Difference {
    /// Rows compared.
    pub rows: usize,
    /// Root mean square over the rows, for each output, in its unit.
    pub rms: Vec<f64>,
    /// Largest magnitude over the rows, for each output, in its unit.
    pub largest: Vec<f64>,
    /// Root mean square of the float network's own output, for each output, in its unit.
    pub correction_rms: Vec<f64>,
}

/// Runs both over `rows` (features in physical units). A model without a network gives zeros everywhere.
pub fn difference<const C: usize, const O: usize, const A: usize>(
    model: &Model<'_, C, O, A>,
    network: &FloatNetwork,
    rows: &[Vec<f32>],
) -> Difference {
    let zeros = vec![0.0; network.outputs()];
    let mut difference = Difference { rows: rows.len(), rms: zeros.clone(), largest: zeros.clone(), correction_rms: zeros };
    let mut found = vec![0.0f32; rows.len() * network.outputs()];
    if let Some(mut stored) = Batch::of_model(model) {
        stored.evaluate(rows.iter().map(Vec::as_slice), |row, outputs| {
            found[row * network.outputs()..][..network.outputs()].copy_from_slice(outputs);
        });
    }
    Batch::of_network(network).evaluate(rows.iter().map(Vec::as_slice), |row, expected| {
        let found = &found[row * network.outputs()..];
        for (index, (expected, found)) in expected.iter().zip(found).enumerate() {
            let error = f64::from(*expected) - f64::from(*found);
            difference.rms[index] += error * error;
            difference.largest[index] = difference.largest[index].max(error.abs());
            difference.correction_rms[index] += f64::from(*expected).powi(2);
        }
    });
    let count = rows.len().max(1) as f64;
    difference.rms.iter_mut().chain(&mut difference.correction_rms).for_each(|sum| *sum = (*sum / count).sqrt());
    difference
}

/// [`Difference`] of one output, with its name and unit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OutputComparison {
    /// Reference channel.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// RMS difference, in the unit.
    pub rms: f64,
    /// Largest difference, in the unit.
    pub largest: f64,
    /// Largest difference that is possible with features within their ranges in training: the file's bound, in the unit.
    pub bound: f64,
    /// RMS of the float network's correction, in the unit.
    pub correction_rms: f64,
    /// RMS difference in percent of that; none if there is no correction.
    pub rms_percent: Option<f64>,
}

/// [`Difference`] of every output; prints as a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Rows compared.
    pub rows: usize,
    /// In the order of the model's outputs.
    pub outputs: Vec<OutputComparison>,
}

/// Why a model and a float network cannot be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ComparisonError {
    /// The model has no network lane.
    #[error("the model file has a feedback lane only, there is no network to compare")]
    NoNetwork,
    /// They map between other numbers of values.
    #[error("the float network has {found} {what}, the model file {expected}: give the network that the file was made from")]
    Shape {
        /// `inputs` or `outputs`.
        what: &'static str,
        /// The model file's.
        expected: usize,
        /// The float network's.
        found: usize,
    },
}

/// Compares a model file with the float network that it was made from, over rows of features in physical units.
///
/// # Errors
/// If their shapes differ.
pub fn compare<const C: usize, const O: usize, const A: usize>(
    model: &Model<'_, C, O, A>,
    network: &FloatNetwork,
    rows: &[Vec<f32>],
) -> Result<Comparison, ComparisonError> {
    let card = model.card();
    if model.network().is_none() {
        return Err(ComparisonError::NoNetwork);
    }
    let shapes = [("inputs", card.features.len(), network.inputs()), ("outputs", card.outputs.len(), network.outputs())];
    if let Some((what, expected, found)) = shapes.into_iter().find(|(_, expected, found)| expected != found) {
        return Err(ComparisonError::Shape { what, expected, found });
    }
    let difference = difference(model, network, rows);
    let outputs = card.outputs.iter().zip(model.bounds().iter()).enumerate().map(|(index, (output, bounds))| {
        let channel = card.signals.reference.get(usize::from(output.channel));
        let (rms, correction_rms) = (difference.rms[index], difference.correction_rms[index]);
        OutputComparison {
            name: channel.map_or("", |channel| channel.name).into(),
            unit: channel.map_or("", |channel| channel.unit).into(),
            rms,
            largest: difference.largest[index],
            bound: bounds.difference.into(),
            correction_rms,
            rms_percent: (correction_rms > 0.0).then(|| 100.0 * rms / correction_rms),
        }
    });
    Ok(Comparison { rows: rows.len(), outputs: outputs.collect() })
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut table = Table::new();
        table.load_style(presets::NOTHING).set_header([
            "output",
            "unit",
            "correction RMS",
            "difference RMS",
            "largest",
            "bound",
            "RMS %",
        ]);
        for output in &self.outputs {
            table.add_row([
                line(&output.name).into_owned(),
                line(&output.unit).into_owned(),
                format!("{:.4e}", output.correction_rms),
                format!("{:.3e}", output.rms),
                format!("{:.3e}", output.largest),
                format!("{:.3e}", output.bound),
                output.rms_percent.map_or("-".into(), |percent| format!("{percent:.4}")),
            ]);
        }
        write!(f, "{}", table.trim_fmt())
    }
}
