//! The desired trajectory around the present: some past, as much future as the features need.
//!
//! *in* one sample of desired channels for each reference tick, in order; *out* the sample of any tick;
//! *never* an index out of range: outside of what is stored the end rule answers;
//! *source* Zhou 2017, section III-B (preview of r steps); the end rule is ours.

pub use crate::format::EndRule;

/// Ring of the newest `N` samples of `D` desired channels, addressed by reference tick.
///
/// Ticks wrap: which of two is the later one is told by their difference, so that a loop may run for ever. What is asked for has
/// to lie within 2³¹ ticks of what is stored, 249 days at 100 Hz.
#[derive(Clone, Debug)]
pub struct Preview<const D: usize, const N: usize> {
    samples: [[f32; D]; N],
    rules: [EndRule; D],
    /// Tick of the next sample to be pushed,
    next: i32,
    /// and its place.
    slot: usize,
    stored: usize,
}

impl<const D: usize, const N: usize> Preview<D, N> {
    /// An empty preview whose first sample will be that of tick `first`.
    pub const fn new(rules: [EndRule; D], first: i32) -> Self {
        Self { samples: [[0.0; D]; N], rules, next: first, slot: 0, stored: 0 }
    }

    /// Makes it an empty preview again, in place: as [`Preview::new`], without a copy of it on the stack.
    pub fn restart(&mut self, rules: [EndRule; D], first: i32) {
        self.rules = rules;
        self.clear(first);
    }

    /// Appends the sample of the next tick; the oldest one is dropped when the ring is full.
    #[inline]
    pub fn push(&mut self, sample: [f32; D]) {
        if let Some(place) = self.samples.get_mut(self.slot) {
            *place = sample;
        }
        self.slot = if self.slot + 1 < N { self.slot + 1 } else { 0 };
        self.next = self.next.wrapping_add(1);
        self.stored = (self.stored + 1).min(N);
    }

    /// Forgets every sample; the next one will be that of tick `first`.
    pub fn clear(&mut self, first: i32) {
        (self.next, self.stored) = (first, 0);
    }

    /// Forgets the samples from tick `from` on, which other ones are to replace: the next one will be that of `from`, or of an
    /// earlier tick if they did not reach that far. The samples before it stay.
    pub fn truncate(&mut self, from: i32) {
        let dropped = self.next.wrapping_sub(from).max(0) as usize;
        let dropped = dropped.min(self.stored);
        self.slot = if self.slot < dropped { self.slot + N - dropped } else { self.slot - dropped };
        self.next = self.next.wrapping_sub(dropped as i32);
        self.stored -= dropped;
    }

    /// Tick of the sample that [`Preview::push`] will store next.
    pub fn next_tick(&self) -> i32 {
        self.next
    }

    /// How many samples later than that of `tick` are stored; negative if the newest one is earlier, -1 and less if none is
    /// stored.
    #[inline]
    pub fn reach(&self, tick: i32) -> i32 {
        let ahead = self.next.wrapping_sub(tick).wrapping_sub(1);
        if self.stored == 0 { ahead.min(-1) } else { ahead }
    }

    /// Tick of the oldest sample that is stored.
    pub fn oldest_tick(&self) -> i32 {
        self.next.wrapping_sub(self.stored as i32)
    }

    /// Whether the next sample pushes out the oldest one.
    pub fn is_full(&self) -> bool {
        self.stored == N
    }

    /// Whether the next sample pushes out one that is still to be seen after the tick `flown`, by who looks as many ticks
    /// `behind` the one that is flown; before the first, all are.
    pub fn is_ahead_full(&self, flown: Option<i32>, behind: i32) -> bool {
        let kept = 1 - behind.max(1);
        self.is_full() && flown.is_none_or(|tick| self.oldest_tick().wrapping_sub(tick.wrapping_add(kept)) >= 0)
    }

    /// Whether nothing is stored.
    pub fn is_empty(&self) -> bool {
        self.stored == 0
    }

    /// What a channel is beyond the trajectory's ends.
    pub fn rule(&self, channel: usize) -> EndRule {
        self.rules.get(channel).copied().unwrap_or(EndRule::Hold)
    }

    /// One channel at a tick.
    #[inline]
    pub fn channel(&self, tick: i32, channel: usize) -> f32 {
        match self.place(tick) {
            Some(place) => self.samples.get(place).and_then(|sample| sample.get(channel)).copied().unwrap_or(0.0),
            None => self.channel_beyond(tick, channel),
        }
    }

    /// All channels at a tick.
    #[inline]
    pub fn sample(&self, tick: i32) -> [f32; D] {
        match self.place(tick) {
            Some(place) => self.samples.get(place).copied().unwrap_or([0.0; D]),
            None => self.sample_beyond(tick),
        }
    }

    /// Place of the sample of a tick, if it is stored.
    #[inline(always)]
    fn place(&self, tick: i32) -> Option<usize> {
        // The newest one is one back. What comes later wraps, so that one comparison tells both ends.
        let back = self.next.wrapping_sub(tick) as usize;
        let within = back.wrapping_sub(1) < self.stored;
        within.then(|| if self.slot < back { (self.slot + N).wrapping_sub(back) } else { self.slot - back })
    }

    /// The stored sample that is nearest to a tick which is not stored, if there is one.
    #[inline(always)]
    fn nearest(&self, tick: i32) -> Option<&[f32; D]> {
        if self.stored == 0 {
            return None;
        }
        let back = if self.next.wrapping_sub(tick) <= 0 { 1 } else { self.stored };
        self.samples.get(if self.slot < back { (self.slot + N).wrapping_sub(back) } else { self.slot - back })
    }

