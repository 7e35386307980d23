//! The float network: what training produces and what quantisation starts from.
//!
//! In normalised quantities the network is a stack of dense layers beside an optional linear map from the inputs
//! straight to the outputs (the *skip*; a closed-form ridge regression is the network with a skip and no layers):
//!
//! ```text
//! n = (x - input_mean) / input_scale
//! h = layer_k(… layer_0(n))            layer(v) = activation(weights · v + bias)
//! y = output_mean + output_scale * (h + skip · n)
//! ```
//!
//! Units are those of the inputs and outputs; everything between the two normalisations has none.

mod file;
mod names;

pub use file::{FORMAT_NAME, FORMAT_VERSION, FloatNetworkFileError};

use std::collections::BTreeMap;

use self::names::{is_reserved, layer_bias_name, layer_weight_name};

/// The nonlinearity that a dense layer applies to each of its outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Activation {
    /// max(0, v)
    Relu,
    /// tanh(v)
    Tanh,
    /// v; the usual choice for the last layer
    Linear,
}

impl Activation {
    /// The name in files: `relu`, `tanh` or `linear`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Relu => "relu",
            Self::Tanh => "tanh",
            Self::Linear => "linear",
        }
    }

    /// The activation of that name, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Relu, Self::Tanh, Self::Linear].into_iter().find(|activation| activation.name() == name)
    }

    /// The activation of one number. tanh is libm's, so that all machines agree.
    pub fn apply(self, value: f32) -> f32 {
        match self {
            Self::Relu => value.max(0.0),
            Self::Tanh => libm::tanhf(value),
            Self::Linear => value,
        }
    }
}

/// One dense layer: `activation(weights · input + bias)`.
#[derive(Debug, Clone, PartialEq)]
pub struct DenseLayer {
    /// Row-major `[outputs][inputs]`.
    pub weights: Vec<f32>,
    /// One for each output.
    pub bias: Vec<f32>,
    /// Applied to each output.
    pub activation: Activation,
}

impl DenseLayer {
    /// How many values the layer gives.
    pub fn outputs(&self) -> usize {
        self.bias.len()
    }

    /// The layer's outputs for one set of inputs.
    pub fn evaluate(&self, inputs: &[f32]) -> Vec<f32> {
        let mut values = matrix_times_vector(&self.weights, inputs, self.bias.clone());
        values.iter_mut().for_each(|value| *value = self.activation.apply(*value));
        values
    }
}

/// A float network with its normalisations; see the module's equations.
///
/// The fields are public so that any tool can build one; [`FloatNetwork::check`] says whether they fit together, and
/// files are only written from and read into networks which do.
#[derive(Debug, Clone, PartialEq)]
pub struct FloatNetwork {
    /// Subtracted from each input, in the input's unit.
    pub input_mean: Vec<f32>,
    /// Divides each input, positive, in the input's unit.
    pub input_scale: Vec<f32>,
    /// From the input to the output side; empty for a purely linear map.
    pub layers: Vec<DenseLayer>,
    /// Row-major `[outputs][inputs]`, from normalised inputs to normalised outputs.
    pub skip: Option<Vec<f32>>,
    /// Added to each output, in the output's unit.
    pub output_mean: Vec<f32>,
    /// Multiplies each output, positive, in the output's unit.
    pub output_scale: Vec<f32>,
    /// Free entries for the file's metadata, such as where the training data came from. Never interpreted; keys
    /// which the format uses itself (`format`, `version`, `layers`, `layer.*`) are refused.
    pub notes: BTreeMap<String, String>,
}

/// Why the parts of a [`FloatNetwork`] do not fit together.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FloatNetworkError {
    /// A tensor has another length than its neighbours ask for.
    #[error("tensor `{tensor}` has {found} values; {expected} are needed ({reason})")]
    Shape {
        /// The tensor's name in files.
        tensor: String,
        /// Its length.
        found: usize,
        /// The length that fits.
        expected: usize,
        /// What decides the length.
        reason: String,
    },
    /// A NaN or an infinity.
    #[error("tensor `{tensor}` is not finite at index {index}; training diverged or the file is damaged")]
    NotFinite {
        /// The tensor's name in files.
        tensor: String,
        /// Position of the first such value.
        index: usize,
    },
    /// A scale which is not greater than zero.
    #[error("tensor `{tensor}` must be positive at index {index}; use 1 for a constant signal")]
    ScaleNotPositive {
        /// The tensor's name in files.
        tensor: String,
        /// Position of the first such value.
        index: usize,
    },
    /// Nothing leads from the inputs to the outputs.
    #[error("the network has {what}; it needs at least one input, one output, and a layer or a skip")]
    Empty {
        /// What is missing.
        what: &'static str,
    },
    /// A note under a name which the format keeps for itself.
    #[error("the note `{key}` has a name which the format uses itself; choose another")]
    ReservedNote {
        /// The note's name.
        key: String,
    },
}

