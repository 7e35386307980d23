//! From logs to a model file, for any list of inputs and any reference point.
//!
//! *in* a recipe, logs of the baseline; *out* a network and its ridge regression, and model files of them; *never* another feature function,
//! kernel or adapter than the firmware's; *source* Zhou 2017, section III-A and Insight 3. What is trained does not depend on whether y_d or y
//! is the reference point: in the training data they are the same. Only in flight they differ.

use impromptu_firmware::{
    adapter::Lanes,
    features::{Feature, Relative, Source},
    model::{Interpolation, Model},
};
use impromptu_flight::quadrotor::REFERENCE;
use impromptu_model_export::{ExportError, FloatNetwork, Precision, encode};
use impromptu_sim::{
    flight_log::FlightLog,
    flights::{Loop, reduction},
    rollout::FlightPlan,
    trajectory::Trajectory,
};
use impromptu_training::{
    Recipe, Rows, describe,
    examples::{ExampleSettings, examples},
    feedforward, smoothing,
    supervised::{Dataset, Ridge, RowMatrix, train},
};

use super::inputs::Origin;

/// The network lane alone.
pub const NETWORK: Lanes = Lanes { network: true, feedback: false };
/// Largest correction of a study's model: none that it would ever ask for in order, m and m/s.
const LIMIT: f32 = 20.0;

/// What was learned.
#[derive(Clone, Debug)]
pub struct Learned {
    /// How.
    pub recipe: Recipe,
    /// Whether corrections (difference learning) or whole references were learned.
    pub difference: bool,
    /// Linear map on the same inputs.
    pub ridge: FloatNetwork,
    /// Network.
    pub network: FloatNetwork,
    rows: Rows,
    /// Coefficient of determination of the network on the flights kept from it, over the position labels.
    pub determination: f64,
}

/// Desired channel as it is, at this tick.
fn now(channel: u8) -> Feature {
    Feature { source: Source::Desired, channel, offset: 0, relative: Relative::Nothing }
}

/// Rows whose labels are whole references: the last six inputs are the outputs that the labels were differences to.
fn absolute(data: &Dataset) -> anyhow::Result<Dataset> {
    let inputs = data.inputs().columns() - REFERENCE;
    let (mut without, mut labels) = (RowMatrix::new(inputs), RowMatrix::new(REFERENCE));
    for (input, label) in data.inputs().iter().zip(data.labels().iter()) {
        without.push(&input[..inputs]);
        let whole: Vec<f32> = label.iter().zip(&input[inputs..]).map(|(label, base)| label + base).collect();
        labels.push(&whole);
    }
    Ok(Dataset::new(without, labels)?)
}

/// Learns from logs; every fourth is kept to choose the epoch.
///
/// # Errors
/// If the logs hold too little.
pub fn learn(recipe: &Recipe, closed_loop: &Loop, logs: &[FlightLog], difference: bool) -> anyhow::Result<Learned> {
    let settings = ExampleSettings {
        measurement_delay_s: closed_loop.condition.measurement_delay_s,
        smoothing_s: smoothing(recipe, closed_loop),
        divisor: recipe.divisor,
        stride: recipe.stride,
    };
    let mut features = recipe.features();
    if !difference {
        features.extend((0..REFERENCE as u8).map(now));
    }
    let held = |index: usize| if logs.len() < 4 { index + 1 == logs.len() } else { index % 4 == 3 };
    let rows = |kept: bool| -> anyhow::Result<Dataset> {
        let logs: Vec<&FlightLog> =
            logs.iter().enumerate().filter(|(index, _)| held(*index) == kept).map(|(_, log)| log).collect();
        let data = examples(&logs, &features, &settings)?;
        if difference { Ok(data) } else { absolute(&data) }
    };
    let (training, validation) = (rows(false)?, rows(true)?);
    let network = train(&recipe.network, &training, &validation, &mut |_| {})?.network;
    Ok(Learned {
        recipe: recipe.clone(),
        difference,
        ridge: Ridge::fit(&training, recipe.ridge_penalty)?.to_network(),
        determination: determination(&network, &validation),
        network,
        rows: Rows::of(&training),
    })
}

/// R² over the position labels.
fn determination(network: &FloatNetwork, data: &Dataset) -> f64 {
    let (mut left, mut sum, mut squares) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    for (input, label) in data.inputs().iter().zip(data.labels().iter()) {
        let found = network.evaluate(input);
        for axis in 0..3 {
            let label = f64::from(label[axis]);
            left[axis] += (f64::from(found[axis]) - label).powi(2);
            sum[axis] += label;
            squares[axis] += label * label;
        }
    }
    let rows = data.rows() as f64;
    let total: f64 = (0..3).map(|axis| squares[axis] - sum[axis] * sum[axis] / rows).sum();
    1.0 - left.iter().sum::<f64>() / total
}

