//! The float network as a safetensors file, which most machine-learning tools read and write.
//!
//! All tensors are `F32`; a vector has one dimension, a matrix `[outputs, inputs]`:
//!
//! | tensor | shape | |
//! |---|---|---|
//! | `input.mean`, `input.scale` | `[inputs]` | |
//! | `skip.weight` | `[outputs, inputs]` | absent without a skip |
//! | `layer.0.weight`, `layer.1.weight`, … | `[outputs of the layer, inputs of the layer]` | |
//! | `layer.0.bias`, … | `[outputs of the layer]` | |
//! | `output.mean`, `output.scale` | `[outputs]` | |
//!
//! The metadata map holds `format` = [`FORMAT_NAME`], `version` = [`FORMAT_VERSION`], `layers` (how many),
//! `layer.0.activation`, … (`relu`, `tanh` or `linear`) and the notes. The same network gives the same bytes.

use super::{
    Activation, DenseLayer, FloatNetwork, FloatNetworkError,
    names::{is_reserved, layer_bias_name, layer_weight_name},
};
use impromptu_files::{reading, replacement::replace};
use safetensors::tensor::{Dtype, SafeTensorError, SafeTensors, TensorView};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};

/// The metadata entry `format`: what tells such a file from any other safetensors file.
pub const FORMAT_NAME: &str = "impromptu-float-network";
/// The metadata entry `version`, raised when the meaning of a tensor changes.
pub const FORMAT_VERSION: &str = "1";

