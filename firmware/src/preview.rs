//! The desired trajectory around the present: some past, as much future as the features need.
//!
//! *in* one sample of desired channels for each reference tick, in order; *out* the sample of any tick;
//! *never* an index out of range: outside of what is stored the end rule answers;
//! *source* Zhou 2017, section III-B (preview of r steps); the end rule is ours.

pub use crate::format::EndRule;

/// Ring of the newest `N` samples of `D` desired channels, addressed by reference tick.
#[derive(Clone, Debug)]
pub struct Preview<const D: usize, const N: usize> {
    samples: [[f32; D]; N],
    rules: [EndRule; D],
    /// Tick of the next sample to be pushed.
    next: i32,
    stored: usize,
}

impl<const D: usize, const N: usize> Preview<D, N> {
    /// An empty preview whose first sample will be that of tick `first`.
    pub const fn new(rules: [EndRule; D], first: i32) -> Self {
        Self { samples: [[0.0; D]; N], rules, next: first, stored: 0 }
    }

    /// Makes it an empty preview again, in place: as [`Preview::new`], without a copy of it on the stack.
    pub fn restart(&mut self, rules: [EndRule; D], first: i32) {
        (self.rules, self.next, self.stored) = (rules, first, 0);
    }

    /// Appends the sample of the next tick; the oldest one is dropped when the ring is full.
    #[inline]
    pub fn push(&mut self, sample: [f32; D]) {
        let slot = self.next.rem_euclid(N as i32) as usize;
        if let Some(place) = self.samples.get_mut(slot) {
            *place = sample;
        }
        self.next = self.next.wrapping_add(1);
        self.stored = (self.stored + 1).min(N);
    }

    /// Forgets every sample; the next one will be that of tick `first`.
    pub fn clear(&mut self, first: i32) {
        (self.next, self.stored) = (first, 0);
    }

    /// Tick of the sample that [`Preview::push`] will store next.
    pub fn next_tick(&self) -> i32 {
        self.next
    }

    /// One channel at a tick.
    #[inline]
    pub fn channel(&self, tick: i32, channel: usize) -> f32 {
        let (tick, inside) = self.locate(tick);
        match (inside, self.rules.get(channel)) {
            (true, Some(_)) | (false, Some(EndRule::Hold)) => {
                self.slot(tick).and_then(|sample| sample.get(channel)).copied().unwrap_or(0.0)
            }
            _ => 0.0,
        }
    }

    /// All channels at a tick.
    #[inline]
    pub fn sample(&self, tick: i32) -> [f32; D] {
        let (tick, inside) = self.locate(tick);
        let mut sample = self.slot(tick).copied().unwrap_or([0.0; D]);
        if !inside {
            for (value, rule) in sample.iter_mut().zip(&self.rules) {
                if *rule == EndRule::Zero {
                    *value = 0.0;
                }
            }
        }
        sample
    }

    /// The stored tick nearest to `tick`, and whether it is `tick` itself.
    #[inline]
    fn locate(&self, tick: i32) -> (i32, bool) {
        let oldest = self.next.wrapping_sub(self.stored as i32);
        let nearest = tick.max(oldest).min(self.next.wrapping_sub(1));
        (nearest, nearest == tick)
    }

    #[inline]
    fn slot(&self, tick: i32) -> Option<&[f32; D]> {
        if self.stored == 0 { None } else { self.samples.get(tick.rem_euclid(N as i32) as usize) }
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
        fn channels_and_samples_agree_at_every_tick(count in 0i32..40, tick in any::<i32>()) {
            let preview = filled(count);
            let sample = preview.sample(tick);
            prop_assert_eq!(sample[0], preview.channel(tick, 0));
            prop_assert_eq!(sample[1], preview.channel(tick, 1));
        }
    }
}
