//! Inputs that go past a network straight to its outputs.
//!
//! *in* a description, a network, rows of calibration; *out* the same with six inputs more; *never* another answer than the
//! network's plus them; *source* the adapter adds a model's output to the desired state: what is to be added to something else,
//! or to nothing, brings the difference itself.

use impromptu_firmware::features::{Feature, Relative, Source};
use impromptu_flight::quadrotor::REFERENCE;
use impromptu_model_export::{Description, FloatNetwork};

/// What goes past the network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bypass {
    /// The desired state, taken away: the network's outputs are whole references.
    Desired,
    /// What is measured less what is desired: the network's outputs are corrections of the measured state.
    Measured,
}

impl Bypass {
    /// The inputs.
    pub fn features(self) -> Vec<Feature> {
        let feature = |channel| match self {
            Self::Desired => Feature { source: Source::Desired, channel, offset: 0, relative: Relative::Nothing },
            Self::Measured => Feature { source: Source::Measured, channel, offset: 0, relative: Relative::Desired(channel) },
        };
        (0..REFERENCE as u8).map(feature).collect()
    }

    /// Their weight on the outputs, in the labels' units.
    fn gain(self) -> f32 {
        match self {
            Self::Desired => -1.0,
            Self::Measured => 1.0,
        }
    }

    /// Description, network and rows of calibration with these inputs, each of which may be as large as the largest output.
    pub fn added(
        self,
        description: &Description,
        network: &FloatNetwork,
        calibration: &[Vec<f32>],
    ) -> (Description, FloatNetwork, Vec<Vec<f32>>) {
        let (mut description, mut calibration) = (description.clone(), calibration.to_vec());
        let limit = description.outputs.iter().map(|output| output.limit).fold(0.0, f32::max);
        description.features.extend(self.features());
        description.envelope.extend([(-limit, limit); REFERENCE]);
        calibration.iter_mut().for_each(|row| row.extend([0.0; REFERENCE]));
        (description, widened(network, self.gain()), calibration)
    }
}

/// The same network with six more inputs which go straight to the outputs with weight `gain`, in the labels' units.
fn widened(network: &FloatNetwork, gain: f32) -> FloatNetwork {
    let (inputs, mut wide) = (network.inputs(), network.clone());
    let widened = |rows: &[f32], extra: &dyn Fn(usize) -> Vec<f32>| -> Vec<f32> {
        rows.chunks(inputs).enumerate().flat_map(|(row, weights)| [weights.to_vec(), extra(row)].concat()).collect()
    };
    wide.input_mean.extend([0.0; REFERENCE]);
    wide.input_scale.extend([1.0; REFERENCE]);
    if let Some(first) = wide.layers.first_mut() {
        first.weights = widened(&first.weights, &|_| vec![0.0; REFERENCE]);
    }
    let skip = network.skip.clone().unwrap_or_else(|| vec![0.0; inputs * REFERENCE]);
    let scale = network.output_scale.clone();
    wide.skip =
        Some(widened(&skip, &|row| (0..REFERENCE).map(|column| if column == row { gain / scale[row] } else { 0.0 }).collect()));
    wide
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bypass_adds_its_inputs_and_changes_nothing_else() {
        let network = FloatNetwork {
            input_mean: vec![1.0, 2.0],
            input_scale: vec![0.5, 3.0],
            layers: Vec::new(),
            skip: Some((0..12).map(|value| value as f32 * 0.1).collect()),
            output_mean: vec![0.3; REFERENCE],
            output_scale: vec![2.0; REFERENCE],
            notes: Default::default(),
        };
        let wide = widened(&network, -1.0);
        let extra = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
        let (narrow, wide) = (network.evaluate(&[0.7, 0.8]), wide.evaluate(&[&[0.7, 0.8][..], &extra].concat()));
        for ((narrow, wide), extra) in narrow.iter().zip(wide).zip(extra) {
            assert!((narrow - extra - wide).abs() < 1e-6);
        }
    }
}
