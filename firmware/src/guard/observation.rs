//! What the guard is shown at a reference tick, and what it decides.
//!
//! *in* the adapter's signals, corrections and inferences; *out* an [`Observation`] and a [`Verdict`]; *never* a second way to
//! the guard within a tick; *source* what each of the guard's judges asks for.

use super::{GuardSettings, Monitor};
use crate::{
    format::{FeedbackLayout, Floats, MAX_INPUTS},
    lanes::Lanes,
};

/// What the lanes contributed to the correction of each output in a reference tick, in the output's unit. The first two add up to
/// the correction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shares<const O: usize> {
    /// The network lane's part.
    pub(crate) network: [f32; O],
    /// The feedback lane's part.
    pub(crate) feedback: [f32; O],
    /// What the network lane would contribute without the feedback lane and in full, within the limits.
    pub(crate) network_only: [f32; O],
}

impl<const O: usize> Shares<O> {
    /// Nothing.
    pub(crate) const NONE: Self = Self { network: [0.0; O], feedback: [0.0; O], network_only: [0.0; O] };
}

/// What the lanes did in a reference tick.
#[derive(Clone, Debug)]
pub(crate) struct Outcome<const O: usize, const A: usize> {
    /// What each lane has of the correction.
    pub(crate) shares: Shares<O>,
    /// Whether the network and the feedback lane asked for more than the bounds let pass.
    pub(crate) excess: [bool; 2],
    /// Whether the feedback lane was to act,
    pub(crate) active: bool,
    /// and what it asked for on each of its axes, in the outputs' units.
    pub(crate) asked: [f32; A],
    /// Share of the network lane's correction that acts, 0..=1.
    pub(crate) network: f32,
    /// Errors of the monitor's axes, in their unit.
    pub(crate) errors: [f32; A],
    /// What is desired of them: at the time of the measurement,
    pub(crate) desired: [f32; A],
    /// and now, of each reference channel that moves them.
    pub(crate) references: [[f32; MAX_INPUTS]; A],
}

impl<const O: usize, const A: usize> Outcome<O, A> {
    /// Nothing: all zeros.
    pub(crate) const NONE: Self = Self {
        shares: Shares::NONE,
        excess: [false; 2],
        active: false,
        asked: [0.0; A],
        network: 0.0,
        errors: [0.0; A],
        desired: [0.0; A],
        references: [[0.0; MAX_INPUTS]; A],
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
pub(crate) struct Observation<'a, const O: usize, const A: usize> {
    /// The feedback lane of the model.
    pub(crate) lane: Option<&'a FeedbackLayout<A>>,
    /// The loop's response to corrections.
    pub(crate) monitor: Option<&'a Monitor<'a, A>>,
    /// Lanes that the user wants.
    pub(crate) wanted: Lanes,
    /// What the lanes did in the last reference tick; `None` if none was wanted or acted, or if ticks are missing since.
    pub(crate) last: Option<&'a Outcome<O, A>>,
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
