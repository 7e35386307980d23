//! How old the vehicle's knowledge of itself is.
//!
//! *in* the sender's ticks of what arrived, and control ticks; *out* when the add-on, and when the motors have to go off; *never*
//! an older state for a newer one, or one from the future, after which the present would be too old.
//!
//! A sender stamps what it says with its control ticks, which pass as fast as the vehicle's. So a stamp may be as far ahead of
//! the newest as ticks have passed since that came, and by what the line may have held back: [`Timeouts::lanes_inertial_s`] and
//! [`Timeouts::lanes_position_s`]. One that is further ahead is dropped and counted, and so is one that is not ahead at all. If
//! the genuine ones stay away for that long, and [`RUN`] of the dropped ones follow each other, their sender has started again
//! and is heard from then on: 20 ms after the last attitude, 0.1 s after the last position, long before the motors go off.

use crate::settings::Rates;

/// How long the vehicle goes on with what it knows, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timeouts {
    /// Attitude and rates that are older turn the add-on off: it would learn of its own effect too late.
    pub lanes_inertial_s: f32,
    /// The same for position and velocity.
    pub lanes_position_s: f32,
    /// Attitude and rates that are older turn the motors off: the vehicle has turned by half a radian by then.
    pub motors_inertial_s: f32,
    /// The same for position and velocity, without which the attitude is still held.
    pub motors_position_s: f32,
}

impl Default for Timeouts {
    fn default() -> Self {
        Self { lanes_inertial_s: 0.02, lanes_position_s: 0.1, motors_inertial_s: 0.25, motors_position_s: 0.5 }
    }
}

/// Dropped stamps that must follow each other before their sender is heard.
pub const RUN: u8 = 3;

/// One part of the state.
#[derive(Clone, Copy, Debug)]
struct Source {
    /// The sender's tick of the newest.
    stamp: Option<u32>,
    /// Control ticks since it came.
    age: u32,
    lanes: u32,
    motors: u32,
    /// The last stamp that was dropped.
    dropped: u32,
    /// How many dropped ones followed each other, this one included.
    run: u8,
}

/// What a stamp says of its news.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum News {
    /// Newer than the newest: it counts.
    Newer,
    /// A copy, or overtaken.
    Older,
    /// From the future, as far as anybody can know.
    Ahead,
}

impl Source {
    const NONE: Self = Self { stamp: None, age: 0, lanes: 0, motors: 0, dropped: 0, run: 0 };

    fn new(control_hz: f32, lanes_s: f32, motors_s: f32) -> Self {
        // Saturates; NaN counts as 0.
        let (lanes, motors) = ((lanes_s * control_hz) as u32, (motors_s * control_hz) as u32);
        Self { age: u32::MAX, lanes, motors, ..Self::NONE }
    }

    fn on_stamp(&mut self, stamp: u32) -> News {
        let news = self.judge(stamp);
        if news == News::Newer {
            (self.stamp, self.age, self.run) = (Some(stamp), 0, 0);
        } else {
            self.dropped = stamp;
        }
        news
    }

    fn judge(&mut self, stamp: u32) -> News {
        let Some(newest) = self.stamp else { return News::Newer };
        // A sender that was silent for so long that nobody flies any more may have started again.
        if self.age > self.motors {
            return News::Newer;
        }
        let ahead = stamp.wrapping_sub(newest);
        if ahead > 0 && ahead <= self.age.saturating_add(self.lanes) {
            return News::Newer;
        }
        let follows = (1..=self.lanes).contains(&stamp.wrapping_sub(self.dropped));
        self.run = if follows && self.run > 0 { self.run.saturating_add(1) } else { 1 };
        if self.age > self.lanes && self.run >= RUN {
            News::Newer
        } else if ahead > u32::MAX / 2 || ahead == 0 {
            News::Older
        } else {
            News::Ahead
        }
    }
}

/// Ages of both parts of the state.
#[derive(Clone, Copy, Debug)]
pub(super) struct StateAge {
    inertial: Source,
    position: Source,
}

impl StateAge {
    /// Before there are settings: all zeros, so that a static with it takes no flash.
    pub(super) const NONE: Self = Self { inertial: Source::NONE, position: Source::NONE };

    pub(super) fn new(rates: &Rates) -> Self {
        let timeouts = Timeouts::default();
        let rate = rates.control_hz;
        Self {
            inertial: Source::new(rate, timeouts.lanes_inertial_s, timeouts.motors_inertial_s),
            position: Source::new(rate, timeouts.lanes_position_s, timeouts.motors_position_s),
        }
    }

