//! Walks one function along its flow.
//!
//! *in* an entry and the functions known not to return; *out* its calls, each with the depth of the stack at which it is made,
//! and the deepest point; *never* a call that can be made is missing: what cannot be followed is a [`Flaw`]; *source* Armv7-M
//! procedure calls.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt,
};

use super::{
    Elf,
    instruction::{Condition, Flow, Instruction, Stack},
};

/// Deepest stack that is still followed: all memory of the microcontroller. A loop that pushes gets there.
const LIMIT: i32 = 192 * 1024;

/// Why a function cannot be followed to all its ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Flaw {
    /// The stack pointer is set to a value that is not known, at this address.
    DynamicStack(u32),
    /// The function returns at this address with another stack pointer than it was entered with, or goes above it, or below all
    /// memory.
    Unbalanced(u32),
    /// What would be executed at this address is no instruction.
    NoCode(u32),
    /// A table of jumps at this address leads out of the function.
    Table(u32),
}

impl fmt::Display for Flaw {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::DynamicStack(at) => write!(formatter, "{at:#010x}: the stack pointer gets a value that is not known"),
            Self::Unbalanced(at) => write!(formatter, "{at:#010x}: the stack pointer is not where it was at the entry"),
            Self::NoCode(at) => write!(formatter, "{at:#010x}: no instruction"),
            Self::Table(at) => write!(formatter, "{at:#010x}: a table of jumps leads out of the function"),
        }
    }
}

/// What a function does.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Function {
    /// Functions that it calls or jumps to, with the deepest stack, bytes below its entry, at which it does.
    pub calls: BTreeMap<u32, u32>,
    /// Addresses of the calls of, and jumps to, what a register says; with the depth.
    pub indirect: BTreeMap<u32, u32>,
    /// Bytes of stack at its own deepest point.
    pub frame: u32,
    /// Whether it returns to its caller, or jumps to a function that does.
    pub returns: bool,
    /// What could not be followed.
    pub flaws: BTreeSet<Flaw>,
}

/// The rest of an IT block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
struct Block {
    rest: Condition,
    /// Whether the condition of the first instruction holds; unknown when the flags were written since.
    holds: Option<bool>,
}

impl Block {
    /// Whether the instruction at hand is executed, if that is known.
    fn executes(self) -> Option<bool> {
        if self.rest.count == 0 { Some(true) } else { self.holds.map(|holds| holds == (self.rest.alike & 1 != 0)) }
    }

    /// The block after the instruction at hand. Right behind its end the condition is still known: a long conditional stretch is
    /// made of several blocks.
    fn after(self, instruction: &Instruction) -> Self {
        if self.rest.count == 0 {
            return Self::default();
        }
        let rest = Condition { count: self.rest.count - 1, alike: self.rest.alike >> 1, ..self.rest };
        Self { rest, holds: self.holds.filter(|_| !instruction.flags) }
    }

    /// What may be known of the condition of a block that starts at hand.
    fn outcomes(self, rest: Condition) -> Vec<bool> {
        match self.holds {
            Some(holds) if self.rest.code >> 1 == rest.code >> 1 => vec![holds == (self.rest.code == rest.code)],
            _ => vec![true, false],
        }
    }
}

/// A point of the walk: where, how deep, and what is conditional from here on.
type Point = (u32, i32, Block);

/// A walk in progress.
struct Walk<'a> {
    image: &'a Elf,
    start: u32,
    end: u32,
    endless: &'a BTreeSet<u32>,
    found: Function,
    seen: BTreeSet<Point>,
    open: Vec<Point>,
}

/// Walks the function which is entered at `entry`; calls of `endless` functions do not come back.
pub fn walk(image: &Elf, entry: u32, endless: &BTreeSet<u32>) -> Function {
    let (start, end) = image.function(entry).map_or((entry, entry), |(start, symbol)| (start, symbol.end));
    let mut walk = Walk { image, start, end, endless, found: Function::default(), seen: BTreeSet::new(), open: Vec::new() };
    walk.visit((entry, 0, Block::default()));
    while let Some(point) = walk.open.pop() {
        walk.step(point);
    }
    walk.found
}

