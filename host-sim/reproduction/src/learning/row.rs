//! A row of the study.
//!
//! *in* a case and its flights; *out* numbers with the names that the JSON document has; *never* a reduction without the
//! centimetres that are left; *source* none.

use impromptu_sim::{flights::reduction, learned::Flown};
use serde::Serialize;

use super::{cases::Case, machines::Machine, seconds::Seconds};

/// A row: errors of the test strokes without and with what was learned; of a machine that turns, in hundredths of a radian.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Vehicle.
    pub vehicle: String,
    /// Kind of its baseline loop.
    #[serde(rename = "loop")]
    pub kind: String,
    /// Gains of the baseline loop.
    pub gains: String,
    /// What the flights met.
    pub condition: String,
    /// Factor on the speed of the strokes.
    pub speed: f64,
    /// What was known before anything was learned.
    pub start: &'static str,
    /// How long was learned.
    pub seconds: Seconds,
    /// Learned parts that act.
    pub parts: &'static str,
    /// Mean RMS error of the baseline, cm.
    pub baseline_cm_mean: f64,
    /// Mean RMS error, cm.
    pub rms_cm_mean: f64,
    /// Largest RMS error, cm.
    pub rms_cm_worst: f64,
    /// Mean reduction of the RMS error, %.
    pub reduction_mean: f64,
    /// Least reduction of the RMS error, %.
    pub reduction_worst: f64,
    /// Reduction of the first stroke, %; of strokes that are flown one after another.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_stroke: Option<f64>,
    /// Minutes of flight: those that taught, and those that are judged.
    pub minutes: f64,
    /// How often what was learned was forgotten because it did harm.
    pub forgotten: u32,
    /// Seed.
    pub seed: u64,
}

impl Row {
    pub(super) fn new(case: &Case, seed: u64, flown: &Flown) -> Self {
        Self {
            vehicle: case.vehicle.into(),
            kind: case.kind().into(),
            gains: case.gains.into(),
            condition: case.condition(),
            speed: case.speed,
            start: case.start.name(),
            seconds: case.seconds,
            parts: case.parts_name(),
            ..Self::found(seed, flown)
        }
    }

    /// Of a machine that turns: what is in cm is in hundredths of a radian.
    pub(super) fn of_machine(machine: Machine, seed: u64, flown: &Flown) -> Self {
        let [vehicle, kind] = machine.names();
        Self { vehicle: vehicle.into(), kind: kind.into(), ..Self::found(seed, flown) }
    }

    /// What was found, from nothing and from the first motion on.
    fn found(seed: u64, flown: &Flown) -> Self {
        let (reduction_mean, reduction_worst) = reduction(&flown.baseline, &flown.errors);
        let mean = |errors: &[f64]| 100.0 * errors.iter().sum::<f64>() / errors.len().max(1) as f64;
        Self {
            vehicle: String::new(),
            kind: String::new(),
            gains: "own".into(),
            condition: "noise".into(),
            speed: 1.0,
            start: "nothing",
            seconds: Seconds::FromFirstStroke,
            parts: "both",
            baseline_cm_mean: mean(&flown.baseline),
            rms_cm_mean: mean(&flown.errors),
            rms_cm_worst: 100.0 * flown.errors.iter().fold(0.0, |worst: f64, error| worst.max(*error)),
            reduction_mean,
            reduction_worst,
            first_stroke: flown.first,
            minutes: flown.seconds / 60.0,
            forgotten: flown.forgotten,
            seed,
        }
    }
}
