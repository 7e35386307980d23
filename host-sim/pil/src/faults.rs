//! Lines that lose, flip and invent bytes on their way to the firmware. What comes back is whole: the plant must get what the
//! motors get.

use std::{io, ops::Range, time::Duration};

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::line::Line;

/// What goes wrong. Frames end with a zero byte; exchanges are control ticks in lockstep.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Faults {
    /// Exchanges before the first fault: the upload and the take-off.
    pub first: u64,
    /// Share of frames that are lost.
    pub loss: f64,
    /// Share of bits that are flipped.
    pub bit_errors: f64,
    /// Share of frames that are cut somewhere.
    pub cuts: f64,
    /// Share of frames that come one exchange late, behind younger ones.
    pub late: f64,
    /// Random bytes before the frames of each exchange.
    pub garbage: usize,
    /// Exchanges in which nothing arrives.
    pub silence: Option<Range<u64>>,
}

/// A line with faults; the same seed gives the same faults.
pub struct Faulty<L> {
    line: L,
    faults: Faults,
    random: Xoshiro256PlusPlus,
    exchanges: u64,
    held: Vec<u8>,
}

impl<L: Line> Faulty<L> {
    /// A line with these faults.
    pub fn new(line: L, faults: Faults, seed: u64) -> Self {
        Self { line, faults, random: Xoshiro256PlusPlus::seed_from_u64(seed), exchanges: 0, held: Vec::new() }
    }

    /// Exchanges so far.
    pub fn exchanges(&self) -> u64 {
        self.exchanges
    }

    fn damaged(&mut self, bytes: &[u8]) -> Vec<u8> {
        let Faults { loss, bit_errors, cuts, late, garbage, .. } = self.faults;
        let random = &mut self.random;
        let mut sent: Vec<u8> = (0..garbage).map(|_| random.random()).collect();
        let overtaken = std::mem::take(&mut self.held);
        for frame in bytes.split_inclusive(|byte| *byte == 0) {
            if random.random_bool(loss) {
                continue;
            }
            if random.random_bool(late) {
                self.held.extend(frame);
            } else if random.random_bool(cuts) {
                sent.extend(&frame[..random.random_range(0..frame.len())]);
            } else {
                sent.extend(frame);
            }
        }
        sent.extend(overtaken);
        if bit_errors > 0.0 {
            for byte in &mut sent {
                for bit in 0..8 {
                    *byte ^= u8::from(random.random_bool(bit_errors)) << bit;
                }
            }
        }
        sent
    }
}

impl<L: Line> Line for Faulty<L> {
    fn exchange(&mut self, bytes: &[u8]) -> io::Result<Vec<u8>> {
        self.exchanges += 1;
        let silent = self.faults.silence.as_ref().is_some_and(|silence| silence.contains(&self.exchanges));
        if self.exchanges <= self.faults.first {
            return self.line.exchange(bytes);
        }
        let sent = if silent { Vec::new() } else { self.damaged(bytes) };
        self.line.exchange(&sent)
    }

    fn wait(&mut self, patience: Duration) -> io::Result<Vec<u8>> {
        self.line.wait(patience)
    }

    fn end(&mut self) {
        self.line.end();
    }
}