    /// A channel at a tick that is not stored. This and the next are functions of their own, apart from what is asked for of each
    /// feature in each flight.
    #[inline(never)]
    fn channel_beyond(&self, tick: i32, channel: usize) -> f32 {
        match self.rules.get(channel) {
            Some(EndRule::Hold) => self.nearest(tick).and_then(|sample| sample.get(channel)).copied().unwrap_or(0.0),
            _ => 0.0,
        }
    }

    /// All channels at a tick that is not stored.
    #[inline(never)]
    fn sample_beyond(&self, tick: i32) -> [f32; D] {
        let mut sample = self.nearest(tick).copied().unwrap_or([0.0; D]);
        for (value, rule) in sample.iter_mut().zip(&self.rules) {
            if *rule == EndRule::Zero {
                *value = 0.0;
            }
        }
        sample
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn filled(count: i32) -> Preview<2, 8> {
        let mut preview = Preview::new([EndRule::Hold, EndRule::Zero], 0);
        for i in 0..count {
            preview.push([i as f32, 10.0 + i as f32]);
        }
        preview
    }

    #[test]
    fn beyond_the_ends_positions_hold_and_velocities_vanish() {
        let preview = filled(12); // ticks 4..=11 are kept
        assert_eq!(preview.sample(11), [11.0, 21.0]);
        assert_eq!(preview.sample(12), [11.0, 0.0]);
        assert_eq!(preview.sample(4), [4.0, 14.0]);
        assert_eq!(preview.sample(-3), [4.0, 0.0]);
    }

    #[test]
    fn an_empty_preview_is_zero() {
        assert_eq!(filled(0).sample(5), [0.0, 0.0]);
    }

    #[test]
    fn a_restarted_preview_knows_nothing_of_the_past() {
        let mut preview = filled(12);
        preview.restart([EndRule::Zero, EndRule::Hold], 100);
        assert_eq!((preview.sample(11), preview.next_tick()), ([0.0, 0.0], 100));
        preview.push([1.0, 2.0]);
        assert_eq!((preview.sample(99), preview.sample(100)), ([0.0, 2.0], [1.0, 2.0]));
    }

    proptest! {
        #[test]
        fn ticks_may_wrap(first in any::<i32>(), count in 1i32..40, ahead in -60i32..60) {
            let (mut here, mut there) = (Preview::<2, 8>::new([EndRule::Hold, EndRule::Zero], 0), filled(0));
            there.clear(first);
            for i in 0..count {
                here.push([i as f32, 1.0]);
                there.push([i as f32, 1.0]);
            }
            prop_assert_eq!(here.sample(ahead), there.sample(first.wrapping_add(ahead)));
            prop_assert_eq!(here.reach(ahead), there.reach(first.wrapping_add(ahead)));
        }

        #[test]
        fn a_truncated_preview_takes_other_samples_from_there_on(
            first in any::<i32>(), count in 0i32..40, from in -20i32..60, more in 0i32..20
        ) {
            let (mut truncated, mut fresh) = (filled(0), filled(0));
            for preview in [&mut truncated, &mut fresh] {
                preview.clear(first);
            }
            let kept = from.clamp((count - 8).max(0), count);
            for i in 0..count {
                truncated.push([i as f32, 0.0]);
            }
            truncated.truncate(first.wrapping_add(from));
            prop_assert_eq!(truncated.next_tick(), first.wrapping_add(kept));
            for i in 0..kept {
                fresh.push([i as f32, 0.0]);
            }
            for i in 0..more {
                truncated.push([-1.0 - i as f32, 0.0]);
                fresh.push([-1.0 - i as f32, 0.0]);
            }
            let oldest = (count - 8).max(0).max(kept + more - 8);
            for tick in oldest..kept + more {
                let tick = first.wrapping_add(tick);
                prop_assert_eq!(truncated.sample(tick), fresh.sample(tick));
            }
        }

        /// Whoever pushes as much as there is room for still finds, at every tick, all that is looked back at.
        #[test]
        fn what_is_looked_back_at_stays(
            first in any::<i32>(), behind in 0i32..7, pushes in prop::collection::vec(0usize..12, 1..40)
        ) {
            let mut preview = filled(0);
            preview.clear(first);
            let (mut flown, mut pushed) = (None, 0);
            for (now, count) in (0i32..).zip(pushes) {
                for _ in 0..count {
                    if preview.is_ahead_full(flown, behind) {
                        // Not for nothing: all room ahead is used.
                        prop_assert_eq!(pushed, (now + 8 - behind.max(1)).max(8));
                        break;
                    }
                    preview.push([pushed as f32, 0.0]);
                    pushed += 1;
                }
                for tick in (now - behind).max(0)..pushed {
                    prop_assert_eq!(preview.sample(first.wrapping_add(tick))[0], tick as f32);
                }
                flown = Some(first.wrapping_add(now));
            }
        }

        #[test]
        fn channels_and_samples_agree_at_every_tick(count in 0i32..40, tick in any::<i32>()) {
            let preview = filled(count);
            let sample = preview.sample(tick);
            prop_assert_eq!(sample[0], preview.channel(tick, 0));
            prop_assert_eq!(sample[1], preview.channel(tick, 1));
        }
    }
}
