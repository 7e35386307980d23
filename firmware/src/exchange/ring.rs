//! A queue of bytes.
//!
//! *in* bytes of one producer; *out* the same in order at one consumer; *never* an older byte overwritten: what does not fit is
//! dropped and counted; *source* Lamport 1983, with free-running counters.

use core::sync::atomic::{AtomicU8, AtomicU32, AtomicUsize, Ordering};

/// Queue of at most `N` bytes, a power of two, from one producer to one consumer.
#[derive(Debug)]
pub struct ByteRing<const N: usize> {
    bytes: [AtomicU8; N],
    /// Bytes ever put; the producer writes it, with `Release`: whoever sees it (`Acquire`) sees the bytes.
    put: AtomicUsize,
    /// Bytes ever taken; the consumer writes it, with `Release`: whoever sees it (`Acquire`) may overwrite the bytes.
    taken: AtomicUsize,
    /// Only the producer writes it.
    overruns: AtomicU32,
}

impl<const N: usize> ByteRing<N> {
    /// An empty queue.
    pub const fn new() -> Self {
        // Then the remainder is a mask, and the counters may wrap.
        const { assert!(N.is_power_of_two()) };
        Self {
            bytes: [const { AtomicU8::new(0) }; N],
            put: AtomicUsize::new(0),
            taken: AtomicUsize::new(0),
            overruns: AtomicU32::new(0),
        }
    }

    /// Producer: appends a byte; `false`, and an overrun, if there is no room.
    pub fn put(&self, byte: u8) -> bool {
        self.put_all(&[byte])
    }

    /// Producer: appends all of the bytes or, if they do not fit, none: `false`, and so many overruns.
    pub fn put_all(&self, bytes: &[u8]) -> bool {
        let put = self.put.load(Ordering::Relaxed);
        let waiting = put.wrapping_sub(self.taken.load(Ordering::Acquire));
        if bytes.len() > N.saturating_sub(waiting) {
            let overruns = self.overruns.load(Ordering::Relaxed);
            let lost = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
            self.overruns.store(overruns.saturating_add(lost), Ordering::Relaxed);
            return false;
        }
        let mut at = put;
        for byte in bytes {
            if let Some(place) = self.place(at) {
                place.store(*byte, Ordering::Relaxed);
            }
            at = at.wrapping_add(1);
        }
        self.put.store(at, Ordering::Release);
        true
    }

    /// Consumer: the oldest byte.
    pub fn take(&self) -> Option<u8> {
        let taken = self.taken.load(Ordering::Relaxed);
        if self.put.load(Ordering::Acquire) == taken {
            return None;
        }
        let byte = self.place(taken)?.load(Ordering::Relaxed);
        self.taken.store(taken.wrapping_add(1), Ordering::Release);
        Some(byte)
    }

    /// Consumer: the oldest bytes, as many as wait and there is room for.
    pub fn take_some<'p>(&self, place: &'p mut [u8]) -> &'p [u8] {
        let mut count = 0;
        for (to, byte) in place.iter_mut().zip(core::iter::from_fn(|| self.take())) {
            *to = byte;
            count += 1;
        }
        place.get(..count).unwrap_or_default()
    }

    /// Bytes that wait.
    pub fn len(&self) -> usize {
        // This order: a consumer that takes a byte in between makes the answer too small, never negative.
        let taken = self.taken.load(Ordering::Acquire);
        self.put.load(Ordering::Acquire).wrapping_sub(taken).min(N)
    }

    /// Whether no byte waits.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes dropped since the start because there was no room.
    pub fn overruns(&self) -> u32 {
        self.overruns.load(Ordering::Relaxed)
    }

    fn place(&self, count: usize) -> Option<&AtomicU8> {
        self.bytes.get(count & N.wrapping_sub(1))
    }
}

impl<const N: usize> Default for ByteRing<N> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::{collections::VecDeque, thread};

    proptest! {
        #[test]
        fn a_ring_is_a_bounded_queue(
            first in prop::sample::select(vec![0, usize::MAX - 5]),
            calls in prop::collection::vec((any::<bool>(), 0usize..6), 0..200)
        ) {
            let ring = ByteRing::<8>::new();
            // Counters that wrap change nothing.
            ring.put.store(first, Ordering::Relaxed);
            ring.taken.store(first, Ordering::Relaxed);
            let (mut model, mut next, mut overruns) = (VecDeque::new(), 0u8, 0);
            for (put, count) in calls {
                if put {
                    let bytes: Vec<u8> = (0..count).map(|i| next.wrapping_add(i as u8)).collect();
                    next = next.wrapping_add(count as u8);
                    let fits = model.len() + count <= 8;
                    prop_assert_eq!(ring.put_all(&bytes), fits);
                    if fits { model.extend(bytes) } else { overruns += count as u32 }
                } else {
                    prop_assert_eq!(ring.take(), model.pop_front());
                }
                prop_assert_eq!((ring.len(), ring.overruns()), (model.len(), overruns));
            }
        }
    }

    #[test]
    fn between_threads_every_byte_arrives_once_and_in_order() {
        static RING: ByteRing<16> = ByteRing::new();
        const COUNT: u32 = 300_000;
        let producer = thread::spawn(|| {
            for i in 0..COUNT {
                while !RING.put(i as u8) {
                    thread::yield_now();
                }
            }
        });
        for i in 0..COUNT {
            let byte = loop {
                match RING.take() {
                    Some(byte) => break byte,
                    None => thread::yield_now(),
                }
            };
            assert_eq!(byte, i as u8);
        }
        producer.join().unwrap();
        assert!(RING.is_empty());
    }
}