impl FloatNetwork {
    /// The number of inputs.
    pub fn inputs(&self) -> usize {
        self.input_mean.len()
    }

    /// The number of outputs.
    pub fn outputs(&self) -> usize {
        self.output_mean.len()
    }

    /// The outputs for one set of inputs: the module's equations, written plainly, in f32.
    ///
    /// `inputs` holds [`FloatNetwork::inputs`] values; what is missing counts as zero after normalisation.
    pub fn evaluate(&self, inputs: &[f32]) -> Vec<f32> {
        let normalised: Vec<f32> = inputs
            .iter()
            .zip(self.input_mean.iter().zip(&self.input_scale))
            .map(|(x, (mean, scale))| (x - mean) / scale)
            .collect();
        let mut output = vec![0.0; self.outputs()];
        if !self.layers.is_empty() {
            let mut values = normalised.clone();
            for layer in &self.layers {
                values = layer.evaluate(&values);
            }
            output = values;
        }
        if let Some(skip) = &self.skip {
            output = matrix_times_vector(skip, &normalised, output);
        }
        output.iter().zip(self.output_mean.iter().zip(&self.output_scale)).map(|(y, (mean, scale))| mean + scale * y).collect()
    }

    /// Whether all parts fit together: shapes chain, numbers are finite, scales positive.
    pub fn check(&self) -> Result<(), FloatNetworkError> {
        let (inputs, outputs) = (self.inputs(), self.outputs());
        for (missing, what) in [
            (inputs == 0, "no inputs"),
            (outputs == 0, "no outputs"),
            (self.layers.is_empty() && self.skip.is_none(), "neither layers nor a skip"),
        ] {
            if missing {
                return Err(FloatNetworkError::Empty { what });
            }
        }
        check_length("input.scale", &self.input_scale, inputs, "as long as `input.mean`")?;
        check_length("output.scale", &self.output_scale, outputs, "as long as `output.mean`")?;
        let mut width = inputs;
        for (index, layer) in self.layers.iter().enumerate() {
            let (weight, bias) = (layer_weight_name(index), layer_bias_name(index));
            if layer.outputs() == 0 {
                return Err(FloatNetworkError::Empty { what: "a layer without outputs" });
            }
            if index + 1 == self.layers.len() {
                check_length(&bias, &layer.bias, outputs, "the last layer gives the network's outputs")?;
            }
            let expected = width.saturating_mul(layer.outputs());
            check_length(&weight, &layer.weights, expected, "outputs of this layer times those of the one before")?;
            check_finite(&weight, &layer.weights)?;
            check_finite(&bias, &layer.bias)?;
            width = layer.outputs();
        }
        if let Some(skip) = &self.skip {
            check_length("skip.weight", skip, inputs.saturating_mul(outputs), "outputs times inputs")?;
            check_finite("skip.weight", skip)?;
        }
        check_finite("input.mean", &self.input_mean)?;
        check_finite("output.mean", &self.output_mean)?;
        check_scale("input.scale", &self.input_scale)?;
        check_scale("output.scale", &self.output_scale)?;
        match self.notes.keys().find(|key| is_reserved(key)) {
            Some(key) => Err(FloatNetworkError::ReservedNote { key: key.clone() }),
            None => Ok(()),
        }
    }
}

/// `start + matrix · vector`, the matrix row-major with one row for each value of `start`.
fn matrix_times_vector(matrix: &[f32], vector: &[f32], mut start: Vec<f32>) -> Vec<f32> {
    if !vector.is_empty() {
        for (sum, row) in start.iter_mut().zip(matrix.chunks_exact(vector.len())) {
            for (weight, value) in row.iter().zip(vector) {
                *sum += weight * value;
            }
        }
    }
    start
}

fn check_length(tensor: &str, values: &[f32], expected: usize, reason: &str) -> Result<(), FloatNetworkError> {
    if values.len() == expected {
        return Ok(());
    }
    Err(FloatNetworkError::Shape { tensor: tensor.into(), found: values.len(), expected, reason: reason.into() })
}

fn check_finite(tensor: &str, values: &[f32]) -> Result<(), FloatNetworkError> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(FloatNetworkError::NotFinite { tensor: tensor.into(), index }),
        None => Ok(()),
    }
}

fn check_scale(tensor: &str, values: &[f32]) -> Result<(), FloatNetworkError> {
    check_finite(tensor, values)?;
    match values.iter().position(|value| *value <= 0.0) {
        Some(index) => Err(FloatNetworkError::ScaleNotPositive { tensor: tensor.into(), index }),
        None => Ok(()),
    }
}

#[cfg(test)]
pub(crate) mod tests;
