//! Counterfactual monitor: what the error would be without a lane.
//!
//! *in* the loop's errors and what each lane contributed to the correction, at every reference tick; *out* whether a lane does
//! harm; *never* a number that is not finite; *source* a linear model of the loop's response, identified from logs with dither.
//!
//! Round calm flight the loop is linear: the error without a lane is the error less G u, with the lane's contribution u and the
//! response G of the measured channel to the correction, which the model stores ([`Monitor`]).
//!
//! The feedback lane answers for the error with it against that without it. What the network lane asks for does not depend on
//! what is measured, or hardly, while the feedback lane would also answer to the network's mistakes: so the network is judged on
//! what it would do without the feedback lane and in full, against no add-on at all, also while it is faded out: it comes back
//! when it would do good.

use super::{
    GuardSettings, Monitor,
    observation::Outcome,
    swing::{LATER, Parts, Swing},
    watch::ewma_gain,
};
use crate::{
    format::{DEFAULT_AXES, Floats, MAX_INPUTS, MAX_TAPS},
    math::{clamp, finite_or_zero},
};

/// Bound of the errors that are believed.
const LARGEST: f32 = 1e9;

/// One signal over the last monitor ticks.
#[derive(Clone, Copy, Debug)]
struct Past {
    ring: [f32; MAX_TAPS],
    sum: f32,
}

impl Past {
    const EMPTY: Self = Self { ring: [0.0; MAX_TAPS], sum: 0.0 };

    /// Ends a monitor tick with this mean, which is the newest; `head` is its place in the ring.
    fn close(&mut self, head: usize, mean: f32) -> f32 {
        let newest = finite_or_zero(self.sum * mean);
        self.sum = 0.0;
        if let Some(place) = self.ring.get_mut(head) {
            *place = newest;
        }
        newest
    }

    /// The response to this signal.
    fn response(&self, response: Floats<'_>, head: usize) -> f32 {
        let ring = self.ring.get(..response.len()).unwrap_or_default();
        let Some((newer, older)) = ring.split_at_checked(head) else { return 0.0 };
        // From the newest on, which is the first of the upper part.
        let (near, far) = response.split_at(older.len());
        dot(far, newer, dot(near, older, 0.0))
    }
}

/// What was added to one input: the network's part, the feedback lane's, and what the network would add to its part in full and
/// without the other.
#[derive(Clone, Copy, Debug)]
struct Contributions {
    pasts: [Past; 3],
    /// Monitor ticks for which the loop still responds to each: as many as there are taps while it is other than zero.
    left: [u8; 3],
}

impl Contributions {
    const EMPTY: Self = Self { pasts: [Past::EMPTY; 3], left: [0; 3] };

    /// Ends a monitor tick and returns the responses.
    fn respond(&mut self, response: Floats<'_>, head: usize, mean: f32) -> [f32; 3] {
        let mut responses = [0.0; 3];
        for ((past, left), answer) in self.pasts.iter_mut().zip(&mut self.left).zip(&mut responses) {
            let newest = past.close(head, mean);
            // There are at most MAX_TAPS, which a u8 holds.
            *left = if newest == 0.0 { left.saturating_sub(1) } else { response.len() as u8 };
            if *left > 0 {
                *answer = past.response(response, head);
            }
        }
        responses
    }
}

fn dot(coefficients: Floats<'_>, values: &[f32], start: f32) -> f32 {
    coefficients.iter().zip(values).fold(start, |sum, (coefficient, value)| sum + coefficient * value)
}

/// Recent energies of the loop's errors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Energies {
    /// As they are.
    pub with: f32,
    /// Without the feedback lane.
    pub without_feedback: f32,
    /// With the network lane only, in full.
    pub network_only: f32,
    /// Without any correction.
    pub baseline: f32,
    /// The same over a longer time: the long-term baseline.
    pub long_term_baseline: f32,
}

