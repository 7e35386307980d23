//! What the guard is shown at a reference tick, and what it decides.
//!
//! *in* the adapter's signals, corrections and inferences; *out* an [`Observation`] and a [`Verdict`]; *never* a second way to
//! the guard within a tick; *source* what each of the guard's judges asks for.

use super::{GuardSettings, Monitor};
use crate::{
    format::{FeedbackLayout, Floats, MAX_AXES, MAX_INPUTS, MAX_OUTPUTS},
    lanes::Lanes,
};

/// What the lanes contributed to the correction of each output in a reference tick, in the output's unit. The first two add up to
/// the correction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shares {
    /// The network lane's part.
    pub(crate) network: [f32; MAX_OUTPUTS],
    /// The feedback lane's part.
    pub(crate) feedback: [f32; MAX_OUTPUTS],
    /// What the network lane would contribute without the feedback lane and in full, within the limits.
    pub(crate) network_only: [f32; MAX_OUTPUTS],
}

impl Shares {
    /// Nothing.
    pub(crate) const NONE: Self =
        Self { network: [0.0; MAX_OUTPUTS], feedback: [0.0; MAX_OUTPUTS], network_only: [0.0; MAX_OUTPUTS] };
}

/// What the lanes did in a reference tick.
#[derive(Clone, Debug)]
pub(crate) struct Outcome {
    /// What each lane has of the correction.
    pub(crate) shares: Shares,
    /// Whether the network and the feedback lane asked for more than the bounds let pass.
    pub(crate) excess: [bool; 2],
    /// Whether the feedback lane was to act,
    pub(crate) active: bool,
    /// and what it asked for on each of its axes, in the outputs' units.
    pub(crate) asked: [f32; MAX_AXES],
    /// Share of the network lane's correction that acts, 0..=1.
    pub(crate) network: f32,
    /// Errors of the monitor's axes, in their unit.
    pub(crate) errors: [f32; MAX_AXES],
    /// What is desired of them: at the time of the measurement,
    pub(crate) desired: [f32; MAX_AXES],
    /// and now, of each reference channel that moves them.
    pub(crate) references: [[f32; MAX_INPUTS]; MAX_AXES],
}

impl Outcome {
    /// Nothing: all zeros.
    pub(crate) const NONE: Self = Self {
        shares: Shares::NONE,
        excess: [false; 2],
        active: false,
        asked: [0.0; MAX_AXES],
        network: 0.0,
        errors: [0.0; MAX_AXES],
        desired: [0.0; MAX_AXES],
        references: [[0.0; MAX_INPUTS]; MAX_AXES],
    };
}

/// The network lane's features against the box of those in training.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Features {
    /// Not evaluated in this reference tick: those of the last sub-rate tick stand.
    Unchanged,
    /// The network lane is off: nothing is known of them.
    Unknown,
    /// All inside.
    Inside,
    /// One is outside.
    Outside,
}

impl Features {
    /// Compares the features of a sub-rate tick with the smallest and largest of training.
    pub(crate) fn compare(features: &[f32], (low, high): &(Floats<'_>, Floats<'_>), settings: &GuardSettings) -> Self {
        let inside = |((low, high), &feature): ((f32, f32), &f32)| {
            let slack = settings.envelope_margin * (high - low) + settings.envelope_floor;
            // Written so that NaN is outside.
            feature >= low - slack && feature <= high + slack
        };
        if low.iter().zip(high.iter()).zip(features).all(inside) { Self::Inside } else { Self::Outside }
    }
}

/// One reference tick, before the lanes act.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Observation<'a> {
    /// The feedback lane of the model.
    pub(crate) lane: Option<&'a FeedbackLayout>,
    /// The loop's response to corrections.
    pub(crate) monitor: Option<&'a Monitor<'a>>,
    /// Lanes that the user wants.
    pub(crate) wanted: Lanes,
    /// What the lanes did in the last reference tick; `None` if none was wanted or acted, or if ticks are missing since.
    pub(crate) last: Option<&'a Outcome>,
    /// The network lane's features.
    pub(crate) features: Features,
    /// Whether every desired channel is a finite number.
    pub(crate) finite: bool,
    /// Reference ticks in a row without a measurement that is a number in each channel.
    pub(crate) bad: u16,
    /// Inferences in a row that came too late.
    pub(crate) late: u16,
    /// Age of the newest measurement beyond the model's delay, reference ticks.
    pub(crate) age: u16,
    /// Whether there is a desired trajectory.
    pub(crate) trajectory: bool,
}

/// What the lanes may do in this reference tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Verdict {
    /// Of the lanes wanted those that may act.
    pub(crate) allowed: Lanes,
    /// Least change of weight in a reference tick of a lane that tripped.
    pub(crate) handover_step: f32,
    /// Share of the feedback lane that may act, 0..=1.
    pub(crate) share: f32,
}
