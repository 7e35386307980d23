//! The guard: decides, beside what the user wants, which lanes may act.
//!
//! *in* what is wrong at each reference tick: inputs, inferences, corrections, errors; *out* the lanes that may act, counts by
//! reason and by lane; *never* more than one trip of a lane in a hold time, never a lane on its way back while its cause lasts;
//! *source* the Simplex architecture (Sha 2001): a simple loop that is trusted, a complex one that is watched.
//!
//! A lane that trips is handed over by fade, and comes back by fade when its cause has been absent for the hold time. A lane that
//! has tripped several times by what it is itself to blame for (saturated, harm, oscillation, astray) stays off until it is armed
//! again. The feedback lane acts less before it trips astray.

mod counterfactual;
mod monitor;
mod observation;
mod oscillation;
mod settings;
mod swing;
mod trip;
mod watch;

use crate::{format::DEFAULT_AXES, lanes::Lanes};

pub use counterfactual::Counterfactual;
pub use monitor::Monitor;
pub(crate) use observation::{Features, Observation, Outcome, Shares, Verdict};
use oscillation::Oscillation;
pub use settings::GuardSettings;
pub use trip::{Trip, Trips};
use watch::{Watch, ewma_gain};

/// Decides which lanes may act.
#[derive(Clone, Debug)]
pub struct Guard<const A: usize = DEFAULT_AXES> {
    settings: GuardSettings,
    /// Reference ticks in a second.
    rate_hz: f32,
    network: Watch,
    feedback: Watch,
    /// Sub-rate ticks in a row with features outside of the envelope.
    outside: u16,
    /// Recent share of ticks in which each lane asked for more than the bounds let pass.
    excess: [f32; 2],
    oscillation: Oscillation<A>,
    counterfactual: Counterfactual<A>,
    trips: Trips,
}

impl<const A: usize> Guard<A> {
    /// A guard without a loop, which has seen nothing: all zeros, so that a static with it takes no flash.
    pub(crate) const EMPTY: Self = Self {
        settings: GuardSettings::NONE,
        rate_hz: 0.0,
        network: Watch::ARMED,
        feedback: Watch::ARMED,
        outside: 0,
        excess: [0.0; 2],
        oscillation: Oscillation::NONE,
        counterfactual: Counterfactual::NONE,
        trips: Trips::NONE,
    };

    /// Makes this, in its place, a guard that has seen nothing yet, of a loop with this many reference ticks in a second.
    pub(crate) fn load(&mut self, settings: GuardSettings, rate_hz: f32) {
        (self.settings, self.rate_hz) = (settings, rate_hz);
        self.restart();
    }

    /// As loaded: forgets what was seen, and the counts.
    pub(crate) fn restart(&mut self) {
        self.trips = Trips::NONE;
        self.reset();
    }

    /// Other settings; what was seen and counted stays.
    pub(crate) fn set(&mut self, settings: GuardSettings) {
        self.settings = settings;
        if !settings.enabled {
            self.rearm();
        }
    }

    /// Forgets what was seen; settings and counts stay.
    pub(crate) fn reset(&mut self) {
        self.rearm();
        self.outside = 0;
        self.clear();
    }

    /// Empties all that was learned of the lanes' doing.
    fn clear(&mut self) {
        self.counterfactual.reset();
        self.excess = [0.0; 2];
        self.oscillation = Oscillation::NONE;
    }

    /// Of the lanes wanted those that may act.
    pub fn allowed(&self, wanted: Lanes) -> Lanes {
        Lanes { network: wanted.network && !self.network.tripped(), feedback: wanted.feedback && !self.feedback.tripped() }
    }

    /// Share of the feedback lane that may act, 0..=1, where the model has a monitor: without one nobody knows what swings.
    pub fn feedback_share(&self) -> f32 {
        if self.settings.enabled { self.counterfactual.swing().share() } else { 1.0 }
    }

    /// Whether the loop swings more than it may after what is desired.
    pub(crate) fn swinging(&self) -> bool {
        self.counterfactual.swing().swinging()
    }

    /// Trips since the start.
    pub fn trips(&self) -> Trips {
        self.trips
    }

