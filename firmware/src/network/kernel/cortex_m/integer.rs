//! Dense integer layers.
//!
//! Eight accumulators in r6-r12 and lr; r4 streams the weights, r5 the inputs; r0-r3 hold an input word and weights, or two input
//! words while one gives way to the next. Account for int8, of 4 inputs × 8 rows = 32 multiplications: 16 SMLAD, 8 LSL, 8 + 2
//! words loaded in three runs: 16 + 8 + 10 + 3 = 37 cycles; int16: 16 + 18 + 6 = 40. Five chunks are unrolled; their number's
//! remainder decides where the first pass enters. A block adds about 65: 9 biases, 10 multipliers, 24 SMMLAR, USAT, PKHBT and
//! UQSUB16, the rest control.

use core::arch::naked_asm;

use super::{
    aligned, each,
    frame::{extension, frame},
};
use crate::network::kernel::{
    portable,
    stream::{Finish, Width},
};

/// Chunks of four inputs in the unrolled integer loops.
const UNROLLED: usize = 5;

/// A layer's part of the integer kernels' arguments, in the order in which they load it.
#[derive(Clone, Debug)]
#[repr(C)]
struct Shape {
    /// Bytes of the inputs and of the outputs.
    inputs: u32,
    outputs: u32,
    /// Chunks to skip in the first pass of the unrolled loop.
    skipped: u32,
    /// Added to a code before USAT; 0: sums.
    offset: u32,
    /// In both halves, subtracted after USAT, so that 16 bits saturate at a limit; 0: tanh.
    offsets: u32,
    /// For tanh: twice the code of 1.
    factor: u32,
}

/// An integer layer that suits the kernels.
#[derive(Clone, Debug)]
pub(in crate::network::kernel) struct Integer<'a> {
    /// Exactly the blocks that `shape` says, on a word boundary.
    stream: &'a [[u8; 4]],
    shape: Shape,
    width: Width,
    /// Subtracted from each code in the end.
    excess: u16,
}

impl<'a> Integer<'a> {
    /// A layer of `inputs` words, if it suits the kernels.
    pub(in crate::network::kernel) fn new(width: Width, stream: &'a [[u8; 4]], inputs: usize, finish: Finish) -> Option<Self> {
        let blocks = stream.len() / width.block(inputs);
        let pairs = inputs > 0 && inputs.is_multiple_of(2);
        if !(blocks > 0 && pairs && aligned(stream) && stream.len() == blocks * width.block(inputs)) {
            return None;
        }
        let limited = |limit: u16| u32::from(limit.min(i16::MAX as u16));
        let (offset, subtracted, factor, excess) = match finish {
            Finish::Codes { limit } => (65_535 - limited(limit), 65_535 - limited(limit), 0, 0),
            Finish::Linear { limit } => (65_535 - limited(limit), 65_535 - 2 * limited(limit), 0, limited(limit) as u16),
            Finish::Tanh { limit } => (32_768, 0, 2 * limited(limit), 0),
            Finish::Sums => (0, 0, 0, 0),
        };
        let shape = Shape {
            inputs: 4 * inputs as u32,
            outputs: 4 * (blocks * finish.words()) as u32,
            skipped: ((UNROLLED - inputs / 2 % UNROLLED) % UNROLLED) as u32,
            offset,
            offsets: subtracted << 16 | subtracted,
            factor,
        };
        Some(Self { stream, shape, width, excess })
    }

    /// What the twin's `integer` computes, if there are enough inputs and outputs.
    #[inline(always)]
    pub(in crate::network::kernel) fn run(&self, inputs: &[u32], outputs: &mut [u32]) {
        let shape = &self.shape;
        if inputs.len() < shape.inputs as usize / 4 || outputs.len() < shape.outputs as usize / 4 {
            return;
        }
        let (stream, from, to) = (self.stream.as_ptr(), inputs.as_ptr(), outputs.as_mut_ptr());
        // SAFETY: the pointers come from live slices. `new`, which alone makes a shape, has checked that the stream is aligned to
        // words and exactly as long as the blocks that belong to `shape.outputs`; for each of them the kernel reads its part of
        // the stream and `shape.inputs` (a whole number of chunks, `skipped` fewer than a multiple of the unrolled loop's). It
        // writes `shape.outputs`. Both are inside of the slices (checked above). It keeps the registers that the calling
        // convention protects.
        unsafe {
            match self.width {
                Width::Int8 => int8(shape, stream, from, to),
                Width::Int16 => int16(shape, stream, from, to),
            }
        }
        if self.excess > 0 {
            for word in outputs.iter_mut().take(shape.outputs as usize / 4) {
                *word = portable::pair(
                    (*word as u16).wrapping_sub(self.excess) as i16,
                    ((*word >> 16) as u16).wrapping_sub(self.excess) as i16,
                );
            }
        }
    }
}

// Every instruction of the integer kernels is 32 bits wide and so lies on a word: branch targets cost no second fetch, and the
// loop with its block's end (0.9 KiB) fits into the 1 KiB of an STM32F4's instruction cache.

