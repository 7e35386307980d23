//! The networks that are measured, with inputs and exact outputs.

use std::path::Path;

use anyhow::{Context, Result, anyhow};
use impromptu_firmware::{
    features::{Feature, window},
    model::{Interpolation, Output},
};
use impromptu_flight::quadrotor;
use impromptu_model_export::{
    Description, FloatNetwork,
    description::{Provenance, Timing},
    float_network::{Activation, DenseLayer},
    rows,
};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Rows over which the largest error is taken.
const ERROR_ROWS: usize = 200;
/// Rows from which integer networks take their ranges.
const CALIBRATION_ROWS: usize = 1000;
/// Largest input in the description of a random network; its inputs are normal with deviation 1.
const ENVELOPE: f32 = 5.0;

/// A network and what it is evaluated on.
#[derive(Clone, Debug)]
pub struct Net {
    /// Name in the table.
    pub name: &'static str,
    /// The network.
    pub network: FloatNetwork,
    /// What a model file says beside it.
    pub description: Description,
    /// Rows from which integer networks take their ranges.
    pub calibration: Vec<Vec<f32>>,
    /// Rows of inputs over which the error is taken.
    pub inputs: Vec<Vec<f32>>,
}

impl Net {
    /// All networks, the same in every run.
    ///
    /// # Errors
    /// If the trained model in `tests/models` cannot be read.
    pub fn all() -> Result<Vec<Self>> {
        let relu = [(128, Activation::Relu); 4];
        let tanh = [(20, Activation::Tanh); 2];
        Ok(vec![
            random("12-128x4-6", window(&[0, 1, 2], 1..=4).collect(), &relu, 6),
            random("36-128x4-6", window(&[0, 1, 2], -4..=8).collect(), &relu, 6),
            random("3-20-20-1", window(&[0, 1, 2], 1..=1).collect(), &tanh, 1),
            trained("shipped")?,
        ])
    }

    /// Whether every hidden layer is rectified and nothing but dense layers is there.
    pub fn is_plain_relu(&self) -> bool {
        let hidden = self.network.layers.len().saturating_sub(1);
        self.network.skip.is_none() && self.network.layers.iter().take(hidden).all(|layer| layer.activation == Activation::Relu)
    }

    /// Inputs on which instructions and cycles are counted: typical rows, zeros, and far outside of every range.
    pub fn counted_inputs(&self) -> Vec<Vec<f32>> {
        let count = self.network.inputs();
        let far = (0..count).map(|index| if index % 2 == 0 { 1e4 } else { -1e4 }).collect();
        let typical = self.inputs.iter().take(TYPICAL_ROWS).cloned();
        typical.chain([vec![0.0; count], far]).collect()
    }

    /// The outputs for `inputs` in f64.
    pub fn exact(&self, inputs: &[f32]) -> Vec<f64> {
        let network = &self.network;
        let normalised: Vec<f64> = (inputs.iter().zip(&network.input_mean).zip(&network.input_scale))
            .map(|((input, mean), scale)| (f64::from(*input) - f64::from(*mean)) / f64::from(*scale))
            .collect();
        let mut values = normalised.clone();
        for layer in &network.layers {
            values = dense(&layer.weights, Some(&layer.bias), &values);
            for value in &mut values {
                *value = match layer.activation {
                    Activation::Relu => value.max(0.0),
                    Activation::Tanh => libm::tanh(*value),
                    Activation::Linear => *value,
                };
            }
        }
        if let Some(skip) = &network.skip {
            let linear = dense(skip, None, &normalised);
            values.iter_mut().zip(linear).for_each(|(value, linear)| *value += linear);
        }
        (values.iter().zip(&network.output_mean).zip(&network.output_scale))
            .map(|((value, mean), scale)| f64::from(*mean) + f64::from(*scale) * value)
            .collect()
    }

