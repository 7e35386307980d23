//! Settings of the guard, with defaults that were measured.
//!
//! *in* keys of a settings file, those of earlier versions too; *out* thresholds and times; *never* an unknown key; *source*
//! validation flights, in which the defaults were measured.

use serde::{Deserialize, Serialize};

/// When lanes trip and come back. The defaults of the counterfactual monitor and of the oscillation trip lanes in validation
/// strokes only where motors saturate (1.7 times the speed).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(default, deny_unknown_fields)]
pub struct GuardSettings {
    /// Whether the guard trips lanes at all. It is off for flights that judge what a lane does by itself.
    pub enabled: bool,
    /// Every cause must be absent for this time, s, before its lane comes back.
    pub hold_s: f32,
    /// A lane that trips is faded out in this time, s, or in the model's own fade time if that is shorter.
    pub handover_s: f32,
    /// A feature is outside of the training envelope if it leaves it by more than this share of the envelope's width and
    /// [`GuardSettings::envelope_floor`] together.
    pub envelope_margin: f32,
    /// A feature may leave the training envelope by this much, in its unit, in addition to the margin: an envelope can have no
    /// width.
    pub envelope_floor: f32,
    /// The network lane acts in full as long as the window of the desired trajectory moves by no more than this share beyond what
    /// it moved by in training; from there on it acts less, before its features are outside.
    pub window_margin: f32,
    /// The network lane trips after this many sub-rate ticks in a row with a feature outside; 0 counts as 1.
    pub envelope_ticks: u16,
    /// Both lanes trip when the newest measurement is older than the model's measurement delay by more than this time, s.
    pub stale_s: f32,
    /// A lane trips when it asked for more than limit and slew let pass in more than this share of the recent ticks, 0..=1.
    pub saturated_share: f32,
    /// The share of saturated ticks is an exponentially weighted mean with this time constant, s.
    pub saturated_s: f32,
    /// A lane stays off after this many trips by saturation, until it is armed again.
    pub saturated_trips: u16,
    /// The network lane trips after this many inferences in a row that came too late; 0 counts as 1.
    pub late_in_a_row: u16,
    /// A lane trips when the RMS of the error with it is more than this factor of what it would be without the lane, beyond the
    /// floor.
    #[serde(alias = "evidence_factor")]
    pub counterfactual_factor: f32,
    /// The network lane is allowed this factor instead as long as the loop responds to the feedback lane too, which mends a part
    /// of its mistakes.
    pub assisted_factor: f32,
    /// An error below this many times the model's validated RMS trips no lane.
    #[serde(alias = "evidence_floor")]
    pub counterfactual_floor: f32,
    /// The feedback lane is allowed this share of the error that there would be without any correction, in addition.
    #[serde(alias = "evidence_share")]
    pub counterfactual_share: f32,
    /// The energies of the errors are exponentially weighted means with this time constant, s.
    #[serde(alias = "evidence_s")]
    pub counterfactual_s: f32,
    /// The error without any correction counts as at least its long-term baseline, an exponentially weighted mean with this time
    /// constant, s: in a moment of calm no error is large.
    #[serde(alias = "usual_s")]
    pub long_term_s: f32,
    /// A lane stays off after this many trips by the counterfactual monitor, until it is armed again.
    #[serde(alias = "evidence_trips")]
    pub counterfactual_trips: u16,
    /// The feedback lane makes a turn when what it asks for comes back from its farthest value by this many fast clamps, 2 at
    /// most.
    pub oscillation_swing: f32,
    /// The feedback lane oscillates if its recent turns, all axes added, are more than this, and its power is too.
    pub oscillation_turns: f32,
    /// The feedback lane oscillates if the mean square of what it asks for, around its mean, all axes added, is more than this,
    /// in squares of the fast clamps, and its turns are too.
    pub oscillation_power: f32,
    /// Turns and power are forgotten with this time constant, s.
    pub oscillation_s: f32,
    /// The feedback lane stays off after this many trips by oscillation, until it is armed again: each return would swing again.
    pub oscillation_trips: u16,
    /// What is slower than this time constant, s, does not swing: a payload, a steady wind, the integral.
    pub swing_s: f32,
    /// The feedback lane acts in full until what swings comes to this share of where nothing of it acts; from there on it acts
    /// less.
    pub swing_onset: f32,
    /// It begins with this share, as the loop's delay is not known yet,
    pub swing_start: f32,
    /// and its share may grow by one in this time, s.
    pub swing_recovery_s: f32,
    /// Nothing of the feedback lane acts where what swings of the error is more than this share of what would swing without the
    /// lane, beyond what the desired trajectory and the floor allow. A lane that damps leaves a half and less.
    pub astray_left: f32,
    /// It trips when that is this factor more than allowed.
    pub astray_trip: f32,
    /// What the loop's nominal response to the desired trajectory leads to allows this factor of it in addition,
    pub astray_factor: f32,
    /// or this share where the network lane has acted in full for long.
    pub astray_share: f32,
    /// What swings may be this many times the model's validated RMS in addition.
    pub astray_floor: f32,
    /// A feedback lane whose part of the response swings by less than this share of the error does not trip astray: it does not
    /// drive it.
    pub astray_cause: f32,
    /// The energies of what swings are exponentially weighted means with this time constant, s.
    pub astray_s: f32,
    /// The network lane has acted in full for long after several times this time constant, s.
    pub relied_s: f32,
    /// The feedback lane stays off after this many trips astray, until it is armed again.
    pub astray_trips: u16,
}