/// SMLAD of two rows with a word of bytes: `lsls` is the only unpacking.
macro_rules! two_rows {
    ($word:literal, $input:literal, $even:literal, $odd:literal) => {
        concat!(
            "smlad ", $even, ", ", $word, ", ", $input, ", ", $even, "\n", "lsl.w ", $word, ", ", $word, ", #8\n", "smlad ",
            $odd, ", ", $word, ", ", $input, ", ", $odd, "\n",
        )
    };
}

/// Four inputs, eight rows, bytes. r4 moves on with the first load.
macro_rules! int8_chunk {
    () => {
        concat!(
            "ldr.w r0, [r5], #4\n",
            "ldr.w r1, [r4], #32\n",
            "ldr r2, [r4, #-28]\n",
            "ldr r3, [r4, #-24]\n",
            two_rows!("r1", "r0", "r6", "r7"),
            two_rows!("r2", "r0", "r8", "r9"),
            two_rows!("r3", "r0", "r10", "r11"),
            "ldr r1, [r4, #-20]\n",
            "ldr.w r2, [r5], #4\n",
            "ldr r3, [r4, #-16]\n",
            two_rows!("r1", "r0", "r12", "lr"),
            two_rows!("r3", "r2", "r6", "r7"),
            "ldr r0, [r4, #-12]\n",
            "ldr r1, [r4, #-8]\n",
            "ldr r3, [r4, #-4]\n",
            two_rows!("r0", "r2", "r8", "r9"),
            two_rows!("r1", "r2", "r10", "r11"),
            two_rows!("r3", "r2", "r12", "lr"),
        )
    };
}

/// SMLAD of one row with a word of halves.
macro_rules! one_row {
    ($word:literal, $input:literal, $row:literal) => {
        concat!("smlad ", $row, ", ", $word, ", ", $input, ", ", $row, "\n")
    };
}

/// Four inputs, eight rows, halves. r4 moves on with the first load.
macro_rules! int16_chunk {
    () => {
        concat!(
            "ldr.w r0, [r5], #4\n",
            "ldr.w r1, [r4], #64\n",
            "ldr r2, [r4, #-60]\n",
            "ldr r3, [r4, #-56]\n",
            one_row!("r1", "r0", "r6"),
            one_row!("r2", "r0", "r7"),
            one_row!("r3", "r0", "r8"),
            "ldr r1, [r4, #-52]\n",
            "ldr r2, [r4, #-48]\n",
            "ldr r3, [r4, #-44]\n",
            one_row!("r1", "r0", "r9"),
            one_row!("r2", "r0", "r10"),
            one_row!("r3", "r0", "r11"),
            "ldr r1, [r4, #-40]\n",
            "ldr r2, [r4, #-36]\n",
            "ldr.w r3, [r5], #4\n",
            one_row!("r1", "r0", "r12"),
            one_row!("r2", "r0", "lr"),
            "ldr r0, [r4, #-32]\n",
            "ldr r1, [r4, #-28]\n",
            "ldr r2, [r4, #-24]\n",
            one_row!("r0", "r3", "r6"),
            one_row!("r1", "r3", "r7"),
            one_row!("r2", "r3", "r8"),
            "ldr r0, [r4, #-20]\n",
            "ldr r1, [r4, #-16]\n",
            "ldr r2, [r4, #-12]\n",
            one_row!("r0", "r3", "r9"),
            one_row!("r1", "r3", "r10"),
            one_row!("r2", "r3", "r11"),
            "ldr r0, [r4, #-8]\n",
            "ldr r1, [r4, #-4]\n",
            one_row!("r0", "r3", "r12"),
            one_row!("r1", "r3", "lr"),
        )
    };
}

/// tanh of four codes (moved up to 0..65,535) in units of 2⁻³¹: a chord and the way along it.
macro_rules! four_tanh {
    ($a:literal, $b:literal, $c:literal, $d:literal) => {
        concat!(
            each!("lsr.w" "r0" $a "#8"; "lsr.w" "r1" $b "#8"; "lsr.w" "r2" $c "#8"; "lsr.w" "r3" $d "#8";
                "ldr.w" "r0" "[r5" "r0, lsl #2]"; "ldr.w" "r1" "[r5" "r1, lsl #2]"; "ldr.w" "r2" "[r5" "r2, lsl #2]";
                "ldr.w" "r3" "[r5" "r3, lsl #2]";
                "lsl.w" $a $a "#7"; "lsl.w" $b $b "#7"; "lsl.w" $c $c "#7"; "lsl.w" $d $d "#7";),
            "smlabb ", $a, ", r0, ", $a, ", r0\nsmlabb ", $b, ", r1, ", $b, ", r1\n",
            "smlabb ", $c, ", r2, ", $c, ", r2\nsmlabb ", $d, ", r3, ", $d, ", r3\n",
        )
    };
}