    /// Largest distance of `found`, the outputs for the first of the inputs, to the exact ones.
    pub fn largest_error(&self, found: &[Vec<f32>]) -> f64 {
        let errors = self.inputs.iter().zip(found).flat_map(|(inputs, found)| {
            let exact = self.exact(inputs);
            found.iter().zip(exact).map(|(found, exact)| (f64::from(*found) - exact).abs()).collect::<Vec<_>>()
        });
        errors.fold(0.0, f64::max)
    }
}

/// Typical rows among the counted inputs.
pub const TYPICAL_ROWS: usize = 4;

fn dense(weights: &[f32], bias: Option<&[f32]>, inputs: &[f64]) -> Vec<f64> {
    let rows = weights.chunks(inputs.len().max(1));
    rows.enumerate()
        .map(|(row, weights)| {
            let bias = bias.and_then(|bias| bias.get(row)).map_or(0.0, |bias| f64::from(*bias));
            weights.iter().zip(inputs).fold(bias, |sum, (weight, input)| sum + f64::from(*weight) * input)
        })
        .collect()
}

/// A network with He's random weights (normal, variance 2 / inputs) and a small bias, without normalisation.
fn random(name: &'static str, features: Vec<Feature>, hidden: &[(usize, Activation)], outputs: usize) -> Net {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(8);
    let inputs = features.len();
    let mut normal = |count: usize, deviation: f32| -> Vec<f32> {
        (0..count).map(|_| deviation * Distribution::<f32>::sample(&StandardNormal, &mut random)).collect()
    };
    let mut width = inputs;
    let layers = hidden.iter().copied().chain([(outputs, Activation::Linear)]).map(|(units, activation)| {
        let weights = normal(units * width, (2.0 / width as f32).sqrt());
        width = units;
        DenseLayer { weights, bias: normal(units, 0.05), activation }
    });
    let network = FloatNetwork {
        layers: layers.collect(),
        input_mean: vec![0.0; inputs],
        input_scale: vec![1.0; inputs],
        skip: None,
        output_mean: vec![0.0; outputs],
        output_scale: vec![1.0; outputs],
        notes: Default::default(),
    };
    let mut rows = |count: usize| (0..count).map(|_| normal(inputs, 1.0)).collect::<Vec<_>>();
    let (calibration, inputs) = (rows(CALIBRATION_ROWS), rows(ERROR_ROWS));
    Net { name, description: describe(name, features, outputs), network, calibration, inputs }
}

fn describe(name: &str, features: Vec<Feature>, outputs: usize) -> Description {
    Description {
        name: name.into(),
        provenance: Provenance { software: "tests".into(), remarks: "random weights".into(), ..Provenance::default() },
        signals: (&quadrotor::signals()).into(),
        timing: Timing {
            reference_rate_hz: 100.0,
            divisor: 10,
            interpolation: Interpolation::Hold,
            measurement_delay_s: 0.0,
            fade_s: 0.5,
        },
        envelope: vec![(-ENVELOPE, ENVELOPE); features.len()],
        features,
        outputs: (0..outputs as u8).map(|channel| Output { channel, limit: 10.0, slew: 1.0 }).collect(),
        feedback_lane: None,
        monitor: None,
        tie: None,
    }
}

/// A model that the demo trained, out of `tests/models`.
fn trained(name: &'static str) -> Result<Net> {
    let path = |extension| Path::new(env!("CARGO_MANIFEST_DIR")).join("models").join(format!("{name}.{extension}"));
    let network = FloatNetwork::read(&path("safetensors"))?;
    let text = path("json");
    let text = std::fs::read_to_string(&text).with_context(|| format!("cannot read {}", text.display()))?;
    let description = Description::from_json(&text).map_err(|error| anyhow!("{name}.json: {error}"))?;
    let rows = rows::read(&path("rows.csv"), description.features.len())?;
    Ok(Net { name, network, description, inputs: rows.clone(), calibration: rows })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_outputs_agree_with_the_float_networks_own() {
        for net in Net::all().unwrap() {
            let found: Vec<Vec<f32>> = net.inputs.iter().map(|inputs| net.network.evaluate(inputs)).collect();
            let error = net.largest_error(&found);
            assert!(error > 0.0 && error < 1e-5, "{}: {error}", net.name);
        }
    }
}
