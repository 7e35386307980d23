//! The guard: decides, beside what the user wants, which lanes may act.
//!
//! *in* what is wrong at each reference tick: inputs, inferences, corrections, evidence; *out* the lanes that may act, counts by reason and
//! by lane; *never* more than one trip of a lane in a hold time, never a lane on its way back while its cause lasts; *source* ours, for a
//! Simplex architecture (Sha 2001): a simple loop that is trusted, a complex one that is watched.
//!
//! A lane that trips is handed over by fade, and comes back by fade when its cause has been absent for the hold time. A lane that the
//! evidence has spoken against several times stays off until it is armed again.

mod evidence;
mod monitor;
mod oscillation;
mod settings;
mod watch;

use crate::{
    adapter::Lanes,
    math::abs,
    model::{Floats, LaneLayout, MAX_AXES},
};

pub use evidence::Evidence;
pub(crate) use evidence::Shares;
pub use monitor::Monitor;
use oscillation::Oscillation;
pub use settings::GuardSettings;
use watch::{Watch, leak};

/// Why a lane is off although it is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
pub enum Trip {
    /// Features outside of the training envelope (network lane).
    Envelope = 0,
    /// A measured or desired channel that is no finite number (both lanes).
    NotFinite = 1,
    /// A measurement that is too old (both lanes).
    Stale = 2,
    /// A correction at its limit or slew for too long (each lane that asks for more).
    Saturated = 3,
    /// The loop would track better without the lane (each lane by itself).
    Evidence = 4,
    /// Inferences that come too late (network lane).
    Late = 5,
    /// A limit cycle (feedback lane).
    Oscillation = 6,
}

impl Trip {
    /// All reasons, in the order of their indices.
    pub const ALL: [Self; 7] =
        [Self::Envelope, Self::NotFinite, Self::Stale, Self::Saturated, Self::Evidence, Self::Late, Self::Oscillation];

    /// Index in [`Trips`]; the same in every version.
    pub fn index(self) -> usize {
        self as usize
    }

    /// Name for tables and telemetry.
    pub fn name(self) -> &'static str {
        match self {
            Self::Envelope => "envelope",
            Self::NotFinite => "not_finite",
            Self::Stale => "stale",
            Self::Saturated => "saturated",
            Self::Evidence => "evidence",
            Self::Late => "late",
            Self::Oscillation => "oscillation",
        }
    }
}

/// Trips since the start, by [`Trip::index`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Trips {
    /// Of the network lane.
    pub network: [u16; Trip::ALL.len()],
    /// Of the feedback lane.
    pub feedback: [u16; Trip::ALL.len()],
}

impl Trips {
    /// None.
    pub const NONE: Self = Self { network: [0; Trip::ALL.len()], feedback: [0; Trip::ALL.len()] };

    /// Trips of the network lane and of the feedback lane.
    pub fn by_lane(&self) -> [u16; 2] {
        [self.network, self.feedback].map(|lane| lane.iter().fold(0, |sum, count| count.saturating_add(sum)))
    }

    /// Trips of both lanes for a reason.
    pub fn of(&self, trip: Trip) -> u16 {
        let count = |lane: &[u16]| lane.get(trip.index()).copied().unwrap_or(0);
        count(&self.network).saturating_add(count(&self.feedback))
    }
}

/// What one reference tick found wrong, beside the evidence.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Findings {
    /// A channel of this tick is no finite number.
    pub(crate) not_finite: bool,
    /// Inferences in a row that came too late.
    pub(crate) late: u16,
}

/// Decides which lanes may act.
#[derive(Clone, Debug)]
pub struct Guard {
    settings: GuardSettings,
    /// Reference ticks in a second.
    rate_hz: f32,
    network: Watch,
    feedback: Watch,
    /// Reference ticks since the newest measurement was taken or arrived.
    age: u16,
    /// Sub-rate ticks in a row with features outside of the envelope.
    outside: u16,
    /// Recent share of ticks in which each lane asked for more than the bounds let pass.
    excess: [f32; 2],
    oscillation: Oscillation,
    evidence: Evidence,
    trips: Trips,
}

impl Guard {
    /// A guard without a loop, which has seen nothing: all zeros, so that a static with it takes no flash.
    pub(crate) const VACANT: Self = Self {
        settings: GuardSettings::NONE,
        rate_hz: 0.0,
        network: Watch::ARMED,
        feedback: Watch::ARMED,
        age: 0,
        outside: 0,
        excess: [0.0; 2],
        oscillation: Oscillation::NONE,
        evidence: Evidence::NONE,
        trips: Trips::NONE,
    };

    /// Makes this, in its place, a guard that has seen nothing yet, of a loop with this many reference ticks in a second.
    pub(crate) fn tie(&mut self, settings: GuardSettings, rate_hz: f32) {
        (self.settings, self.rate_hz) = (settings, rate_hz);
        self.renew();
    }

    /// Forgets everything but the settings.
    pub(crate) fn renew(&mut self) {
        self.trips = Trips::NONE;
        self.land();
    }

    /// Other settings; what was seen and counted stays.
    pub(crate) fn set(&mut self, settings: GuardSettings) {
        self.settings = settings;
        if !settings.enabled {
            self.rearm();
        }
    }

    /// Forgets everything but the settings and the counts: the vehicle has landed.
    pub(crate) fn land(&mut self) {
        self.rearm();
        (self.age, self.outside) = (0, 0);
        self.restart();
    }