/// Why a file was not written or not read.
#[derive(Debug, thiserror::Error)]
pub enum FloatNetworkFileError {
    /// The operating system refused.
    #[error("{path}: {source}")]
    Io {
        /// The file that was to be read or written.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// What is wrong inside a file that could be read.
    #[error("{path}: {source}")]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: Box<FloatNetworkFileError>,
    },
    /// Not a safetensors file, or cut short, or longer than its header says.
    #[error("not a complete safetensors file: {0}")]
    Container(#[from] SafeTensorError),
    /// A metadata entry is missing or has another value than this version reads.
    #[error("metadata `{key}` is {found}; expected {expected}")]
    Metadata {
        /// The entry.
        key: String,
        /// What the file has there.
        found: String,
        /// What it should have.
        expected: String,
    },
    /// A tensor that the network needs is not in the file.
    #[error("tensor `{0}` is missing")]
    MissingTensor(String),
    /// A tensor that no part of the network has a place for.
    #[error("tensor `{0}` belongs to no part of a float network; check its spelling and the metadata `layers`")]
    UnknownTensor(String),
    /// A tensor of another type or number of dimensions.
    #[error("tensor `{tensor}` is {found}; expected {expected}")]
    Kind {
        /// The tensor.
        tensor: String,
        /// Its type and shape.
        found: String,
        /// What it should be.
        expected: String,
    },
    /// The parts were read and do not fit together.
    #[error(transparent)]
    Network(#[from] FloatNetworkError),
}

impl FloatNetwork {
    /// The network as the bytes of a safetensors file.
    pub fn to_bytes(&self) -> Result<Vec<u8>, FloatNetworkFileError> {
        self.check()?;
        let (inputs, outputs) = (self.inputs(), self.outputs());
        let mut metadata: BTreeMap<String, String> = self.notes.clone();
        metadata.insert("format".into(), FORMAT_NAME.into());
        metadata.insert("version".into(), FORMAT_VERSION.into());
        metadata.insert("layers".into(), self.layers.len().to_string());
        let mut tensors = vec![
            ("input.mean".to_owned(), vec![inputs], &self.input_mean),
            ("input.scale".to_owned(), vec![inputs], &self.input_scale),
            ("output.mean".to_owned(), vec![outputs], &self.output_mean),
            ("output.scale".to_owned(), vec![outputs], &self.output_scale),
        ];
        if let Some(skip) = &self.skip {
            tensors.push(("skip.weight".to_owned(), vec![outputs, inputs], skip));
        }
        let mut width = inputs;
        for (index, layer) in self.layers.iter().enumerate() {
            metadata.insert(activation_key(index), layer.activation.name().into());
            tensors.push((layer_weight_name(index), vec![layer.outputs(), width], &layer.weights));
            tensors.push((layer_bias_name(index), vec![layer.outputs()], &layer.bias));
            width = layer.outputs();
        }
        let bytes: Vec<(String, Vec<usize>, Vec<u8>)> = tensors
            .into_iter()
            .map(|(name, shape, values)| (name, shape, values.iter().flat_map(|value| value.to_le_bytes()).collect()))
            .collect();
        let views = bytes
            .iter()
            .map(|(name, shape, data)| Ok((name.as_str(), TensorView::new(Dtype::F32, shape.clone(), data)?)))
            .collect::<Result<Vec<_>, SafeTensorError>>()?;
        let file = safetensors::serialize(views, Some(metadata.into_iter().collect::<HashMap<_, _>>()))?;
        with_sorted_header(&file)
    }

    /// The network in the bytes of a safetensors file; anything that does not fit is refused by name.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, FloatNetworkFileError> {
        let (_, header) = SafeTensors::read_metadata(bytes)?;
        let tensors = SafeTensors::deserialize(bytes)?;
        let mut metadata: BTreeMap<String, String> = header.metadata().clone().unwrap_or_default().into_iter().collect();
        expect_metadata(&metadata, "format", FORMAT_NAME)?;
        expect_metadata(&metadata, "version", FORMAT_VERSION)?;
        let layers_text = metadata.get("layers").cloned();
        let layer_count: usize =
            layers_text.as_deref().and_then(|text| text.parse().ok()).ok_or_else(|| wrong("layers", layers_text, "a number"))?;
        let mut unread: BTreeSet<String> = tensors.names().into_iter().map(str::to_owned).collect();
        let mut layers = Vec::new();
        for index in 0..layer_count {
            let weights = take(&tensors, &mut unread, &layer_weight_name(index), 2)?;
            let bias = take(&tensors, &mut unread, &layer_bias_name(index), 1)?;
            if weights.0[0] != bias.1.len() {
                return Err(shape_error(&layer_bias_name(index), bias.1.len(), weights.0[0], "one for each row of weights"));
            }
            let key = activation_key(index);
            let name = metadata.get(&key).cloned();
            let activation =
                name.as_deref().and_then(Activation::from_name).ok_or_else(|| wrong(&key, name, "`relu`, `tanh` or `linear`"))?;
            layers.push(DenseLayer { weights: weights.1, bias: bias.1, activation });
        }
        let mut vector = |name: &str| take(&tensors, &mut unread, name, 1).map(|(_, values)| values);
        let (input_mean, input_scale) = (vector("input.mean")?, vector("input.scale")?);
        let (output_mean, output_scale) = (vector("output.mean")?, vector("output.scale")?);
        let skip = match unread.contains("skip.weight") {
            true => {
                let (shape, values) = take(&tensors, &mut unread, "skip.weight", 2)?;
                if shape[0] != output_mean.len() {
                    return Err(shape_error("skip.weight", shape[0], output_mean.len(), "one row for each output"));
                }
                Some(values)
            }
            false => None,
        };
        if let Some(name) = unread.pop_first() {
            return Err(FloatNetworkFileError::UnknownTensor(name));
        }
        metadata.retain(|key, _| !is_reserved(key));
        let network = Self { input_mean, input_scale, layers, skip, output_mean, output_scale, notes: metadata };
        network.check()?;
        Ok(network)
    }

    /// Writes the file, or leaves what was there: the bytes go to a temporary file beside it, which then replaces it.
    pub fn write(&self, path: &Path) -> Result<(), FloatNetworkFileError> {
        let content = |source| FloatNetworkFileError::Content { path: path.to_owned(), source: Box::new(source) };
        let bytes = self.to_bytes().map_err(content)?;
        let io_error = |source| FloatNetworkFileError::Io { path: path.to_owned(), source };
        replace(path, &bytes).map_err(io_error)
    }

    /// Reads a file that [`FloatNetwork::write`] or another tool wrote.
    pub fn read(path: &Path) -> Result<Self, FloatNetworkFileError> {
        let bytes = reading::read(path, reading::DOCUMENT)
            .map_err(|source| FloatNetworkFileError::Io { path: path.to_owned(), source })?;
        Self::from_bytes(&bytes)
            .map_err(|source| FloatNetworkFileError::Content { path: path.to_owned(), source: Box::new(source) })
    }
}

fn activation_key(index: usize) -> String {
    format!("layer.{index}.activation")
}

/// The crate writes the metadata in the order of a hash map, another one in each process: sort it.
fn with_sorted_header(file: &[u8]) -> Result<Vec<u8>, FloatNetworkFileError> {
    let (length, _) = SafeTensors::read_metadata(file)?;
    let (header, data) = file[8..].split_at(length);
    let invalid = SafeTensorError::InvalidHeaderDeserialization;
    let mut entries: BTreeMap<String, serde_json::Value> = serde_json::from_slice(header).map_err(invalid)?;
    if let Some(metadata) = entries.get_mut("__metadata__") {
        let sorted: BTreeMap<String, String> = serde_json::from_value(metadata.take()).map_err(invalid)?;
        *metadata = serde_json::to_value(sorted).map_err(invalid)?;
    }
    let mut sorted = serde_json::to_vec(&entries).map_err(invalid)?;
    // Data starts at a multiple of 8, padded with spaces, as the format asks for.
    sorted.resize(sorted.len().next_multiple_of(8), b' ');
    let mut bytes = (sorted.len() as u64).to_le_bytes().to_vec();
    bytes.extend(sorted);
    bytes.extend(data);
    Ok(bytes)
}

fn expect_metadata(metadata: &BTreeMap<String, String>, key: &str, expected: &str) -> Result<(), FloatNetworkFileError> {
    match metadata.get(key) {
        Some(value) if value == expected => Ok(()),
        other => Err(wrong(key, other.cloned(), &format!("`{expected}`"))),
    }
}

fn wrong(key: &str, found: Option<String>, expected: &str) -> FloatNetworkFileError {
    let found = found.map_or("missing".into(), |value| format!("`{value}`"));
    FloatNetworkFileError::Metadata { key: key.into(), found, expected: expected.into() }
}

fn shape_error(tensor: &str, found: usize, expected: usize, reason: &str) -> FloatNetworkFileError {
    FloatNetworkError::Shape { tensor: tensor.into(), found, expected, reason: reason.into() }.into()
}

/// Shape and values of an `F32` tensor with so many dimensions.
fn take(
    tensors: &SafeTensors<'_>,
    unread: &mut BTreeSet<String>,
    name: &str,
    dimensions: usize,
) -> Result<(Vec<usize>, Vec<f32>), FloatNetworkFileError> {
    let tensor = tensors.tensor(name).map_err(|_| FloatNetworkFileError::MissingTensor(name.into()))?;
    if tensor.dtype() != Dtype::F32 || tensor.shape().len() != dimensions {
        return Err(FloatNetworkFileError::Kind {
            tensor: name.into(),
            found: format!("{:?} {:?}", tensor.dtype(), tensor.shape()),
            expected: format!("F32 with {dimensions} dimension(s)"),
        });
    }
    unread.remove(name);
    let values = tensor.data().as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    Ok((tensor.shape().to_vec(), values))
}