/// The same network with six more inputs which go straight to the outputs with weight `gain`, in the labels' units.
fn with_bypass(network: &FloatNetwork, gain: f32) -> FloatNetwork {
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

impl Learned {
    /// A model file of one of the two maps, flown with differences of inputs as `inputs` has them and its output added to `base`.
    ///
    /// # Errors
    /// If it cannot be encoded.
    pub fn file(
        &self,
        closed_loop: &Loop,
        network: &FloatNetwork,
        inputs: &[Feature],
        base: Origin,
    ) -> Result<Vec<u8>, ExportError> {
        let mut description = describe(&self.recipe, closed_loop, &self.rows, None, "study", "", self.recipe.network.seed);
        description.features = inputs.to_vec();
        for output in &mut description.outputs {
            (output.limit, output.slew) = (LIMIT, 2.0 * LIMIT);
        }
        let mut calibration = self.rows.calibration.clone();
        // The adapter adds to the desired state: what is added to the measured one, or to nothing, brings the difference itself.
        let extra: Option<(Vec<Feature>, f32)> = match (base, self.difference) {
            (_, false) => Some(((0..REFERENCE as u8).map(now).collect(), -1.0)),
            (Origin::Measured, true) => Some((
                (0..REFERENCE as u8)
                    .map(|channel| Feature { source: Source::Measured, channel, offset: 0, relative: Relative::Desired(channel) })
                    .collect(),
                1.0,
            )),
            _ => None,
        };
        let Some((features, gain)) = extra else {
            return encode(&description, Some(network), Precision::Float, &calibration);
        };
        description.features.extend(features);
        description.envelope.extend([(-LIMIT, LIMIT); REFERENCE]);
        calibration.iter_mut().for_each(|row| row.extend([0.0; REFERENCE]));
        encode(&description, Some(&with_bypass(network, gain)), Precision::Float, &calibration)
    }

    /// The same, held or ramped between sub-rate ticks.
    #[must_use]
    pub fn at(&self, interpolation: Interpolation) -> Self {
        Self { recipe: Recipe { interpolation, ..self.recipe.clone() }, ..self.clone() }
    }

    /// The network's file as it was trained.
    ///
    /// # Errors
    /// If it cannot be encoded.
    pub fn network_file(&self, closed_loop: &Loop) -> Result<Vec<u8>, ExportError> {
        self.file(closed_loop, &self.network, &self.recipe.features(), Origin::Desired)
    }

    /// p_r = p_d + a_d / kp, without anything learned, for the same loop.
    ///
    /// # Errors
    /// If it cannot be encoded.
    pub fn feedforward_file(&self, closed_loop: &Loop) -> Result<Vec<u8>, ExportError> {
        let description = describe(&self.recipe, closed_loop, &self.rows, None, "feedforward", "", self.recipe.network.seed);
        feedforward(&closed_loop.settings, description)
    }

    /// The ridge regression's.
    ///
    /// # Errors
    /// If it cannot be encoded.
    pub fn ridge_file(&self, closed_loop: &Loop) -> Result<Vec<u8>, ExportError> {
        self.file(closed_loop, &self.ridge, &self.recipe.features(), Origin::Desired)
    }
}

/// Flights over trajectories with or without the baseline's errors to compare with.
#[derive(Clone, Debug)]
pub struct Course {
    /// What is flown.
    pub trajectories: Vec<Trajectory>,
    /// Seed of the first flight.
    pub seed: u64,
    /// RMS errors of the baseline, m.
    pub baseline: Vec<f64>,
}

impl Course {
    /// Flies the baseline.
    ///
    /// # Errors
    /// If it cannot be flown.
    pub fn new(closed_loop: &Loop, trajectories: Vec<Trajectory>, seed: u64) -> anyhow::Result<Self> {
        let baseline = closed_loop.errors(&trajectories, None, 1.0, seed)?;
        Ok(Self { trajectories, seed, baseline })
    }

    /// RMS errors with a model file, m.
    ///
    /// # Errors
    /// If the file is refused.
    pub fn errors(&self, closed_loop: &Loop, file: &[u8], lanes: Lanes) -> anyhow::Result<Vec<f64>> {
        let model = Model::from_bytes(file).map_err(ExportError::Refused)?;
        Ok(closed_loop.unguarded().errors(&self.trajectories, Some((&model, lanes)), 1.0, self.seed)?)
    }

    /// Reduction of each flight, per cent.
    pub fn reductions(&self, errors: &[f64]) -> Vec<f64> {
        self.baseline.iter().zip(errors).map(|(baseline, error)| 100.0 * (1.0 - error / baseline)).collect()
    }

    /// Mean and worst reduction, per cent.
    ///
    /// # Errors
    /// If the file is refused.
    pub fn reduction(&self, closed_loop: &Loop, file: &[u8]) -> anyhow::Result<(f64, f64)> {
        Ok(reduction(&self.baseline, &self.errors(closed_loop, file, NETWORK)?))
    }

    /// Logs of the flights with a model file, or of the baseline.
    ///
    /// # Errors
    /// If the file is refused.
    pub fn logs(&self, closed_loop: &Loop, file: Option<&[u8]>) -> anyhow::Result<Vec<FlightLog>> {
        let model = file.map(Model::from_bytes).transpose().map_err(ExportError::Refused)?;
        let plans: Vec<FlightPlan<'_>> = self
            .trajectories
            .iter()
            .zip(self.seed..)
            .map(|(trajectory, seed)| FlightPlan {
                model: model.as_ref().map(|model| (model, NETWORK)),
                guard: closed_loop.unguarded().guard,
                log: true,
                ..FlightPlan::new(trajectory, seed)
            })
            .collect();
        Ok(closed_loop.fly(&plans)?.into_iter().filter_map(|record| record.log).collect())
    }
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
        let wide = with_bypass(&network, -1.0);
        let extra = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
        let (narrow, wide) = (network.evaluate(&[0.7, 0.8]), wide.evaluate(&[&[0.7, 0.8][..], &extra].concat()));
        for ((narrow, wide), extra) in narrow.iter().zip(wide).zip(extra) {
            assert!((narrow - extra - wide).abs() < 1e-6);
        }
    }
}
