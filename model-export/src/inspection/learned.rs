//! What was learned in flight and kept, for people as text and for programs as JSON.
//!
//! *in* a checked file of [`impromptu_firmware::learning::Kept`]; *out* responses and weights of each axis; *never* a number that
//! the file does not hold or imply.

use std::fmt;

use impromptu_firmware::learning::{Kept, KeptAxis, lags, offsets};
use serde::Serialize;

/// Everything that `inspect` prints of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LearnedInspection {
    /// `learned`: no model, but what a learner goes on with.
    pub kind: &'static str,
    /// What tells the loop from others: signals, rate, model; hexadecimal.
    pub identity: String,
    /// Ticks of the learner a second.
    pub rate_hz: f32,
    /// Axes in their order.
    pub axes: Vec<LearnedAxis>,
}

/// An axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LearnedAxis {
    /// Gain at rest of the response that it was learned with.
    pub gain: f32,
    /// Its natural frequency, rad/s.
    pub frequency: f32,
    /// Its delay, s.
    pub delay_s: f32,
    /// How late it answers a slow correction, s, the delay included.
    pub lag_s: f32,
    /// Seconds in motion that were learned from.
    pub learned_s: f32,
    /// Weights of the preview part: of the desired trajectory at each time from now on, s, less the present.
    pub preview: Vec<Weight>,
    /// The constant.
    pub constant: f32,
    /// Weights of the feedback part, of the error as it would be without it.
    pub error: Vec<Weight>,
    /// The same, of its rate of change, in units of 30 ticks of a loop with a lag of 50.
    pub error_rate: Vec<Weight>,
}

/// A weight and the time that it is for, s from now on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Weight {
    /// Time.
    pub time_s: f32,
    /// Weight.
    pub weight: f32,
}

impl LearnedInspection {
    /// Of a file.
    pub fn new(kept: &Kept<'_>) -> Self {
        let axes = kept.axes().map(|axis| LearnedAxis::new(&axis, kept.rate_hz)).collect();
        Self { kind: "learned", identity: format!("{:08x}", kept.identity), rate_hz: kept.rate_hz, axes }
    }
}

impl LearnedAxis {
    fn new(KeptAxis { response, learned_s, learned, .. }: &KeptAxis, rate_hz: f32) -> Self {
        let pairs = |ticks: &[f32], weights: &[f32]| {
            let weight = |(ticks, weight): (&f32, &f32)| Weight { time_s: ticks / rate_hz, weight: *weight };
            ticks.iter().zip(weights).map(weight).collect::<Vec<_>>()
        };
        // No negative zero.
        let lags = lags(response).map(|ticks| 0.0 - f32::from(ticks));
        let (error, error_rate) = learned.feedback.split_at(lags.len());
        Self {
            gain: response.gain(),
            frequency: response.turn() * rate_hz,
            delay_s: response.delay() as f32 / rate_hz,
            lag_s: response.lag() / rate_hz,
            learned_s: *learned_s,
            preview: pairs(&offsets(response).map(f32::from), &learned.preview),
            constant: learned.preview.last().copied().unwrap_or(0.0),
            error: pairs(&lags, error),
            error_rate: pairs(&lags, error_rate),
        }
    }
}

impl fmt::Display for LearnedInspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "learned        {} axes at {} Hz, identity {}", self.axes.len(), self.rate_hz, self.identity)?;
        for (index, axis) in self.axes.iter().enumerate() {
            let LearnedAxis { gain, frequency, lag_s, learned_s, constant, .. } = axis;
            writeln!(
                f,
                "\naxis {index}         gain {gain:.3}, {frequency:.3} rad/s, lag {lag_s:.3} s; from {learned_s:.1} s in motion"
            )?;
            writeln!(f, "constant       {constant:.4}")?;
            for (name, weights) in [("preview", &axis.preview), ("error", &axis.error), ("error rate", &axis.error_rate)] {
                write!(f, "{name:<14}")?;
                for Weight { time_s, weight } in weights {
                    write!(f, " {weight:.3} at {time_s:+.2} s;")?;
                }
                writeln!(f)?;
            }
        }
        Ok(())
    }
}
