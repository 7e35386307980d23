//! NOR flash that holds a driver to its contract, and whose power can be cut at any byte.

use std::{cell::RefCell, rc::Rc};

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write};
use impromptu_firmware::storage::Slot;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Bytes of a slot.
pub(crate) const CAPACITY: usize = 2048;

/// What both slots have in common.
pub(crate) struct Supply {
    /// Bytes that are erased or programmed before the power is cut.
    pub(crate) cut: Option<usize>,
    /// Bytes erased or programmed until now.
    pub(crate) bytes: usize,
    /// Call of the driver, from 0, that fails half way with an error.
    pub(crate) failure: Option<usize>,
    /// Call of the driver, from 0, that succeeds but for one bit, which stays cleared.
    pub(crate) weak: Option<usize>,
    /// Calls of the driver until now.
    pub(crate) calls: usize,
    dead: bool,
    generator: Xoshiro256PlusPlus,
}

impl Supply {
    pub(crate) fn new() -> Rc<RefCell<Self>> {
        let generator = Xoshiro256PlusPlus::seed_from_u64(9);
        Rc::new(RefCell::new(Self { cut: None, bytes: 0, failure: None, weak: None, calls: 0, dead: false, generator }))
    }

    /// Starts counting anew, with the power on.
    pub(crate) fn restore(&mut self, cut: Option<usize>, failure: Option<usize>, seed: u64) {
        *self = Self {
            cut,
            failure,
            weak: None,
            bytes: 0,
            calls: 0,
            dead: false,
            generator: Xoshiro256PlusPlus::seed_from_u64(seed),
        };
    }

    /// What becomes of a call that erases or programs so many bytes.
    fn spend(&mut self, bytes: usize) -> Outcome {
        if self.dead {
            return Outcome::Ignored;
        }
        let call = self.calls;
        self.calls += 1;
        let torn = match self.cut.map(|cut| cut - self.bytes) {
            Some(left) if left < bytes => {
                self.dead = true;
                Some(left)
            }
            _ => (self.failure == Some(call)).then(|| self.generator.random_range(0..bytes)),
        };
        self.bytes += torn.unwrap_or(bytes);
        torn.map_or(Outcome::Done, Outcome::Torn)
    }
}

enum Outcome {
    Done,
    /// At this byte.
    Torn(usize),
    /// The power is off.
    Ignored,
}

#[repr(C, align(16))]
struct Cells([u8; CAPACITY]);

/// A slot written in words of `WRITE` bytes and erased in sectors of `ERASE`.
pub(crate) struct Simulated<const WRITE: usize, const ERASE: usize> {
    cells: Box<Cells>,
    /// For each word whether it was programmed since it was erased.
    programmed: Vec<bool>,
    supply: Rc<RefCell<Supply>>,
}

impl<const WRITE: usize, const ERASE: usize> Simulated<WRITE, ERASE> {
    /// As from the factory: not erased.
    pub(crate) fn new(supply: &Rc<RefCell<Supply>>) -> Self {
        Self { cells: Box::new(Cells([0x5a; CAPACITY])), programmed: vec![true; CAPACITY / WRITE], supply: supply.clone() }
    }

    /// Puts `bytes` at the slot's start, past the driver.
    pub(crate) fn plant(&mut self, bytes: &[u8]) {
        self.cells.0[..bytes.len()].copy_from_slice(bytes);
    }

    pub(crate) fn flip(&mut self, bit: usize) {
        self.cells.0[bit / 8] ^= 1 << (bit % 8);
    }

    /// Clears a bit of these bytes if the call just made is the weak one.
    fn weaken(&mut self, range: std::ops::Range<usize>) {
        let supply = &mut *self.supply.borrow_mut();
        if supply.weak.is_some_and(|call| call + 1 == supply.calls) {
            self.cells.0[supply.generator.random_range(range)] &= !(1 << supply.generator.random_range(0..8));
        }
    }

    /// A cut while these bytes are erased: cells rise in any order, and some are anything.
    fn tear_erase(&mut self, range: std::ops::Range<usize>, done: usize) {
        let generator = &mut self.supply.borrow_mut().generator;
        let order = generator.random_range(0..4);
        let length = range.len();
        for (index, cell) in self.cells.0[range].iter_mut().enumerate() {
            let rank = if order == 0 { index } else { length - 1 - index };
            *cell = match (order, rank.cmp(&done)) {
                (2, _) => *cell | generator.random::<u8>(),
                (3, _) => [*cell, 0xff, generator.random()][generator.random_range(0..3)],
                (_, std::cmp::Ordering::Less) => 0xff,
                (_, std::cmp::Ordering::Equal) => generator.random(),
                (_, std::cmp::Ordering::Greater) => *cell,
            };
        }
    }
}

impl<const WRITE: usize, const ERASE: usize> Slot for Simulated<WRITE, ERASE> {
    fn bytes(&self) -> &[u8] {
        &self.cells.0
    }
}

impl<const WRITE: usize, const ERASE: usize> ErrorType for Simulated<WRITE, ERASE> {
    type Error = NorFlashErrorKind;
}

impl<const WRITE: usize, const ERASE: usize> ReadNorFlash for Simulated<WRITE, ERASE> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        check_read(self, offset, bytes.len())?;
        bytes.copy_from_slice(&self.cells.0[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        CAPACITY
    }
}

impl<const WRITE: usize, const ERASE: usize> NorFlash for Simulated<WRITE, ERASE> {
    const WRITE_SIZE: usize = WRITE;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        check_erase(self, from, to)?;
        let (from, to) = (from as usize, to as usize);
        let outcome = self.supply.borrow_mut().spend(to - from);
        let end = match outcome {
            Outcome::Done => to,
            Outcome::Torn(at) => from + at,
            Outcome::Ignored => from,
        };
        // Sector by sector: those behind the cut have not been touched.
        let whole = from..end / ERASE * ERASE;
        self.cells.0[whole.clone()].fill(0xff);
        self.programmed[whole.start / WRITE..whole.end / WRITE].fill(false);
        if let Outcome::Torn(_) = outcome {
            self.tear_erase(whole.end..whole.end + ERASE, end - whole.end);
        }
        self.weaken(from..to);
        result(&outcome)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        check_write(self, offset, bytes.len())?;
        let offset = offset as usize;
        let outcome = self.supply.borrow_mut().spend(bytes.len());
        let words = match outcome {
            Outcome::Done => bytes.len() / WRITE,
            Outcome::Torn(at) => at / WRITE + 1,
            Outcome::Ignored => 0,
        };
        for (index, word) in bytes.chunks(WRITE).enumerate().take(words) {
            let at = offset + index * WRITE;
            assert!(!self.programmed[at / WRITE], "the word at {at} is programmed twice");
            self.programmed[at / WRITE] = true;
            let torn = matches!(outcome, Outcome::Torn(_)) && index + 1 == words;
            for (cell, byte) in self.cells.0[at..at + WRITE].iter_mut().zip(word) {
                // All of a torn word is undefined.
                *cell = if torn { self.supply.borrow_mut().generator.random() } else { *cell & byte };
            }
        }
        self.weaken(offset..offset + bytes.len());
        result(&outcome)
    }
}

fn result(outcome: &Outcome) -> Result<(), NorFlashErrorKind> {
    if matches!(outcome, Outcome::Done) { Ok(()) } else { Err(NorFlashErrorKind::Other) }
}
