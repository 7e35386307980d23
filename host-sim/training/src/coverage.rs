//! What of a trajectory lies outside of what was trained on.
//!
//! *in* a description, trajectories; *out* shares of their ticks; *never* a feature that the firmware computes otherwise;
//! *source* the training box of the guard: least and greatest value of each feature, and its margin beyond them.

use impromptu_firmware::{
    features::{Signals, evaluate},
    guard::GuardSettings,
};
use impromptu_model_export::Description;
use impromptu_sim::trajectory::{Sample, Trajectory};
use serde::Serialize;

/// How far a trajectory leaves the training box.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Coverage {
    /// Name of the trajectory.
    pub trajectory: String,
    /// Ticks in which a feature is outside, %.
    pub outside_percent: f64,
    /// Ticks in which one is further outside than the guard lets pass: there the network lane is handed over, %.
    pub handed_over_percent: f64,
    /// How far the furthest feature goes, in widths of its range in training; 1 and less: it stays inside.
    pub furthest: f64,
}

/// A trajectory as features read it; it rests beyond its ends.
struct Desired<'a>(&'a [Sample]);

impl Signals for Desired<'_> {
    fn desired(&self, tick: i32, channel: usize) -> f32 {
        let last = self.0.len().saturating_sub(1);
        let beyond = tick < 0 || tick as usize > last;
        let Some(sample) = self.0.get((tick.max(0) as usize).min(last)) else { return 0.0 };
        let moving = |values: [f64; 3], axis: usize| if beyond { 0.0 } else { values[axis] as f32 };
        match channel {
            0..3 => sample.position[channel] as f32,
            3..6 => moving(sample.velocity, channel - 3),
            6..9 => moving(sample.acceleration, channel - 6),
            _ => sample.yaw as f32,
        }
    }

    // What is measured is what is desired, if all goes well.
    fn measured(&self, tick: i32, channel: usize) -> f32 {
        self.desired(tick, channel)
    }

    fn reference(&self, tick: i32, channel: usize) -> f32 {
        self.desired(tick, channel)
    }
}

/// How far a trajectory leaves the training box of a model.
pub fn coverage(description: &Description, trajectory: &Trajectory) -> Coverage {
    let guard = GuardSettings::default();
    let signals = Desired(&trajectory.samples);
    let divisor = i32::from(description.timing.divisor);
    let mut row = vec![0.0f32; description.features.len()];
    let (mut outside, mut handed_over, mut ticks, mut furthest) = (0usize, 0usize, 0usize, 0.0f64);
    for tick in (0..trajectory.samples.len()).step_by(divisor.max(1) as usize) {
        evaluate(&description.features, &signals, tick as i32, divisor, &mut row);
        let (mut out, mut over) = (false, false);
        for (value, (low, high)) in row.iter().zip(&description.envelope) {
            let beyond = (low - value).max(value - high);
            let width = (high - low).max(f32::MIN_POSITIVE);
            out |= beyond > 0.0;
            over |= beyond > guard.envelope_margin * width + guard.envelope_floor;
            if beyond > guard.envelope_floor {
                furthest = furthest.max(1.0 + f64::from(beyond / width));
            }
        }
        ticks += 1;
        outside += usize::from(out);
        handed_over += usize::from(over);
    }
    let percent = |count: usize| 100.0 * count as f64 / ticks.max(1) as f64;
    Coverage {
        trajectory: trajectory.name.clone(),
        outside_percent: percent(outside),
        handed_over_percent: percent(handed_over),
        furthest: furthest.max(1.0),
    }
}

impl Coverage {
    /// In words.
    pub fn words(&self) -> String {
        let Self { trajectory, outside_percent, handed_over_percent, furthest } = self;
        if *outside_percent == 0.0 {
            return format!("{trajectory}: inside of what was trained on");
        }
        let lost = if *handed_over_percent > 0.0 {
            format!(
                "; in {handed_over_percent:.0} % so far that the guard hands the network lane over: train on logs as fast as it"
            )
        } else {
            String::new()
        };
        format!(
            "{trajectory}: outside of what was trained on in {outside_percent:.0} % of its ticks, {furthest:.1} ranges far{lost}"
        )
    }
}
