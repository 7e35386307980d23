//! What the firmware's guard is told of a loop: its response to corrections, and what the add-on promises.
//!
//! *in* logs with dither, and validation flights with the add-on; *out* a [`MonitorDescription`]; *never* a validated RMS from
//! flights that the guard has interfered with.

use impromptu_firmware::{adapter::Lanes, model::Model};
use impromptu_model_export::{
    ExportError,
    description::{MonitorAxisDescription, MonitorDescription},
};
use impromptu_sim::{flight_log::FlightLog, flights::FlightsError};

use crate::{
    error::BuildError,
    feedback_design::{IdentificationData, response::box_responses},
    lane::identification,
    lane_choice::LaneRefusal,
    recipe::Recipe,
    validation::Validation,
};

/// Reference ticks in a monitor tick: 50 ms at 100 Hz.
const DIVISOR: usize = 5;
/// Monitor ticks that a response lasts: 1.6 s, after which the loops of both vehicles are at rest.
const TAPS: usize = 32;

/// The responses of x, y and z to the corrections of position and velocity, from logs with dither. The validated RMS is still
/// zero.
///
/// # Errors
/// If the logs cannot tell what a correction does.
pub fn monitor(recipe: &Recipe, logs: &[FlightLog]) -> Result<MonitorDescription, LaneRefusal> {
    let design = &recipe.lane.design;
    let [horizontal, vertical] = identification(logs, design.margin_lags)?;
    let responses = |axis, data: &IdentificationData| {
        let refuse = |reason| LaneRefusal::Design { axis, reason };
        data.excitation().require(design.least_excitation).map_err(refuse)?;
        let model = data.fit(design.margin_lags, [0.0; 2], design.regularisation).map_err(refuse)?;
        Ok::<_, LaneRefusal>(
            box_responses(&model, DIVISOR, TAPS).map(|taps| taps.iter().map(|tap| *tap as f32).collect::<Vec<_>>()),
        )
    };
    let (horizontal, vertical) = (responses("x and y", &horizontal)?, responses("z", &vertical)?);
    let axes = [&horizontal, &horizontal, &vertical].into_iter().zip(0u8..);
    let axes = axes.map(|(taps, axis)| MonitorAxisDescription {
        error: (axis, axis),
        inputs: vec![axis, axis + 3],
        taps: taps.to_vec(),
    });
    Ok(MonitorDescription { divisor: DIVISOR as u16, validated_rms: 0.0, axes: axes.collect() })
}

/// Median over the validation flights of the RMS error with all lanes of a model, m: a few flights in which motors saturate do
/// not loosen it.
///
/// # Errors
/// If the model is refused or does not fit the flight stack.
pub fn validated_rms(validation: &Validation<'_>, model: &[u8]) -> Result<f32, BuildError> {
    let model = Model::from_bytes(model).map_err(ExportError::Refused)?;
    let Validation { closed_loop, trajectories, seed } = validation;
    let errors = closed_loop.unguarded().errors(trajectories, Some((&model, Lanes::BOTH)), 1.0, *seed);
    let mut errors = errors.map_err(FlightsError::from)?;
    errors.sort_by(f64::total_cmp);
    Ok(errors.get(errors.len() / 2).copied().unwrap_or(0.0) as f32)
}
