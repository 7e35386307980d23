//! The newest value.
//!
//! *in* values of one producer, each with a stamp; *out* the newest whole one at one consumer, or none while the producer,
//! interrupted by the consumer, is half-way; *never* a torn value, a value twice, or a wait; *source* Boehm 2012, figure 6
//! (seqlock with fences).

use core::sync::atomic::{AtomicU32, Ordering, fence};

/// How often the consumer tries again after the producer interrupted it.
const ATTEMPTS: usize = 3;

/// Hand-over of `WORDS` words and a stamp from one producer to one consumer.
#[derive(Debug)]
pub struct Mailbox<const WORDS: usize> {
    /// Odd while a value is being put; only the producer writes it.
    version: AtomicU32,
    stamp: AtomicU32,
    words: [AtomicU32; WORDS],
    /// Version of the value that was taken last; only the consumer touches it.
    taken: AtomicU32,
}

impl<const WORDS: usize> Mailbox<WORDS> {
    /// An empty mailbox.
    pub const fn new() -> Self {
        Self {
            version: AtomicU32::new(0),
            stamp: AtomicU32::new(0),
            words: [const { AtomicU32::new(0) }; WORDS],
            taken: AtomicU32::new(0),
        }
    }

    /// Producer: replaces the value.
    pub fn put(&self, stamp: u32, words: &[u32; WORDS]) {
        self.put_interrupted(stamp, words.iter().copied(), || ());
    }

    /// Producer: replaces the value by so many words as there are, at most all of them.
    pub fn put_from(&self, stamp: u32, words: impl Iterator<Item = u32>) {
        self.put_interrupted(stamp, words, || ());
    }

    /// Producer: replaces the value by numbers, bit by bit.
    pub fn put_floats(&self, stamp: u32, values: &[f32; WORDS]) {
        self.put_interrupted(stamp, values.iter().map(|value| value.to_bits()), || ());
    }

    /// Consumer: stamp and words of the newest value, once. `None` if there is no newer one, or it is half-written.
    pub fn take(&self) -> Option<(u32, [u32; WORDS])> {
        self.take_interrupted(|| ())
    }

    /// Consumer: [`Mailbox::take`] of a large value to where it shall be, which holds anything where there is `None`.
    pub fn take_into(&self, words: &mut [u32; WORDS]) -> Option<u32> {
        self.take_into_interrupted(words, || ())
    }

    /// Consumer: stamp and numbers of the newest value, as [`Mailbox::take`].
    pub fn take_floats(&self) -> Option<(u32, [f32; WORDS])> {
        self.take().map(|(stamp, words)| (stamp, words.map(f32::from_bits)))
    }

    /// `interrupt` stands for whatever runs between two steps.
    fn put_interrupted(&self, stamp: u32, words: impl Iterator<Item = u32>, mut interrupt: impl FnMut()) {
        let version = self.version.load(Ordering::Relaxed);
        interrupt();
        self.version.store(version.wrapping_add(1), Ordering::Relaxed);
        // Whoever sees one of the new words sees the odd version.
        fence(Ordering::Release);
        interrupt();
        self.stamp.store(stamp, Ordering::Relaxed);
        for (place, word) in self.words.iter().zip(words) {
            interrupt();
            place.store(word, Ordering::Relaxed);
        }
        interrupt();
        // Whoever sees the even version sees all of the new words.
        self.version.store(version.wrapping_add(2), Ordering::Release);
    }

    fn take_interrupted(&self, interrupt: impl FnMut()) -> Option<(u32, [u32; WORDS])> {
        let mut words = [0; WORDS];
        let stamp = self.take_into_interrupted(&mut words, interrupt)?;
        Some((stamp, words))
    }

