//! Why an export fails.

use impromptu_firmware::model::Refusal;

use crate::float_network::FloatNetworkError;

/// Why no model file was made.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The network's parts do not fit together.
    #[error("network: {0}")]
    Network(#[from] FloatNetworkError),
    /// Network, description and rows disagree.
    #[error("{what}: {found} found where {expected} are needed")]
    Mismatch {
        /// What is counted, and what decides the count.
        what: &'static str,
        /// Count that fits.
        expected: usize,
        /// Count found.
        found: usize,
    },
    /// A calibration row holds NaN or an infinity.
    #[error("calibration row {row}: value {column} (both from 1) is not finite: leave the row out")]
    CalibrationNotFinite {
        /// Row, from 1.
        row: usize,
        /// Column, from 1.
        column: usize,
    },
    /// A time that no tick counter holds.
    #[error("`timing.{field}` is {seconds} s: give a time from 0 s to {} ticks", u16::MAX)]
    Time {
        /// The field of the description.
        field: &'static str,
        /// Its value, s.
        seconds: f32,
    },
    /// Weights so large that one step of a row's accumulator is more than half a step of the pre-activation.
    #[error(
        "layer {layer}, row {row}: weights too large for integer arithmetic: \
         train with weight decay or export with --precision float"
    )]
    Steep {
        /// Layer, from 0.
        layer: usize,
        /// Row, from 0.
        row: usize,
    },
    /// More than the firmware's fixed sizes hold.
    #[error("{what}: {found}, the firmware holds at most {limit}")]
    TooMany {
        /// What is counted.
        what: &'static str,
        /// Count found.
        found: usize,
        /// Largest count.
        limit: usize,
    },
    /// Quantisation without rows to calibrate on.
    #[error("int8 and int16 need rows to calibrate on: give --calibration FILE.csv")]
    NoCalibration,
    /// The firmware refuses the file that came out.
    #[error("the firmware refuses the result: {0}")]
    Refused(Refusal),
}