    /// Of the lanes wanted those that may act.
    pub fn allowed(&self, wanted: Lanes) -> Lanes {
        Lanes { network: wanted.network && !self.network.tripped(), feedback: wanted.feedback && !self.feedback.tripped() }
    }

    /// Trips since the start.
    pub fn trips(&self) -> Trips {
        self.trips
    }

    /// The evidence so far.
    pub fn evidence(&self) -> &Evidence {
        &self.evidence
    }

    /// Lets every lane act again at once; what is still wrong will trip it again.
    pub fn rearm(&mut self) {
        (self.network, self.feedback) = (Watch::ARMED, Watch::ARMED);
    }

    /// A lane that is switched off needs no arming when it is switched on again.
    pub(crate) fn switched(&mut self, wanted: Lanes) {
        for (watch, wanted) in [(&mut self.network, wanted.network), (&mut self.feedback, wanted.feedback)] {
            if !wanted {
                watch.unlock();
            }
        }
    }

    /// Tells how old the newest measurement is, reference ticks beyond the model's delay.
    pub(crate) fn set_age(&mut self, ticks: u16) {
        self.age = ticks;
    }

    /// Least change of weight in a reference tick of a lane that trips.
    pub(crate) fn handover_step(&self) -> f32 {
        leak(1.0 / (self.settings.handover_s * self.rate_hz))
    }

    /// Forgets the evidence: no lane acts, or ticks are missing.
    pub(crate) fn restart(&mut self) {
        self.evidence.restart();
        self.excess = [0.0; 2];
        self.oscillation = Oscillation::NONE;
    }

    /// Takes the features of a sub-rate tick and the box of those in training.
    pub(crate) fn features(&mut self, features: &[f32], (low, high): &(Floats<'_>, Floats<'_>)) {
        let margin = self.settings.envelope_margin;
        let inside = |((low, high), &feature): ((f32, f32), &f32)| {
            let slack = margin * (high - low) + self.settings.envelope_floor;
            // Written so that what is no number is outside.
            feature >= low - slack && feature <= high + slack
        };
        let all = low.iter().zip(high.iter()).zip(features).all(inside);
        self.outside = if all { 0 } else { self.outside.saturating_add(1) };
    }

    /// The network lane is not evaluated: nothing is known of its features.
    pub(crate) fn no_features(&mut self) {
        self.outside = 0;
    }

    /// Judges a reference tick before the lanes act.
    pub(crate) fn judge(&mut self, wanted: Lanes, findings: Findings) {
        if !self.settings.enabled {
            return;
        }
        let settings = &self.settings;
        let stale = f32::from(self.age) > settings.stale_s * self.rate_hz;
        let outside = self.outside >= settings.envelope_ticks.max(1);
        let late = findings.late >= settings.late_in_a_row.max(1);
        let [network_excess, feedback_excess] = self.excess.map(|share| share > settings.saturated_share);
        let [network_harms, feedback_harms] = self.evidence.harmful();
        let swings = self.oscillation.present(settings);
        let first = |causes: [(bool, Trip); 7]| causes.into_iter().find(|(present, _)| *present).map(|(_, trip)| trip);
        let cause = |own: [bool; 5]| {
            let [outside, late, swings, excess, harms] = own;
            first([
                (findings.not_finite, Trip::NotFinite),
                (stale, Trip::Stale),
                (outside, Trip::Envelope),
                (late, Trip::Late),
                (swings, Trip::Oscillation),
                (excess, Trip::Saturated),
                (harms, Trip::Evidence),
            ])
        };
        let network = cause([outside, late, false, network_excess, network_harms]).filter(|_| wanted.network);
        let feedback = cause([false, false, swings, feedback_excess, feedback_harms]).filter(|_| wanted.feedback);
        let hold = (settings.hold_s * self.rate_hz) as u32;
        let network = self.network.tick(network, hold, settings);
        let feedback = self.feedback.tick(feedback, hold, settings);
        for (trip, counts) in [(network, &mut self.trips.network), (feedback, &mut self.trips.feedback)] {
            if let Some(count) = trip.and_then(|trip| counts.get_mut(trip.index())) {
                *count = count.saturating_add(1);
            }
        }
    }

    /// Learns what the lanes did at a reference tick: of each whether it asked for more than the bounds let pass, and whether it acts.
    pub(crate) fn excess(&mut self, excess: [bool; 2]) {
        let decay = leak(1.0 / (self.settings.saturated_s * self.rate_hz));
        for (share, excess) in self.excess.iter_mut().zip(excess) {
            *share += (f32::from(u8::from(excess)) - *share) * decay;
        }
    }

    /// Learns what the feedback lane asks for on each axis at a reference tick; `None` while it is not to act.
    pub(crate) fn swing(&mut self, asked: Option<(&LaneLayout, &[f32; MAX_AXES])>) {
        match asked {
            Some((lane, wanted)) => self.oscillation.observe(lane, wanted, &self.settings, self.rate_hz),
            None => self.oscillation = Oscillation::NONE,
        }
    }

    /// Adds a reference tick to the evidence.
    pub(crate) fn observe(&mut self, monitor: &Monitor<'_>, errors: &[f32], shares: &Shares) {
        self.evidence.observe(monitor, errors, shares, &self.settings, self.rate_hz);
    }
}

/// Whether all channels are finite numbers.
pub(crate) fn finite(channels: &[f32]) -> bool {
    channels.iter().all(|channel| abs(*channel) < f32::INFINITY)
}
