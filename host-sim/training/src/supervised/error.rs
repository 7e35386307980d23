//! Why there is no trained network.

use super::ridge::RidgeError;
use super::settings::SettingsError;
use impromptu_model_export::float_network::FloatNetworkError;

/// Why there is no trained network.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TrainingError {
    /// A setting out of its range.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The linear part has no solution.
    #[error(transparent)]
    Ridge(#[from] RidgeError),
    /// The network to start from does not fit together.
    #[error(transparent)]
    Network(#[from] FloatNetworkError),
    /// The network to start from has no linear last layer.
    #[error("the network to train has no layers or a last layer that is not linear; only linear outputs can be trained")]
    LastLayer,
    /// Data of another width.
    #[error("the data has {found} {what}; the network has {expected}")]
    Columns {
        /// Inputs or labels.
        what: &'static str,
        /// In the data.
        found: usize,
        /// In the network.
        expected: usize,
    },
    /// The loss is not finite any more.
    #[error("training diverged in epoch {epoch}; lower `learning_rate` or set `gradient_clip`")]
    Diverged {
        /// Counted from 1.
        epoch: usize,
    },
}