/// Errors with and without the lanes.
#[derive(Clone, Debug)]
pub struct Counterfactual<const A: usize = DEFAULT_AXES> {
    /// Reference ticks in the running monitor tick.
    phase: u16,
    /// Place of the next newest in the rings.
    head: usize,
    errors: [f32; A],
    /// Of each axis and input.
    contributions: [[Contributions; MAX_INPUTS]; A],
    /// Of each axis what is desired: of the reference channels that move it,
    references: [[Past; MAX_INPUTS]; A],
    /// and of the axis itself at the time of the measurement.
    desired: [f32; A],
    /// What the loop made of the feedback lane's part in the last monitor ticks, newest first.
    before: [[f32; LATER]; A],
    energies: Energies,
    harmful: [bool; 2],
    /// What swings.
    swing: Swing<A>,
    /// Something was added since the start, or since all was forgotten.
    busy: bool,
}

impl<const A: usize> Counterfactual<A> {
    /// Nothing seen yet: all zeros.
    pub(super) const NONE: Self = Self {
        phase: 0,
        head: 0,
        errors: [0.0; A],
        contributions: [[Contributions::EMPTY; MAX_INPUTS]; A],
        references: [[Past::EMPTY; MAX_INPUTS]; A],
        desired: [0.0; A],
        before: [[0.0; LATER]; A],
        energies: Energies { with: 0.0, without_feedback: 0.0, network_only: 0.0, baseline: 0.0, long_term_baseline: 0.0 },
        harmful: [false; 2],
        swing: Swing::NONE,
        busy: false,
    };

    /// Recent energies, the squares of the errors' unit, added over the axes.
    pub fn energies(&self) -> Energies {
        self.energies
    }

    /// Whether the network and the feedback lane do harm.
    pub(super) fn harmful(&self) -> [bool; 2] {
        self.harmful
    }

    /// What swings, and what the feedback lane does against it.
    pub(super) fn swing(&self) -> &Swing<A> {
        &self.swing
    }

    /// Forgets everything: no lane has acted for long, or ticks are missing.
    pub(super) fn reset(&mut self) {
        if !self.busy {
            return;
        }
        // In place: as a whole it would be 3 KB of the control task's stack.
        for contributions in self.contributions.iter_mut().flatten() {
            *contributions = Contributions::EMPTY;
        }
        for past in self.references.iter_mut().flatten() {
            *past = Past::EMPTY;
        }
        (self.phase, self.head, self.errors, self.desired) = (0, 0, [0.0; A], [0.0; A]);
        (self.energies, self.harmful, self.busy) = (Energies::default(), [false; 2], false);
        (self.swing, self.before) = (Swing::NONE, [[0.0; LATER]; A]);
    }

    /// Adds a reference tick with the errors of the monitor's axes.
    pub(super) fn observe<const O: usize>(
        &mut self,
        monitor: &Monitor<'_, A>,
        seen: &Outcome<O, A>,
        settings: &GuardSettings,
        rate_hz: f32,
    ) {
        let shares = &seen.shares;
        self.swing.rely(seen.network, seen.active, settings, 1.0 / rate_hz);
        let believed = |value: f32| clamp(finite_or_zero(value), -LARGEST, LARGEST);
        if !self.busy {
            // As if what is desired now had been desired for long.
            for (pasts, values) in self.references.iter_mut().zip(&seen.references) {
                for (past, value) in pasts.iter_mut().zip(values) {
                    past.ring = [believed(*value); MAX_TAPS];
                }
            }
        }
        self.busy = true;
        for (sum, error) in self.errors.iter_mut().zip(&seen.errors) {
            *sum += believed(*error);
        }
        for (sum, desired) in self.desired.iter_mut().zip(&seen.desired) {
            *sum += believed(*desired);
        }
        for (pasts, values) in self.references.iter_mut().zip(&seen.references) {
            for (past, value) in pasts.iter_mut().zip(values) {
                past.sum += believed(*value);
            }
        }
        let share = |shares: &[f32; O], output: u8| shares.get(usize::from(output)).copied().unwrap_or(0.0);
        for ((axis, _), contributions) in monitor.axes().iter().zip(&mut self.contributions) {
            for (&output, contributions) in axis.inputs.iter().zip(contributions) {
                let [network, feedback, more] = &mut contributions.pasts;
                let acted = share(&shares.network, output);
                network.sum += acted;
                feedback.sum += share(&shares.feedback, output);
                more.sum += share(&shares.network_only, output) - acted;
            }
        }
        self.phase = self.phase.saturating_add(1);
        if self.phase >= monitor.divisor() {
            self.phase = 0;
            self.close(monitor, settings, rate_hz);
        }
    }

