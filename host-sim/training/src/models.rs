//! What models say of themselves, and the model that needs no training.
//!
//! *in* a recipe, a loop, rows; *out* a [`Description`]; *never* limits far above the corrections of the training flights;
//! *source* differential flatness for the feed-forward.

use impromptu_firmware::{
    features::{Feature, Relative, Source},
    model::{Interpolation, Output},
};
use impromptu_flight::{
    flight::Settings,
    quadrotor::{self, REFERENCE},
};
use impromptu_model_export::{
    Description, ExportError, FloatNetwork, Precision,
    description::{LaneDescription, Provenance, Signals, Timing},
    encode,
};
use impromptu_sim::flights::Loop;

use crate::{learn::Rows, recipe::Recipe};

/// Limits above the largest correction in training.
const LIMIT_FACTOR: f32 = 1.5;
/// A correction may cross its whole range in this many reference ticks.
const SLEW_TICKS: f32 = 5.0;

/// Largest correction and slew of each reference channel.
fn outputs(rows: &Rows, lane: Option<&LaneDescription>) -> Vec<Output> {
    let feedback =
        lane.map_or(0.0, |lane| lane.axes.iter().map(|axis| axis.fast_limit + axis.integral_limit).fold(0.0, f32::max));
    (0..REFERENCE)
        .map(|channel| {
            let limit = LIMIT_FACTOR * rows.label_range[channel] + if channel < 3 { feedback } else { 0.0 };
            Output { channel: channel as u8, limit, slew: limit / SLEW_TICKS }
        })
        .collect()
}

/// Description of a model of a loop, without a monitor.
pub fn describe(
    recipe: &Recipe,
    closed_loop: &Loop,
    rows: &Rows,
    lane: Option<&LaneDescription>,
    name: &str,
    remarks: &str,
    seed: u64,
) -> Description {
    Description {
        name: name.into(),
        provenance: Provenance {
            vehicle: closed_loop.vehicle.name.clone(),
            gains: closed_loop.gains.clone(),
            condition: closed_loop.condition.name.clone(),
            software: format!("host-sim {}", env!("CARGO_PKG_VERSION")),
            seed,
            data_crc: rows.data_crc,
            remarks: remarks.into(),
        },
        signals: Signals::from(&quadrotor::signals()),
        timing: Timing {
            reference_rate_hz: closed_loop.rate_hz() as f32,
            divisor: recipe.divisor,
            interpolation: recipe.interpolation,
            measurement_delay_s: closed_loop.condition.measurement_delay_s as f32,
            fade_s: recipe.fade_s as f32,
        },
        features: recipe.features(),
        outputs: outputs(rows, lane),
        envelope: rows.envelope.clone(),
        feedback_lane: lane.cloned(),
        monitor: None,
        tie: None,
    }
}

/// Differential-flatness feed-forward through the reference, p_r = p_d + a_d / kp, as a linear model at the reference's own rate.
///
/// # Errors
/// If it cannot be encoded.
pub fn feedforward(settings: &Settings, description: Description) -> Result<Vec<u8>, ExportError> {
    let features: Vec<Feature> =
        (6..9).map(|channel| Feature { source: Source::Desired, channel, offset: 0, relative: Relative::Nothing }).collect();
    let mut skip = vec![0.0; REFERENCE * 3];
    for (axis, kp) in settings.position.kp.iter().enumerate() {
        skip[axis * 3 + axis] = 1.0 / kp;
    }
    let network = FloatNetwork {
        input_mean: vec![0.0; 3],
        input_scale: vec![1.0; 3],
        layers: Vec::new(),
        skip: Some(skip),
        output_mean: vec![0.0; REFERENCE],
        output_scale: vec![1.0; REFERENCE],
        notes: Default::default(),
    };
    // Evaluated a tick ahead, so that the inference's time does not delay it.
    let timing = Timing { divisor: 1, interpolation: Interpolation::Linear, ..description.timing };
    let description = Description { timing, envelope: vec![(-20.0, 20.0); 3], features, ..description };
    encode(&description, Some(&network), Precision::Float, &[vec![1.0, -2.0, 0.5]])
}
