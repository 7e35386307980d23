//! A data set as the layers see it: normalised, and with what a frozen skip already explains taken off.

use super::dataset::Dataset;
use impromptu_model_export::{batch::padded_matrix::PaddedMatrix, float_network::FloatNetwork};

/// Normalised inputs, targets of the layers and relative row weights.
#[derive(Debug, Clone)]
pub(super) struct StandardisedSet {
    pub(super) inputs: PaddedMatrix,
    pub(super) targets: PaddedMatrix,
    pub(super) row_weights: Vec<f32>,
}

impl StandardisedSet {
    /// Uses the normalisations of `network`; with `take_skip_off`, the targets are what its skip leaves.
    pub(super) fn new(network: &FloatNetwork, data: &Dataset, take_skip_off: bool) -> Self {
        let inputs = PaddedMatrix::from_fn(data.rows(), network.inputs(), |row, column| {
            (data.inputs().row(row)[column] - network.input_mean[column]) / network.input_scale[column]
        });
        let skip = network.skip.as_deref().filter(|_| take_skip_off);
        let targets = PaddedMatrix::from_fn(data.rows(), network.outputs(), |row, column| {
            let label = (data.labels().row(row)[column] - network.output_mean[column]) / network.output_scale[column];
            let linear = skip.map_or(0.0, |skip| {
                let weights = &skip[column * network.inputs()..][..network.inputs()];
                weights.iter().zip(inputs.row(row)).map(|(weight, input)| weight * input).sum::<f32>()
            });
            label - linear
        });
        let row_weights = data.relative_row_weights().iter().map(|weight| *weight as f32).collect();
        Self { inputs, targets, row_weights }
    }

    pub(super) fn rows(&self) -> usize {
        self.row_weights.len()
    }

    /// The power of two that brings the targets' root mean square to between ½ and 1, or 1 if it is larger.
    ///
    /// What a ridge regression leaves is small. Scaled up, the layers learn it at the usual learning rates; a power of two
    /// is undone in the last layer's weights without rounding.
    pub(super) fn gain(&self) -> f32 {
        let squares = self.targets.values.iter().map(|value| f64::from(*value).powi(2)).sum::<f64>();
        let root_mean_square = (squares / (self.rows() * self.targets.columns) as f64).sqrt();
        let mut gain = 1.0f32;
        while root_mean_square > 0.0 && root_mean_square * f64::from(gain) < 0.5 && gain < 1_048_576.0 {
            gain *= 2.0;
        }
        gain
    }

    pub(super) fn multiply_targets(&mut self, gain: f32) {
        self.targets.values.iter_mut().for_each(|value| *value *= gain);
    }
}
