//! Why there are no models.

use impromptu_model_export::ExportError;
use impromptu_sim::flights::FlightsError;

use crate::learn::LearnError;

/// Why there are no models.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// Flights failed.
    #[error(transparent)]
    Flights(#[from] FlightsError),
    /// Learning failed.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// A model could not be encoded.
    #[error(transparent)]
    Export(#[from] ExportError),
}