/// A whole integer kernel round a chunk. Arguments: r0 a [`Shape`], r1 the stream, r2 the inputs, r3 the outputs.
macro_rules! integer_kernel {
    ($chunk:expr) => {
        naked_asm!(
            extension!(),
            ".balign 4",
            frame!(enter),
            "ldm.w r0, {{r5-r10}}",
            "mov.w r4, r1",
            "adr.w r1, 30f",
            "ldr.w r1, [r1, r7, lsl #2]",
            "add.w r5, r5, r2",
            "add.w r6, r6, r3",
            frame!(keep 0 "r2"),
            frame!(keep 1 "r5"),
            frame!(keep 2 "r1"),
            frame!(keep 3 "r3"),
            frame!(keep 4 "r6"),
            frame!(keep 5 "r8"),
            frame!(keep 6 "r9"),
            frame!(keep 7 "r10"),
            // A block: biases, and into the loop.
            "20:",
            "ldm.w r4!, {{r6-r12, lr}}",
            frame!(fetch "r5" 0),
            frame!(fetch "r0" 2),
            "bx r0",
            ".balign 4",
            "10:",
            $chunk,
            "11:",
            $chunk,
            "12:",
            $chunk,
            "13:",
            $chunk,
            "14:",
            $chunk,
            frame!(fetch "r0" 1),
            "cmp.w r5, r0",
            "bne.w 10b",
            frame!(fetch "r5" 5),
            "cmp.w r5, #0",
            "beq.w 41f",
            // With the offset, 16 unsigned bits saturate at the limit; taking it away saturates at 0.
            "ldm.w r4!, {{r0-r3}}",
            "smmlar r6, r6, r0, r5",
            "smmlar r7, r7, r1, r5",
            "smmlar r8, r8, r2, r5",
            "smmlar r9, r9, r3, r5",
            "ldm.w r4!, {{r0-r3}}",
            "smmlar r10, r10, r0, r5",
            "smmlar r11, r11, r1, r5",
            "smmlar r12, r12, r2, r5",
            "smmlar lr, lr, r3, r5",
            frame!(fetch "r5" 6),
            frame!(fetch "r0" 3),
            "usat r6, #16, r6",
            "usat r7, #16, r7",
            "usat r8, #16, r8",
            "usat r9, #16, r9",
            "usat r10, #16, r10",
            "usat r11, #16, r11",
            "usat r12, #16, r12",
            "usat lr, #16, lr",
            "cmp.w r5, #0",
            "beq.w 40f",
            "pkhbt r6, r6, r7, lsl #16",
            "pkhbt r7, r8, r9, lsl #16",
            "pkhbt r8, r10, r11, lsl #16",
            "pkhbt r9, r12, lr, lsl #16",
            "uqsub16 r6, r6, r5",
            "uqsub16 r7, r7, r5",
            "uqsub16 r8, r8, r5",
            "uqsub16 r9, r9, r5",
            "21:",
            frame!(fetch "r1" 4),
            "stm.w r0!, {{r6-r9}}",
            "cmp.w r0, r1",
            frame!(keep 3 "r0"),
            "bne.w 20b",
            frame!(leave),
            ".balign 4",
            "30:",
            ".word 10b + 1, 11b + 1, 12b + 1, 13b + 1, 14b + 1",
            // tanh: the table of chords, then the code of 1.
            "40:",
            "movw r5, #:lower16:{table}",
            "movt r5, #:upper16:{table}",
            four_tanh!("r6", "r7", "r8", "r9"),
            four_tanh!("r10", "r11", "r12", "lr"),
            frame!(fetch "r5" 7),
            frame!(fetch "r0" 3),
            "smmulr r6, r6, r5",
            "smmulr r7, r7, r5",
            "smmulr r8, r8, r5",
            "smmulr r9, r9, r5",
            "smmulr r10, r10, r5",
            "smmulr r11, r11, r5",
            "smmulr r12, r12, r5",
            "smmulr lr, lr, r5",
            "pkhbt r6, r6, r7, lsl #16",
            "pkhbt r7, r8, r9, lsl #16",
            "pkhbt r8, r10, r11, lsl #16",
            "pkhbt r9, r12, lr, lsl #16",
            "b.w 21b",
            // Sums.
            "41:",
            frame!(fetch "r0" 3),
            frame!(fetch "r1" 4),
            "add.w r4, r4, #32",
            "stm.w r0!, {{r6-r12, lr}}",
            "cmp.w r0, r1",
            frame!(keep 3 "r0"),
            "bne.w 20b",
            frame!(leave),
            table = sym crate::network::tanh::TABLE,
        )
    };
}

/// # Safety
/// `stream`, `inputs` and `outputs` must point to live, aligned memory as long as `shape` says, which [`Integer::new`] made.
#[unsafe(naked)]
unsafe extern "C" fn int8(shape: &Shape, stream: *const [u8; 4], inputs: *const u32, outputs: *mut u32) {
    integer_kernel!(int8_chunk!())
}

/// # Safety
/// As for [`int8`].
#[unsafe(naked)]
unsafe extern "C" fn int16(shape: &Shape, stream: *const [u8; 4], inputs: *const u32, outputs: *mut u32) {
    integer_kernel!(int16_chunk!())
}