    /// The counterfactual monitor: errors with and without the lanes. It has seen every reference tick but the last.
    pub fn counterfactual(&self) -> &Counterfactual<A> {
        &self.counterfactual
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

    /// Settings in force.
    pub(crate) fn settings(&self) -> &GuardSettings {
        &self.settings
    }

    /// One reference tick, before the lanes act: learns what they did in the last one, then judges what is seen now.
    pub(crate) fn tick<const O: usize>(&mut self, seen: &Observation<'_, O, A>) -> Verdict {
        self.learn(seen);
        self.outside = match seen.features {
            Features::Unchanged => self.outside,
            Features::Unknown | Features::Inside => 0,
            Features::Outside => self.outside.saturating_add(1),
        };
        if self.settings.enabled {
            self.judge(seen);
        }
        let handover_step = ewma_gain(1.0 / (self.settings.handover_s * self.rate_hz));
        // Without a trajectory there is nothing to correct.
        let allowed = if seen.trajectory { self.allowed(seen.wanted) } else { Lanes::NONE };
        let share = if seen.monitor.is_some() { self.feedback_share() } else { 1.0 };
        Verdict { allowed, handover_step, share }
    }

    /// What the lanes did in the last reference tick. If none acted, or ticks are missing since, all that was learned is
    /// forgotten.
    fn learn<const O: usize>(&mut self, seen: &Observation<'_, O, A>) {
        let Some(last) = seen.last else {
            self.clear();
            return;
        };
        let settings = &self.settings;
        let decay = ewma_gain(1.0 / (settings.saturated_s * self.rate_hz));
        for (share, excess) in self.excess.iter_mut().zip(last.excess) {
            *share += (f32::from(u8::from(excess)) - *share) * decay;
        }
        match seen.lane.filter(|_| last.active) {
            Some(lane) => self.oscillation.observe(lane, &last.asked, settings, self.rate_hz),
            None => self.oscillation = Oscillation::NONE,
        }
        if let Some(monitor) = seen.monitor {
            self.counterfactual.observe(monitor, last, settings, self.rate_hz);
        }
    }

    /// Trips lanes and lets them come back.
    fn judge<const O: usize>(&mut self, seen: &Observation<'_, O, A>) {
        let settings = &self.settings;
        let late_by = settings.stale_s * self.rate_hz;
        let stale = f32::from(seen.age.saturating_add(seen.bad)) > late_by;
        // One bad sample is one missed sample.
        let not_finite = !seen.finite || f32::from(seen.bad) > late_by;
        let outside = self.outside >= settings.envelope_ticks.max(1);
        let late = seen.late >= settings.late_in_a_row.max(1);
        let [network_excess, feedback_excess] = self.excess.map(|share| share > settings.saturated_share);
        let [network_harms, feedback_harms] = self.counterfactual.harmful();
        let swings = self.oscillation.present(settings);
        // A lane that shook the loop comes back when the loop is calm. Until then what swings says nothing about the network.
        let swing = self.counterfactual.swing();
        let shaken = !swing.settled() && self.feedback.tripped_by(Trip::Astray);
        let astray = swing.astray() || shaken;
        let network_harms = network_harms && !shaken;
        let first = |causes: [(bool, Trip); 8]| causes.into_iter().find(|(present, _)| *present).map(|(_, trip)| trip);
        let cause = |own: [bool; 6]| {
            let [outside, late, swings, excess, harms, astray] = own;
            first([
                (not_finite, Trip::NotFinite),
                (stale, Trip::Stale),
                (outside, Trip::Envelope),
                (late, Trip::Late),
                (swings, Trip::Oscillation),
                (excess, Trip::Saturated),
                (harms, Trip::Counterfactual),
                (astray, Trip::Astray),
            ])
        };
        let network = cause([outside, late, false, network_excess, network_harms, false]).filter(|_| seen.wanted.network);
        let feedback = cause([false, false, swings, feedback_excess, feedback_harms, astray]).filter(|_| seen.wanted.feedback);
        let hold = (settings.hold_s * self.rate_hz) as u32;
        let network = self.network.tick(network, hold, settings);
        let feedback = self.feedback.tick(feedback, hold, settings);
        for (trip, counts) in [(network, &mut self.trips.network), (feedback, &mut self.trips.feedback)] {
            if let Some(count) = trip.and_then(|trip| counts.get_mut(trip.index())) {
                *count = count.saturating_add(1);
            }
        }
    }
}