    fn take_into_interrupted(&self, words: &mut [u32; WORDS], mut interrupt: impl FnMut()) -> Option<u32> {
        for _ in 0..ATTEMPTS {
            let before = self.version.load(Ordering::Acquire);
            // Half-written: on one core the producer can go on only after this returns.
            if !before.is_multiple_of(2) || before == self.taken.load(Ordering::Relaxed) {
                return None;
            }
            interrupt();
            let stamp = self.stamp.load(Ordering::Relaxed);
            for (word, place) in words.iter_mut().zip(&self.words) {
                interrupt();
                *word = place.load(Ordering::Relaxed);
            }
            interrupt();
            // If one of the words was new, the version read below is new too.
            fence(Ordering::Acquire);
            if self.version.load(Ordering::Relaxed) == before {
                self.taken.store(before, Ordering::Relaxed);
                return Some(stamp);
            }
        }
        None
    }
}

impl<const WORDS: usize> Default for Mailbox<WORDS> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{cell::Cell, thread};

    /// Steps of a hand-over of four words between which the other side may run.
    const STEPS: usize = 7;

    fn filled(value: u32) -> (u32, [u32; 4]) {
        (value, [value; 4])
    }

    #[test]
    fn values_are_taken_once_and_bit_by_bit() {
        let mailbox = Mailbox::<2>::new();
        assert_eq!(mailbox.take(), None);
        mailbox.put_floats(7, &[-0.0, f32::NAN]);
        let (stamp, [zero, nan]) = mailbox.take_floats().unwrap();
        assert_eq!((stamp, zero.to_bits(), nan.to_bits()), (7, (-0.0f32).to_bits(), f32::NAN.to_bits()));
        assert_eq!(mailbox.take(), None);
        mailbox.version.store(u32::MAX - 1, Ordering::Relaxed);
        mailbox.put(8, &[1, 2]);
        assert_eq!(mailbox.take(), Some((8, [1, 2])), "the version wraps");
    }

    #[test]
    fn a_consumer_that_interrupts_the_producer_gets_a_whole_value_or_none() {
        for at in 0..STEPS {
            let (mailbox, step) = (Mailbox::new(), Cell::new(0));
            mailbox.put(1, &[1; 4]);
            mailbox.put_interrupted(2, [2; 4].into_iter(), || {
                if step.replace(step.get() + 1) == at {
                    assert_eq!(mailbox.take(), (at == 0).then_some(filled(1)), "at step {at}");
                }
            });
            assert_eq!(mailbox.take(), Some(filled(2)));
            assert_eq!(step.get(), STEPS);
        }
    }

    #[test]
    fn a_producer_that_interrupts_the_consumer_makes_it_try_again() {
        for at in 0..STEPS {
            let (mailbox, step) = (Mailbox::new(), Cell::new(0));
            mailbox.put(1, &[1; 4]);
            let taken = mailbox.take_interrupted(|| {
                if step.replace(step.get() + 1) == at {
                    mailbox.put(2, &[2; 4]);
                }
            });
            assert_eq!(taken, Some(filled(if at < step.get() { 2 } else { 1 })), "at step {at}");
        }
        let (mailbox, next) = (Mailbox::new(), Cell::new(2));
        mailbox.put(1, &[1; 4]);
        let taken = mailbox.take_interrupted(|| mailbox.put(next.get(), &[next.replace(next.get() + 1); 4]));
        assert_eq!(taken, None, "a producer that never rests");
        assert_eq!(mailbox.take(), Some(filled(next.get() - 1)));
    }

    #[test]
    fn between_threads_values_are_whole_and_in_order() {
        static MAILBOX: Mailbox<6> = Mailbox::new();
        const COUNT: u32 = 300_000;
        let producer = thread::spawn(|| {
            for value in 1..=COUNT {
                MAILBOX.put(value, &[value; 6]);
                if value % 64 == 0 {
                    thread::yield_now();
                }
            }
        });
        let (mut last, mut taken) = (0, 0);
        while last < COUNT {
            if let Some((stamp, words)) = MAILBOX.take() {
                assert!(words == [stamp; 6] && stamp > last, "{stamp} after {last}: {words:?}");
                (last, taken) = (stamp, taken + 1);
            } else {
                thread::yield_now();
            }
        }
        producer.join().unwrap();
        assert!(taken > 1);
    }
}