    /// Attitude and rates came.
    pub(super) fn inertial(&mut self, stamp: u32) -> News {
        self.inertial.on_stamp(stamp)
    }

    /// Position and velocity came.
    pub(super) fn position(&mut self, stamp: u32) -> News {
        self.position.on_stamp(stamp)
    }

    /// Whether a new attitude came since the last control tick.
    pub(super) fn informed(&self) -> bool {
        self.inertial.age == 0
    }

    /// What came so far is not new any more: the next tick waits for an attitude of its own.
    pub(super) fn seen(&mut self) {
        self.inertial.age = self.inertial.age.max(1);
    }

    /// A control tick passes.
    pub(super) fn tick(&mut self) {
        for source in [&mut self.inertial, &mut self.position] {
            source.age = source.age.saturating_add(1);
        }
    }

    /// Whether the state is too old for the add-on.
    pub(super) fn lanes_off(&self) -> bool {
        self.inertial.age > self.inertial.lanes || self.position.age > self.position.lanes
    }

    /// Whether the state is too old to fly on.
    pub(super) fn motors_off(&self) -> bool {
        self.inertial.age > self.inertial.motors || self.position.age > self.position.motors
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn source() -> Source {
        Source::new(500.0, 0.02, 0.25)
    }

    fn newer(source: &mut Source, stamp: u32) -> bool {
        source.on_stamp(stamp) == News::Newer
    }

    #[test]
    fn only_newer_stamps_count_also_when_they_wrap_or_start_again() {
        let mut source = source();
        assert!(newer(&mut source, u32::MAX));
        assert!(!newer(&mut source, u32::MAX) && !newer(&mut source, u32::MAX - 3));
        assert!(newer(&mut source, 0) && newer(&mut source, 7) && !newer(&mut source, 6));
        source.age = 126;
        assert!(newer(&mut source, 3), "a sender that starts again");
    }

    #[test]
    fn a_stamp_from_the_future_costs_itself_alone() {
        for ahead in [11, 12, 126, 1000, u32::MAX / 2 - 10, u32::MAX / 2] {
            let mut source = source();
            assert!(newer(&mut source, 1000));
            assert_eq!(source.on_stamp(1000 + ahead), News::Ahead, "{ahead}");
            for stamp in 1001..1400 {
                source.age += 1;
                assert!(newer(&mut source, stamp));
                assert_eq!(source.on_stamp(stamp.wrapping_add(ahead)), News::Ahead, "also when it is said again and again");
            }
        }
    }

    /// Ticks until a sender that starts again is heard, if it speaks every `period` ticks; the lanes' time-out in ticks.
    fn restarted(mut source: Source, first: u32, period: u32) -> (u32, u32) {
        assert!(newer(&mut source, 5000));
        let mut ticks = 0;
        loop {
            (source.age, ticks) = (source.age + 1, ticks + 1);
            if ticks % period == 0 && newer(&mut source, first.wrapping_add(ticks)) {
                return (ticks, source.lanes);
            }
            assert!(source.age <= source.motors, "not heard");
        }
    }

    proptest! {
        #[test]
        fn a_sender_that_starts_again_is_heard_soon(first in any::<u32>()) {
            let (ticks, lanes) = restarted(source(), first, 1);
            prop_assert!(ticks <= lanes + 1);
            let (ticks, lanes) = restarted(Source::new(500.0, 0.1, 0.5), first, 5);
            prop_assert!(ticks <= lanes + 5);
        }

        #[test]
        fn a_line_that_loses_delays_and_repeats_starves_nobody(
            lost in prop::collection::vec(any::<bool>(), 400), delays in prop::collection::vec(0u32..10, 400),
        ) {
            // A sender that speaks at each tick; each message comes up to nine ticks late, or not at all.
            let (mut source, mut worst) = (source(), 0);
            for now in 0..400u32 {
                source.age = source.age.saturating_add(1);
                for (sent, (lost, delay)) in lost.iter().zip(&delays).enumerate() {
                    let sent = sent as u32;
                    if !lost && sent + delay == now {
                        prop_assert_ne!(source.on_stamp(sent), News::Ahead);
                    }
                }
                // As old as what was lost and delayed makes it, and no older.
                let sent = lost.iter().zip(&delays).enumerate();
                let mut held = sent.filter(|(sent, (lost, delay))| !**lost && *sent as u32 + **delay <= now);
                if let Some((newest, _)) = held.next_back() {
                    prop_assert_eq!(source.stamp, Some(newest as u32));
                    worst = worst.max(source.age);
                }
            }
            prop_assert!(worst < 125);
        }
    }
}
