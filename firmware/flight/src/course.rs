//! The trajectory that the vehicle flies, made from what a sender says of it.
//!
//! *in* setpoints with their ticks, re-plans and brakes; *out* setpoints of the flight stack, one for each reference tick;
//! *never* a jump of the position from one tick to the next that the sender did not ask for with setpoints that came in time;
//! *source* [`crate::motion`].
//!
//! | what arrives | what is flown |
//! |---|---|
//! | a setpoint after a gap ahead of the present | a straight line fills the gap, the shortest way round in yaw |
//! | one after the trajectory had ended (it starved) | more than [`RESUMES`] m away: blended, as a re-plan |
//! | one for a tick that was flown without it | refused, with the tick that is expected |
//! | a re-plan from tick T on | what is stored before T; from there the difference to the new one fades within the limits |
//! | brake | to rest within the limits, then rest; setpoints are refused until a re-plan |

use crate::{
    flight::{Flight, PREVIEW},
    link::Reason,
    motion::{Blend, Brake, MotionLimits, between},
    types::Setpoint,
};

/// A trajectory that had ended goes on at once if it does so within this distance, m: what a vehicle moves while a few setpoints
/// are lost.
pub const RESUMES: f32 = 0.1;

/// Samples ahead of the present that a brake states: more than a model looks at, and some of the past stay.
const AHEAD: i32 = 128;

/// Where the flight is.
#[derive(Clone, Copy, Debug)]
pub struct Now {
    /// Reference tick that is flown next, or is being flown.
    pub tick: i32,
    /// The last one that was flown, if one was.
    pub flown: Option<i32>,
    /// Seconds from one to the next.
    pub period: f32,
}

impl Now {
    /// How many setpoints can be stored from this tick on. Before the first tick there is no past to keep.
    fn room(&self, flight: &Flight<'_>) -> i32 {
        if self.flown.is_some() { flight.room() } else { PREVIEW as i32 }
    }
}

/// Why a setpoint was not taken. Nothing changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The vehicle brakes, or rests where it has braked: only a re-plan goes on.
    Braking,
    /// The tick has been flown, or lies further ahead than the preview keeps.
    Tick {
        /// The next one that can be taken.
        expected: i32,
    },
    /// The preview is full: one more would push out what is still to be flown or looked back at.
    Full {
        /// The tick that can be taken after the next reference tick.
        expected: i32,
    },
}

impl From<Refusal> for Reason {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::Braking => Self::Braking,
            Refusal::Tick { expected } | Refusal::Full { expected } => Self::Setpoint { expected },
        }
    }
}

/// Where setpoints come from.
#[derive(Clone, Copy, Debug)]
enum Plan {
    /// From the sender, as they are.
    Follow,
    /// From the sender, with what is left of the difference to what was flown at a tick.
    Blend { start: i32, blend: Blend },
    /// From a brake that began at a tick.
    Brake { start: i32, brake: Brake },
}

/// The trajectory's source, and its newest setpoint.
#[derive(Clone, Copy, Debug)]
pub struct Course {
    plan: Plan,
    newest: Setpoint,
    /// `None`: [`MotionLimits::DEFAULT`], so that a static with it is all zeros.
    limits: Option<MotionLimits>,
}

impl Course {
    /// Of no trajectory.
    pub const NONE: Self = Self { plan: Plan::Follow, newest: Setpoint::ORIGIN, limits: None };

    /// How fast the vehicle is moved by itself; `false`, and nothing changes, if no vehicle can be moved so.
    pub fn limit(&mut self, limits: MotionLimits) -> bool {
        let physical = limits.is_physical();
        if physical {
            self.limits = Some(limits);
        }
        physical
    }

    /// For the next flight.
    pub fn reset(&mut self) {
        (self.plan, self.newest) = (Plan::Follow, Setpoint::ORIGIN);
    }

    /// Appends a sample of the desired trajectory, and what was lost before it. A tick that is stored already changes nothing.
    ///
    /// # Errors
    /// While it brakes, or if the tick has been flown or is too far ahead.
    // Apart from the other commands, which need none of its stack.
    #[inline(never)]
    pub fn follow(&mut self, flight: &mut Flight<'_>, now: &Now, tick: i32, setpoint: &Setpoint) -> Result<(), Refusal> {
        if matches!(self.plan, Plan::Brake { .. }) {
            return Err(Refusal::Braking);
        }
        let next = flight.next_setpoint();
        let gap = tick.wrapping_sub(next);
        if gap < 0 {
            // A copy, or overtaken; but what is older than anything that can be stored is of a sender that started again.
            return if gap < -(PREVIEW as i32) { Err(Refusal::Tick { expected: next }) } else { Ok(()) };
        }
        // What lies further ahead would push out the present, or what is still looked back at.
        if tick.wrapping_sub(now.tick) >= now.room(flight) || (next == 0 && gap > 0) {
            return Err(Refusal::Tick { expected: next });
        }
        if let Some(flown) = now.flown
            && flown.wrapping_sub(next) >= 0
        {
            if tick.wrapping_sub(flown) <= 0 {
                return Err(Refusal::Tick { expected: flown.wrapping_add(1) });
            }
            if (setpoint.position - self.newest.position).norm() > RESUMES {
                return self.replan(flight, now, tick, setpoint);
            }
            self.fill(flight, flown.wrapping_add(1));
        }
        let seen = self.seen(tick, setpoint, now.period);
        let gap = tick.wrapping_sub(flight.next_setpoint());
        let start = self.newest;
        for missing in 1..=gap {
            let share = missing as f32 / (gap + 1) as f32;
            self.push(flight, &between(&start, &seen, share));
        }
        self.push(flight, &seen);
        Ok(())
    }

