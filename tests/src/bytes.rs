//! What the bytes of a fuzz target say, for targets that are told what to do.
//!
//! *in* any bytes; *out* choices, ticks and numbers of any kind, most of them such as there are in flight; *never* an end: behind
//! the last byte everything is zero.

/// Numbers that break arithmetic which trusts them.
pub const EXTREMES: [f32; 8] = [0.0, 1.0, -3.4e38, 3.4e38, 1e-40, f32::INFINITY, f32::NEG_INFINITY, f32::NAN];

/// Bytes that are read one after the other.
#[derive(Debug)]
pub struct Bytes<'a>(pub &'a [u8]);

impl Bytes<'_> {
    /// Whether none is left.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The next one.
    pub fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        *first
    }

    /// One of `count` choices.
    pub fn choice(&mut self, count: u8) -> u8 {
        self.byte() % count
    }

    /// Any bits.
    pub fn word(&mut self) -> u32 {
        u32::from_le_bytes([(); 4].map(|()| self.byte()))
    }

    /// A number of any kind, in most cases a small one from one byte, so that numbers that are good take part.
    pub fn number(&mut self) -> f32 {
        match self.byte() {
            0xff => f32::from_bits(self.word()),
            kind @ 0xf0.. => EXTREMES[usize::from(kind) % EXTREMES.len()],
            kind => (f32::from(kind) - 120.0) / 40.0,
        }
    }

    /// As many numbers.
    pub fn numbers<const N: usize>(&mut self) -> [f32; N] {
        [(); N].map(|()| self.number())
    }

    /// A tick: in most cases one near `tick`, else any.
    pub fn tick(&mut self, tick: i32) -> i32 {
        match self.byte() {
            0xff => self.word() as i32,
            near => tick.wrapping_add(i32::from(near) - 128),
        }
    }
}