    /// Ends a monitor tick. What else a tick does needs none of its stack.
    #[inline(never)]
    fn close(&mut self, monitor: &Monitor<'_, A>, settings: &GuardSettings, rate_hz: f32) {
        let ticks = f32::from(monitor.divisor());
        let mean = 1.0 / ticks;
        self.head = if self.head == 0 { monitor.taps().saturating_sub(1) } else { self.head - 1 };
        let mut now = Energies::default();
        let (mut swung, seconds): (Parts, f32) = ([0.0; 5], ticks / rate_hz);
        let [mut acts, mut assisted] = [false; 2];
        let desired = self.references.iter_mut().zip(&mut self.desired).zip(&mut self.before);
        let axes = monitor.axes().iter().zip(&mut self.contributions).zip(&mut self.errors).zip(desired);
        for (place, ((((axis, response), contributions), error), ((references, desired), before))) in axes.enumerate() {
            let with = *error * mean;
            *error = 0.0;
            // Relative to what is desired now: a response that ends too early is no error that grows with the position.
            let mut nominal = -*desired * mean;
            *desired = 0.0;
            let [mut network, mut feedback, mut more] = [0.0; 3];
            let mut rest = *response;
            let inputs = axis.inputs.iter().zip(contributions).zip(references.iter_mut().enumerate());
            for ((_, contributions), (index, reference)) in inputs {
                let (taps, others) = rest.split_at(monitor.taps());
                rest = others;
                let present = reference.sum * mean;
                reference.close(self.head, mean);
                nominal += reference.response(taps, self.head);
                if index == 0 {
                    nominal += present * (1.0 - taps.iter().sum::<f32>());
                }
                let responses = contributions.respond(taps, self.head, mean);
                acts |= usize::from(contributions.left[0]) == monitor.taps();
                // As long as the loop responds to it.
                assisted |= contributions.left[1] > 0;
                network += responses[0];
                feedback += responses[1];
                more += responses[2];
            }
            let unaided = with - feedback;
            now.with += with * with;
            now.without_feedback += unaided * unaided;
            now.network_only += (unaided + more) * (unaided + more);
            now.baseline += (unaided - network) * (unaided - network);
            let parts = [with, unaided, feedback, nominal, with - before[LATER - 1]];
            self.swing.add(place, &parts, settings, seconds, &mut swung);
            before.rotate_right(1);
            before[0] = feedback;
        }
        let weight = |seconds: f32| ewma_gain(ticks / (seconds * rate_hz));
        let recent = weight(settings.counterfactual_s);
        let past = &mut self.energies;
        for (energy, now, weight) in [
            (&mut past.with, now.with, recent),
            (&mut past.without_feedback, now.without_feedback, recent),
            (&mut past.network_only, now.network_only, recent),
            (&mut past.baseline, now.baseline, recent),
            (&mut past.long_term_baseline, now.baseline, weight(settings.long_term_s)),
        ] {
            *energy = finite_or_zero(*energy + (now - *energy) * weight);
        }
        let floor = settings.counterfactual_floor * monitor.validated_rms();
        let worse = |with: f32, without: f32, factor: f32| with > factor * factor * without + floor * floor;
        // What the network does wrong the feedback lane mends, as far as it can be mended.
        let factor = if assisted { settings.assisted_factor } else { settings.counterfactual_factor };
        let baseline = if past.long_term_baseline > past.baseline { past.long_term_baseline } else { past.baseline };
        let share = settings.counterfactual_share * settings.counterfactual_share * baseline;
        // While the network acts, what is measured must be worse too.
        let network = worse(past.network_only, baseline, factor) && (!acts || worse(past.with, baseline, factor));
        self.harmful = [network, worse(past.with, past.without_feedback + share, settings.counterfactual_factor)];
        self.swing.observe(&swung, monitor.validated_rms(), settings, seconds);
    }
}