impl Walk<'_> {
    fn visit(&mut self, point: Point) {
        if self.seen.insert(point) {
            self.open.push(point);
        }
    }

    fn call(&mut self, target: u32, depth: i32) {
        let deepest = self.found.calls.entry(target).or_default();
        *deepest = depth.cast_unsigned().max(*deepest);
    }

    /// Goes on at an address: within the function, or for good to another one, which returns in this one's place.
    fn go(&mut self, (address, depth, block): Point) {
        if (self.start..self.end).contains(&address) {
            return self.visit((address, depth, block));
        }
        self.call(address, depth);
        if !self.endless.contains(&address) {
            self.leave(address, depth);
        }
    }

    fn leave(&mut self, at: u32, depth: i32) {
        self.found.returns = true;
        if depth != 0 {
            self.found.flaws.insert(Flaw::Unbalanced(at));
        }
    }

    fn indirect(&mut self, at: u32, depth: i32) {
        let deepest = self.found.indirect.entry(at).or_default();
        *deepest = depth.cast_unsigned().max(*deepest);
    }

    fn step(&mut self, (address, depth, block): Point) {
        let Ok(instruction) = self.image.instruction(address) else {
            self.found.flaws.insert(Flaw::NoCode(address));
            return;
        };
        let next = address + instruction.length;
        let left = block.after(&instruction);
        if block.executes() != Some(true) {
            self.go((next, depth, left));
        }
        if block.executes() == Some(false) {
            return;
        }
        let after = match instruction.stack {
            Stack::Same => depth,
            Stack::Down(bytes) => depth.saturating_add(bytes),
            Stack::Dynamic => {
                self.found.flaws.insert(Flaw::DynamicStack(address));
                depth
            }
        };
        if !(0..=LIMIT).contains(&after) {
            self.found.flaws.insert(Flaw::Unbalanced(address));
            return;
        }
        self.found.frame = self.found.frame.max(after.cast_unsigned());
        let here = (next, after, left);
        let there = |target| (target, after, Block::default());
        match instruction.flow {
            Flow::Next => self.go(here),
            Flow::Conditional(rest) => {
                for holds in block.outcomes(rest) {
                    self.go((next, after, Block { rest, holds: Some(holds) }));
                }
            }
            Flow::Jump(target) => self.go(there(target)),
            Flow::Branch(target) => {
                self.go(there(target));
                self.go(here);
            }
            Flow::Call(target) => {
                self.call(target, after);
                self.come_back(!self.endless.contains(&target), here);
            }
            Flow::CallRegister => {
                self.indirect(address, after);
                self.come_back(true, here);
            }
            Flow::JumpRegister => match self.veneer(address) {
                Some(target) => self.go(there(target)),
                None => self.jump(address, after),
            },
            // With something left on the stack the link register holds the address of a label.
            Flow::Return if instruction.stack == Stack::Same && after != 0 => self.jump(address, after),
            Flow::Return => self.leave(address, after),
            Flow::JumpLiteral(at) => match self.image.bytes(at) {
                Some(bytes) => self.go(there(u32::from_le_bytes(bytes) & !1)),
                None => drop(self.found.flaws.insert(Flaw::NoCode(address))),
            },
            Flow::Table { at, wide } => self.table(at, wide, after),
            Flow::Trap => {}
            Flow::Unknown => drop(self.found.flaws.insert(Flaw::NoCode(address))),
        }
    }

    /// Follows a jump to an address in a register: to every label in the function's tables, if it was said to stay within.
    fn jump(&mut self, address: u32, depth: i32) {
        let labels = self.image.labels(self.start, self.end);
        if labels.is_empty() {
            self.indirect(address, depth);
            return self.leave(address, depth);
        }
        labels.into_iter().for_each(|label| self.visit((label, depth, Block::default())));
    }

    /// The point behind a call. The compiler puts nothing behind one that never returns: there the function may end, or a literal
    /// lie.
    fn come_back(&mut self, returns: bool, point: Point) {
        if returns && (self.start..self.end).contains(&point.0) && self.image.is_code(point.0) {
            self.visit(point);
        }
    }

    /// Where the linker's veneer for far calls leads: MOVW r12, MOVT r12, BX r12.
    fn veneer(&self, address: u32) -> Option<u32> {
        let bytes: [u8; 10] = self.image.bytes(self.start)?;
        let half = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        let part = |first: u16, second: u16| {
            u32::from((first & 0xf) << 12 | (first & 0x400) << 1 | (second & 0x7000) >> 4 | second & 0xff)
        };
        let shape = [half(0) & 0xfbf0, half(2) & 0x8f00, half(4) & 0xfbf0, half(6) & 0x8f00, half(8)];
        let matches = address == self.start + 8 && shape == [0xf240, 0x0c00, 0xf2c0, 0x0c00, 0x4760];
        matches.then(|| (part(half(4), half(6)) << 16 | part(half(0), half(2))) & !1)
    }

    /// Follows a table of jumps: it ends with the data that it is, or where the first of its targets starts.
    fn table(&mut self, at: u32, wide: bool, depth: i32) {
        let mut end = self.image.end_of_data(at).unwrap_or(at).min(self.end);
        let mut entry = at;
        while entry < end {
            let offset = match (wide, self.image.bytes::<2>(entry)) {
                (_, None) => break,
                (true, Some(bytes)) => u16::from_le_bytes(bytes),
                (false, Some([byte, _])) => u16::from(byte),
            };
            let target = at + 2 * u32::from(offset);
            let leaves = !(self.start..self.end).contains(&target) || !self.image.is_code(target);
            // What fills a table up to the next word is no entry: zeros and NOPs, which as entries would lead nowhere, or what
            // the compiler fills with, if the check before the jump says so.
            let fills = match (wide, offset) {
                (true, 0 | 0xbf00 | 0xd4d4) | (false, 0) => leaves,
                (false, 0xd4) => self.has_check(at, entry - at),
                _ => false,
            };
            if fills && end - entry < 4 {
                break;
            }
            entry += if wide { 2 } else { 1 };
            if leaves {
                self.found.flaws.insert(Flaw::Table(at));
                return;
            }
            end = end.min(target);
            self.visit((target, depth, Block::default()));
        }
        if entry == at {
            self.found.flaws.insert(Flaw::Table(at));
        }
    }

    /// Whether shortly before the table at `at` some register is compared with the number of the last of `entries`.
    fn has_check(&self, at: u32, entries: u32) -> bool {
        let halves = |address: u32| {
            self.image.bytes::<4>(address).map_or((0, 0), |[a, b, c, d]| (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d])))
        };
        (at.saturating_sub(48).max(self.start)..at).step_by(2).map(halves).any(|(first, second)| {
            let narrow = first >> 11 == 0b00101 && u32::from(first & 0xff) + 1 == entries;
            let wide = first & 0xfff0 == 0xf1b0 && second >> 8 == 0x0f && u32::from(second & 0xff) + 1 == entries;
            narrow || wide
        })
    }
}
