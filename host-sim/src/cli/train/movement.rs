//! Whether anything moves in the logs of a training.

use anyhow::{Result, bail};
use impromptu_sim::flight_log::FlightLog;

/// Logs in which nothing moves teach nothing: the largest extent of the measured path, m, must be above this.
const LEAST_EXTENT: f64 = 0.2;

/// Refuses logs in which nothing moves.
///
/// # Errors
/// By how much it moves.
pub(super) fn check_movement(logs: &[FlightLog]) -> Result<()> {
    let extent = (0..3).map(|axis| {
        let values = || logs.iter().flat_map(|log| log.rows.iter().map(move |row| row.measured_position[axis]));
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
    });
    let extent = extent.fold(0.0, f64::max);
    if extent < LEAST_EXTENT {
        bail!(
            "--log: no excitation: the vehicle moves by {extent:.3} m only; log flights along strokes, splines or several tones"
        );
    }
    Ok(())
}
