//! Names that the file of a float network keeps for itself.

/// Metadata names which notes may not use.
pub(super) fn is_reserved(key: &str) -> bool {
    matches!(key, "format" | "version" | "layers") || key.starts_with("layer.")
}

/// Tensor of a layer's weights.
pub(super) fn layer_weight_name(index: usize) -> String {
    format!("layer.{index}.weight")
}

/// Tensor of a layer's biases.
pub(super) fn layer_bias_name(index: usize) -> String {
    format!("layer.{index}.bias")
}
