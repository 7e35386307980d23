//! Settings of the guard, with defaults that were measured.

use serde::{Deserialize, Serialize};

/// When lanes trip and come back. Those of evidence and oscillation trip lanes in validation strokes only where
/// motors saturate (1.7 times the speed).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(default, deny_unknown_fields)]
pub struct GuardSettings {
    /// Whether the guard acts at all. Off for flights that judge what a lane does by itself.
    pub enabled: bool,
    /// Time for which a cause must be absent before its lane comes back, s.
    pub hold_s: f32,
    /// Time in which a lane that trips is faded out, s, if the model's own fade takes longer.
    pub handover_s: f32,
    /// Features may be this share of the training box' width outside of it,
    pub envelope_margin: f32,
    /// and this much besides, in the feature's unit: a box can be flat.
    pub envelope_floor: f32,
    /// Sub-rate ticks in a row outside that trip.
    pub envelope_ticks: u16,
    /// Age of the measurement beyond the model's delay that trips, s.
    pub stale_s: f32,
    /// Share of recent ticks in which a lane asks for more than limit and slew let pass that trips,
    pub saturated_share: f32,
    /// and the time constant of what is recent, s.
    pub saturated_s: f32,
    /// Late inferences in a row that trip.
    pub late_in_a_row: u16,
    /// The error with a lane may be this factor of what it would be without,
    pub evidence_factor: f32,
    /// with the network lane this one while the loop responds to the feedback lane too,
    pub assisted_factor: f32,
    /// and besides this many times what the model promises,
    pub evidence_floor: f32,
    /// and with the feedback lane this share of what it would be without any correction.
    pub evidence_share: f32,
    /// Time constant of the errors' energies, s,
    pub evidence_s: f32,
    /// and of the usual error without any correction, below which none counts as small, s.
    pub usual_s: f32,
    /// Trips by evidence after which a lane stays off until it is armed again.
    pub evidence_trips: u16,
    /// The feedback lane makes a turn when it comes back from its farthest value by this many times its fast clamp, of 2 at most;
    pub oscillation_swing: f32,
    /// it oscillates at more turns than this
    pub oscillation_turns: f32,
    /// and more than this mean square, all axes added, in squares of their fast clamps,
    pub oscillation_power: f32,
    /// both forgotten with this time constant, s.
    pub oscillation_s: f32,
    /// Trips by oscillation after which the lane stays off until it is armed again: each return would swing again.
    pub oscillation_trips: u16,
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
        envelope_ticks: 0,
        stale_s: 0.0,
        saturated_share: 0.0,
        saturated_s: 0.0,
        late_in_a_row: 0,
        evidence_factor: 0.0,
        assisted_factor: 0.0,
        evidence_floor: 0.0,
        evidence_share: 0.0,
        evidence_s: 0.0,
        usual_s: 0.0,
        evidence_trips: 0,
        oscillation_swing: 0.0,
        oscillation_turns: 0.0,
        oscillation_power: 0.0,
        oscillation_s: 0.0,
        oscillation_trips: 0,
    };

    const DEFAULT: Self = Self {
        enabled: true,
        hold_s: 2.0,
        handover_s: 0.15,
        envelope_margin: 0.5,
        envelope_floor: 0.02,
        envelope_ticks: 5,
        stale_s: 0.1,
        saturated_share: 0.5,
        saturated_s: 1.0,
        late_in_a_row: 5,
        evidence_factor: 1.2,
        assisted_factor: 2.0,
        evidence_floor: 2.5,
        evidence_share: 0.15,
        evidence_s: 0.15,
        usual_s: 4.0,
        evidence_trips: 3,
        oscillation_swing: 1.9,
        oscillation_turns: 6.0,
        oscillation_power: 0.8,
        oscillation_s: 0.5,
        oscillation_trips: 1,
    };
}

impl Default for GuardSettings {
    fn default() -> Self {
        Self::DEFAULT
    }
}
