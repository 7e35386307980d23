//! How a loop answers its references, from a model of it.
//!
//! *in* an identified model; *out* responses and what is read off them; *never* a response of the desired trajectory; *source*
//! superposition.

use impromptu_diagnosis::{Record, Settings, assess, transfer_function::TransferFunction};
use impromptu_training::feedback_design::{
    ArxModel,
    response::{impulse_response, velocity_weight},
};

use crate::reading::AxisSignals;

/// The loop from its reference to what is measured, by output errors: measurement noise and disturbances do not bias it.
#[derive(Clone, Debug)]
pub struct Answer {
    /// Ticks in one of the model's.
    pub divisor: usize,
    /// Model.
    pub model: TransferFunction,
    /// Standard deviation of what it leaves unexplained.
    pub unexplained: f64,
}

impl Answer {
    /// Of logs at this rate, Hz. `None` if no model explains them.
    pub fn of(logs: &[&AxisSignals], rate_hz: f64) -> Option<Self> {
        let records = logs.iter().filter_map(|signals| {
            let time: Vec<f64> = (0..signals.len()).map(|tick| tick as f64 / rate_hz).collect();
            Record::new(&time, &signals.reference, &signals.measured).ok()
        });
        let record = Record::joined(records).ok()?;
        let found = assess(&record, &Settings { draws: 1, ..Settings::default() }).ok()?;
        let divisor = (rate_hz / found.sub_rate_hz).round().max(1.0) as usize;
        let model = TransferFunction { offset: 0.0, ..found.identified.model };
        Some(Self { divisor, model, unexplained: found.properties.noise })
    }
}

/// Share of a response's peak below which it has come to its end.
const ENDED: f64 = 1e-3;
/// Longest response that is looked at, ticks.
const LONGEST: usize = 3000;
/// Share of its end that a step response has reached after one time constant.
const RISEN: f64 = 0.632;
/// Ticks after which a velocity reference has led to where it leads.
const SETTLED: usize = 1500;

/// Response to a correction of one tick, to its end or [`LONGEST`] ticks.
fn response(model: &ArxModel) -> Vec<f64> {
    let mut response = impulse_response(model, LONGEST);
    let peak = response.iter().fold(0.0f64, |peak, value| peak.max(value.abs()));
    let end = response.iter().rposition(|value| value.abs() > ENDED * peak).map_or(1, |last| last + 1);
    response.truncate(end);
    response
}

/// Ticks until the answer to a step of the position reference has come to 63 % of its end: the loop's time constant and dead
/// time. `None` if it has no end.
pub fn time_constant(model: &ArxModel) -> Option<f64> {
    let response = response(model);
    let end = response.iter().sum::<f64>();
    let mut risen = 0.0;
    let tick = response.iter().position(|value| {
        risen += value;
        risen >= RISEN * end
    })?;
    (end > 0.0 && end.is_finite() && response.len() < LONGEST).then_some(tick as f64)
}

/// What a loop makes of a velocity beside a position that it is told, s: the ratio of its gains on the two.
pub fn ratio_of_gains(model: &ArxModel, tick_s: f64) -> f64 {
    let longest = 2.0 * tick_s * time_constant(model).unwrap_or(0.0);
    velocity_weight(model, SETTLED).clamp(0.0, longest.max(0.0))
}
