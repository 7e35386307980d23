//! Float against quantised, over rows.

use impromptu_firmware::{
    model::{MAX_OUTPUTS, Model},
    network::Scratch,
};

use crate::float_network::FloatNetwork;

/// Difference between a float network and a model file over rows of features.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Difference {
    /// Rows compared.
    pub rows: usize,
    /// Root mean square over the rows, for each output, in its unit.
    pub rms: Vec<f64>,
    /// Largest magnitude over the rows, for each output, in its unit.
    pub largest: Vec<f64>,
}

/// Runs both over `rows` (features in physical units).
pub fn difference(model: &Model<'_>, network: &FloatNetwork, rows: &[Vec<f32>]) -> Difference {
    let outputs = network.outputs();
    let mut difference = Difference { rows: rows.len(), rms: vec![0.0; outputs], largest: vec![0.0; outputs] };
    let Some(quantised) = model.network() else { return difference };
    let mut scratch = Scratch::new();
    for row in rows {
        let mut found = [0.0; MAX_OUTPUTS];
        quantised.evaluate(row, &mut found, &mut scratch);
        for (index, (expected, found)) in network.evaluate(row).iter().zip(found).enumerate() {
            let error = f64::from(*expected) - f64::from(found);
            difference.rms[index] += error * error;
            difference.largest[index] = difference.largest[index].max(error.abs());
        }
    }
    let count = rows.len().max(1) as f64;
    difference.rms.iter_mut().for_each(|sum| *sum = (*sum / count).sqrt());
    difference
}