    /// Appends a sample of the desired trajectory for the tick after the last one, as it is.
    ///
    /// # Errors
    /// While it brakes, or if the preview is full.
    pub fn append(&mut self, flight: &mut Flight<'_>, now: &Now, setpoint: &Setpoint) -> Result<(), Refusal> {
        if self.braking() {
            return Err(Refusal::Braking);
        }
        let next = flight.next_setpoint();
        if next.wrapping_sub(now.tick) >= now.room(flight) {
            return Err(Refusal::Full { expected: next });
        }
        let seen = self.seen(next, setpoint, now.period);
        self.push(flight, &seen);
        Ok(())
    }

    /// Replaces what is stored from a tick on; the sample is the new trajectory's first. It ends a brake.
    ///
    /// # Errors
    /// If the tick has been flown or is too far ahead.
    pub fn replan(&mut self, flight: &mut Flight<'_>, now: &Now, tick: i32, setpoint: &Setpoint) -> Result<(), Refusal> {
        let first = now.flown.map_or(0, |flown| flown.wrapping_add(1));
        let ahead = tick.wrapping_sub(first);
        if ahead < 0 || tick.wrapping_sub(now.tick) >= now.room(flight) || (flight.next_setpoint() == 0 && ahead > 0) {
            return Err(Refusal::Tick { expected: first });
        }
        let before = tick.wrapping_sub(1);
        self.fill(flight, tick);
        if tick == 0 && now.flown.is_none() {
            // On the ground there is nothing that it has to fit to.
            flight.clear_setpoints(0);
            self.plan = Plan::Follow;
        } else {
            let old = flight.setpoint(before);
            flight.replace_setpoints(tick);
            let back = Setpoint { position: setpoint.position - setpoint.velocity * now.period, ..*setpoint };
            let blend = Blend::new(&old, &back, self.limits.as_ref().unwrap_or(&MotionLimits::DEFAULT));
            self.plan = Plan::Blend { start: before, blend };
            self.newest = old;
        }
        let seen = self.seen(tick, setpoint, now.period);
        self.push(flight, &seen);
        Ok(())
    }

    /// Replaces what is stored after the present by coming to rest.
    pub fn brake(&mut self, flight: &mut Flight<'_>, now: &Now) {
        if matches!(self.plan, Plan::Brake { .. }) {
            return;
        }
        let start = now.flown.unwrap_or(0);
        self.fill(flight, start.wrapping_add(1));
        let from = flight.setpoint(start);
        let brake = Brake::new(&from, self.limits.as_ref().unwrap_or(&MotionLimits::DEFAULT));
        flight.replace_setpoints(start.wrapping_add(1));
        (self.plan, self.newest) = (Plan::Brake { start, brake }, from);
        self.keep_up(flight, now);
    }

    /// Goes on with a brake as time does.
    pub fn keep_up(&mut self, flight: &mut Flight<'_>, now: &Now) {
        let Plan::Brake { start, brake } = self.plan else { return };
        // A trajectory that has begun anew is shorter than the preview; the bound is for a tick that jumps.
        for _ in 0..PREVIEW {
            let next = flight.next_setpoint();
            if next.wrapping_sub(now.tick) >= AHEAD {
                return;
            }
            self.push(flight, &brake.at(next.wrapping_sub(start) as f32 * now.period));
        }
    }

    /// Whether the vehicle brakes, or rests where it has braked.
    pub fn braking(&self) -> bool {
        matches!(self.plan, Plan::Brake { .. })
    }

    /// Writes down what was held, so that the next setpoint is that of `tick`, unless it is that of a later one.
    fn fill(&mut self, flight: &mut Flight<'_>, tick: i32) {
        let missing = tick.wrapping_sub(flight.next_setpoint());
        if missing <= 0 {
            return;
        }
        let held = Setpoint { position: self.newest.position, yaw: self.newest.yaw, ..Setpoint::ORIGIN };
        if missing >= PREVIEW as i32 {
            // For so long that nothing of the trajectory is left.
            flight.clear_setpoints(tick.wrapping_sub(1));
        }
        for _ in 0..missing.min(PREVIEW as i32) {
            if flight.next_setpoint() == tick {
                return;
            }
            self.push(flight, &held);
        }
    }

    /// What is flown of the sender's setpoint for a tick.
    fn seen(&mut self, tick: i32, setpoint: &Setpoint, period: f32) -> Setpoint {
        let Plan::Blend { start, blend } = self.plan else { return *setpoint };
        let seconds = tick.wrapping_sub(start) as f32 * period;
        if seconds >= blend.duration() {
            self.plan = Plan::Follow;
        }
        blend.apply(seconds, setpoint)
    }

    /// Appends a sample. One that no vehicle can be asked for, as may come of two that it can be, is a missed one.
    fn push(&mut self, flight: &mut Flight<'_>, setpoint: &Setpoint) {
        if flight.push_setpoint(setpoint) {
            self.newest = *setpoint;
        } else {
            flight.push_setpoint(&self.newest);
        }
    }
}