impl GuardSettings {
    /// No guard.
    pub const OFF: Self = Self { enabled: false, ..Self::DEFAULT };

    /// All zeros: what stands in the place of settings until a model comes.
    pub(super) const NONE: Self = Self {
        enabled: false,
        hold_s: 0.0,
        handover_s: 0.0,
        envelope_margin: 0.0,
        envelope_floor: 0.0,
        window_margin: 0.0,
        envelope_ticks: 0,
        stale_s: 0.0,
        saturated_share: 0.0,
        saturated_s: 0.0,
        saturated_trips: 0,
        late_in_a_row: 0,
        counterfactual_factor: 0.0,
        assisted_factor: 0.0,
        counterfactual_floor: 0.0,
        counterfactual_share: 0.0,
        counterfactual_s: 0.0,
        long_term_s: 0.0,
        counterfactual_trips: 0,
        oscillation_swing: 0.0,
        oscillation_turns: 0.0,
        oscillation_power: 0.0,
        oscillation_s: 0.0,
        oscillation_trips: 0,
        swing_s: 0.0,
        swing_onset: 0.0,
        swing_start: 0.0,
        swing_recovery_s: 0.0,
        astray_left: 0.0,
        astray_trip: 0.0,
        astray_factor: 0.0,
        astray_share: 0.0,
        astray_floor: 0.0,
        astray_cause: 0.0,
        astray_s: 0.0,
        relied_s: 0.0,
        astray_trips: 0,
    };

    const DEFAULT: Self = Self {
        enabled: true,
        hold_s: 2.0,
        handover_s: 0.15,
        envelope_margin: 0.5,
        envelope_floor: 0.02,
        window_margin: 0.1,
        envelope_ticks: 5,
        stale_s: 0.1,
        saturated_share: 0.5,
        saturated_s: 1.0,
        saturated_trips: 3,
        late_in_a_row: 5,
        counterfactual_factor: 1.2,
        assisted_factor: 2.0,
        counterfactual_floor: 2.5,
        counterfactual_share: 0.15,
        counterfactual_s: 0.15,
        long_term_s: 4.0,
        counterfactual_trips: 3,
        oscillation_swing: 1.9,
        oscillation_turns: 6.0,
        oscillation_power: 0.8,
        oscillation_s: 0.5,
        oscillation_trips: 1,
        swing_s: 0.1,
        swing_onset: 0.7,
        swing_start: 0.3,
        swing_recovery_s: 2.0,
        astray_left: 0.7,
        astray_trip: 1.7,
        astray_factor: 1.0,
        astray_share: 0.3,
        astray_floor: 0.6,
        astray_cause: 0.3,
        astray_s: 0.2,
        relied_s: 1.0,
        astray_trips: 2,
    };
}

impl Default for GuardSettings {
    fn default() -> Self {
        Self::DEFAULT
    }
}
