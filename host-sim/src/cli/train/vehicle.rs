//! Whether the vehicle of `train --vehicle` is that of the logs.

use anyhow::Result;
use impromptu_sim::{flight_log::FlightLog, flights::Loop};
use impromptu_training::{agreement::agreement, breakdown::sound, observer::Observer as _};

use crate::cli::{Invocation, log_reading::OtherLoop};

/// Refuses a simulated loop that is not that of the logs, or says what --force overrides.
pub(super) fn compared(
    vehicle: &str,
    force: bool,
    invocation: &Invocation,
    closed_loop: &Loop,
    logs: &[&[FlightLog]],
) -> Result<Option<String>> {
    invocation.console.stage("flying the logs' references with --vehicle");
    for logs in logs {
        let (sound, _) = sound(logs);
        let found = if sound.is_empty() { None } else { agreement(closed_loop, &sound)?.disagreement(closed_loop) };
        match found {
            Some(found) if force => {
                let overridden = format!("--vehicle overridden by --force: {found}");
                invocation.console.note(&format!("warning: {overridden}"));
                return Ok(Some(overridden));
            }
            Some(found) => {
                return Err(anyhow::Error::new(OtherLoop { vehicle: vehicle.into(), found }));
            }
            None => {}
        }
    }
    Ok(None)
}
