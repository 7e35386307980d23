//! The kernels for the Cortex-M4F, in assembly: the only unsafe code of the project.
//!
//! *in* slices whose lengths and alignment the safe wrappers check; *out* the bits of the [portable twin](super::portable); *never*
//! a branch that depends on data: the cycles of a layer follow from its shape; *source* the instruction timings of the Cortex-M4
//! Technical Reference Manual, section 3.3: SMLAD, LSL, VMUL, VADD 1 cycle; n loads in a row (LDR or LDM) n + 1.
//!
//! # Integers
//! Eight accumulators in r6-r12 and lr; r4 streams the weights, r5 the inputs; r0-r3 hold an input word and weights, or two input
//! words while one gives way to the next. What a block needs only once waits in s0-s7 (1 cycle to fetch). Account for int8, of
//! 4 inputs × 8 rows = 32 multiplications: 16 SMLAD, 8 LSL, 8 + 2 words loaded in three runs: 16 + 8 + 10 + 3 = 37 cycles; int16:
//! 16 + 18 + 6 = 40. Five chunks are unrolled; their number's remainder decides where the first pass enters. A block adds about 65: 9 biases, 10 multipliers, 24 SMMLAR, USAT, PKHBT and UQSUB16, the rest control.
//!
//! # Floats
//! Twelve accumulators in s0-s11, an input's weights in s12-s23, eight inputs in s24-s31. Eight inputs × 12 rows: 96 VMUL, 96 VADD,
//! 8 × 13 + 9 cycles of VLDM: 305. What rows are left go by eight: accumulators in s0-s7, two inputs' weights in s8-s23; eight inputs:
//! 64 + 64 + 4 × 17 + 9 = 205. Six rows alone: 48 + 48 + 4 × 13 + 9 = 157. No result is used by the next instruction, which would stall.
#![allow(unsafe_code)]

use core::arch::naked_asm;

use super::{Finish, Width, float_blocks};

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

/// Whether a stream lies on a word boundary, as LDM needs.
fn aligned(stream: &[[u8; 4]]) -> bool {
    stream.as_ptr().addr().is_multiple_of(4)
}

/// An integer layer that suits the kernels.
#[derive(Clone, Debug)]
pub(super) struct Integer<'a> {
    /// Exactly the blocks that `shape` says, on a word boundary.
    stream: &'a [[u8; 4]],
    shape: Shape,
    width: Width,
    /// Subtracted from each code in the end.
    excess: u16,
}

impl<'a> Integer<'a> {
    /// A layer of `inputs` words, if it suits the kernels.
    pub(super) fn new(width: Width, stream: &'a [[u8; 4]], inputs: usize, finish: Finish) -> Option<Self> {
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

    /// [`super::Integer::run`].
    #[inline(always)]
    pub(super) fn run(&self, inputs: &[u32], outputs: &mut [u32]) {
        let shape = &self.shape;
        if inputs.len() < shape.inputs as usize / 4 || outputs.len() < shape.outputs as usize / 4 {
            return;
        }
        let (stream, from, to) = (self.stream.as_ptr(), inputs.as_ptr(), outputs.as_mut_ptr());
        // SAFETY: the pointers come from live slices. `new`, which alone makes a shape, has checked that the stream is aligned to words and
        // exactly as long as the blocks that belong to `shape.outputs`; for each of them the kernel reads its part of the stream and
        // `shape.inputs` (a whole number of chunks, `skipped` fewer than a multiple of the unrolled loop's). It writes `shape.outputs`. Both are
        // inside of the slices (checked above). It keeps the registers that the calling convention protects.
        unsafe {
            match self.width {
                Width::Int8 => int8(shape, stream, from, to),
                Width::Int16 => int16(shape, stream, from, to),
            }
        }
        if self.excess > 0 {
            for word in outputs.iter_mut().take(shape.outputs as usize / 4) {
                *word = super::portable::pair(
                    (*word as u16).wrapping_sub(self.excess) as i16,
                    ((*word >> 16) as u16).wrapping_sub(self.excess) as i16,
                );
            }
        }
    }
}

// Every instruction of the integer kernels is 32 bits wide and so lies on a word: branch targets cost no second fetch, and the loop with
// its block's end (0.9 KiB) fits into the 1 KiB of an STM32F4's instruction cache.

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
            "lsr.w r0, ",
            $a,
            ", #8\nlsr.w r1, ",
            $b,
            ", #8\nlsr.w r2, ",
            $c,
            ", #8\nlsr.w r3, ",
            $d,
            ", #8\n",
            "ldr.w r0, [r5, r0, lsl #2]\nldr.w r1, [r5, r1, lsl #2]\nldr.w r2, [r5, r2, lsl #2]\nldr.w r3, [r5, r3, lsl #2]\n",
            "lsl.w ",
            $a,
            ", ",
            $a,
            ", #7\nlsl.w ",
            $b,
            ", ",
            $b,
            ", #7\nlsl.w ",
            $c,
            ", ",
            $c,
            ", #7\nlsl.w ",
            $d,
            ", ",
            $d,
            ", #7\n",
            "smlabb ",
            $a,
            ", r0, ",
            $a,
            ", r0\nsmlabb ",
            $b,
            ", r1, ",
            $b,
            ", r1\n",
            "smlabb ",
            $c,
            ", r2, ",
            $c,
            ", r2\nsmlabb ",
            $d,
            ", r3, ",
            $d,
            ", r3\n",
        )
    };
}

/// A whole integer kernel round a chunk. Arguments: r0 a [`Shape`], r1 the stream, r2 the inputs, r3 the outputs.
macro_rules! integer_kernel {
    ($chunk:expr) => {
        naked_asm!(
            ".arch armv7e-m",
            ".fpu fpv4-sp-d16",
            ".balign 4",
            "push {{r4-r11, lr}}",
            "ldm.w r0, {{r5-r10}}",
            "mov.w r4, r1",
            "adr.w r1, 30f",
            "ldr.w r1, [r1, r7, lsl #2]",
            "add.w r5, r5, r2",
            "add.w r6, r6, r3",
            "vmov s0, r2",
            "vmov s1, r5",
            "vmov s2, r1",
            "vmov s3, r3",
            "vmov s4, r6",
            "vmov s5, r8",
            "vmov s6, r9",
            "vmov s7, r10",
            // A block: biases, and into the loop.
            "20:",
            "ldm.w r4!, {{r6-r12, lr}}",
            "vmov r5, s0",
            "vmov r0, s2",
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
            "vmov r0, s1",
            "cmp.w r5, r0",
            "bne.w 10b",
            "vmov r5, s5",
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
            "vmov r5, s6",
            "vmov r0, s3",
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
            "vmov r1, s4",
            "stm.w r0!, {{r6-r9}}",
            "cmp.w r0, r1",
            "vmov s3, r0",
            "bne.w 20b",
            "pop {{r4-r11, pc}}",
            ".balign 4",
            "30:",
            ".word 10b + 1, 11b + 1, 12b + 1, 13b + 1, 14b + 1",
            // tanh: the table of chords, then the code of 1.
            "40:",
            "movw r5, #:lower16:{table}",
            "movt r5, #:upper16:{table}",
            four_tanh!("r6", "r7", "r8", "r9"),
            four_tanh!("r10", "r11", "r12", "lr"),
            "vmov r5, s7",
            "vmov r0, s3",
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
            "vmov r0, s3",
            "vmov r1, s4",
            "add.w r4, r4, #32",
            "stm.w r0!, {{r6-r12, lr}}",
            "cmp.w r0, r1",
            "vmov s3, r0",
            "bne.w 20b",
            "pop {{r4-r11, pc}}",
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

/// A layer's part of the float kernels' arguments, in the order in which they load it.
#[derive(Clone, Debug)]
#[repr(C)]
struct FloatShape {
    /// Bytes of the outputs of the blocks of twelve rows.
    twelves: u32,
    /// Pairs of inputs that are not in whole groups of eight: 0 to 3.
    pairs: u32,
    /// Bytes of the inputs.
    inputs: u32,
    /// 0: ReLU.
    linear: u32,
    /// Bytes of all outputs.
    outputs: u32,
}

/// A float layer that suits the kernels.
#[derive(Clone, Debug)]
pub(super) struct Float<'a> {
    /// Exactly the blocks that `shape` says, on a word boundary.
    stream: &'a [[u8; 4]],
    shape: FloatShape,
    six: bool,
}

impl<'a> Float<'a> {
    /// A layer of so many words, if it suits the kernels.
    pub(super) fn new(stream: &'a [[u8; 4]], inputs: usize, relu: bool, outputs: usize) -> Option<Self> {
        let [twelves, _, sixes] = float_blocks(outputs)?;
        let pairs = inputs > 0 && inputs.is_multiple_of(2);
        if !(pairs && aligned(stream) && stream.len() == outputs * (1 + inputs)) {
            return None;
        }
        let shape = FloatShape {
            twelves: 48 * twelves as u32,
            pairs: (inputs % 8 / 2) as u32,
            inputs: 4 * inputs as u32,
            linear: u32::from(!relu),
            outputs: 4 * outputs as u32,
        };
        Some(Self { stream, shape, six: sixes > 0 })
    }

    /// [`super::Float::run`].
    #[inline(always)]
    pub(super) fn run(&self, inputs: &[u32], outputs: &mut [u32]) {
        let shape = &self.shape;
        if inputs.len() < shape.inputs as usize / 4 || outputs.len() < shape.outputs as usize / 4 {
            return;
        }
        let (stream, from, to) = (self.stream.as_ptr(), inputs.as_ptr(), outputs.as_mut_ptr());
        // SAFETY: the pointers come from live slices. `new`, which alone makes a shape, has checked that the stream is aligned to words and
        // that the three lengths fit together: `shape.outputs` are exactly one block of six, or the blocks of twelve and the rest of eight
        // rows, for each of which the kernel reads its part of the stream and all of `shape.inputs` (`pairs` pairs, then whole groups of
        // eight). It writes exactly `shape.outputs`. Both are inside of the slices (checked above). It keeps the registers that the calling
        // convention protects.
        unsafe {
            if self.six {
                float_six_kernel(shape, stream, from, to);
            } else {
                float_kernel(shape, stream, from, to);
            }
        }
    }
}

/// Instructions of three operands.
macro_rules! each {
    ($($operation:literal $a:literal $b:literal $c:literal;)*) => {
        concat!($($operation, " ", $a, ", ", $b, ", ", $c, "\n"),*)
    };
}

/// One input, twelve rows: `$input` holds the input.
macro_rules! float_twelve {
    ($input:literal) => {
        concat!(
            "vldm r0!, {{s12-s23}}\n",
            each!("vmul.f32" "s12" "s12" $input; "vmul.f32" "s13" "s13" $input; "vmul.f32" "s14" "s14" $input;
                "vmul.f32" "s15" "s15" $input; "vmul.f32" "s16" "s16" $input; "vmul.f32" "s17" "s17" $input;
                "vmul.f32" "s18" "s18" $input; "vmul.f32" "s19" "s19" $input; "vmul.f32" "s20" "s20" $input;
                "vmul.f32" "s21" "s21" $input; "vmul.f32" "s22" "s22" $input; "vmul.f32" "s23" "s23" $input;
                "vadd.f32" "s0" "s0" "s12"; "vadd.f32" "s1" "s1" "s13"; "vadd.f32" "s2" "s2" "s14";
                "vadd.f32" "s3" "s3" "s15"; "vadd.f32" "s4" "s4" "s16"; "vadd.f32" "s5" "s5" "s17";
                "vadd.f32" "s6" "s6" "s18"; "vadd.f32" "s7" "s7" "s19"; "vadd.f32" "s8" "s8" "s20";
                "vadd.f32" "s9" "s9" "s21"; "vadd.f32" "s10" "s10" "s22"; "vadd.f32" "s11" "s11" "s23";),
        )
    };
}

/// Two inputs, eight rows: `$first` and `$second` hold the inputs.
macro_rules! float_eight {
    ($first:literal, $second:literal) => {
        concat!(
            "vldm r0!, {{s8-s23}}\n",
            each!("vmul.f32" "s8" "s8" $first; "vmul.f32" "s9" "s9" $first; "vmul.f32" "s10" "s10" $first;
                "vmul.f32" "s11" "s11" $first; "vmul.f32" "s12" "s12" $first; "vmul.f32" "s13" "s13" $first;
                "vmul.f32" "s14" "s14" $first; "vmul.f32" "s15" "s15" $first;
                "vadd.f32" "s0" "s0" "s8"; "vadd.f32" "s1" "s1" "s9"; "vadd.f32" "s2" "s2" "s10"; "vadd.f32" "s3" "s3" "s11";
                "vadd.f32" "s4" "s4" "s12"; "vadd.f32" "s5" "s5" "s13"; "vadd.f32" "s6" "s6" "s14"; "vadd.f32" "s7" "s7" "s15";
                "vmul.f32" "s16" "s16" $second; "vmul.f32" "s17" "s17" $second; "vmul.f32" "s18" "s18" $second;
                "vmul.f32" "s19" "s19" $second; "vmul.f32" "s20" "s20" $second; "vmul.f32" "s21" "s21" $second;
                "vmul.f32" "s22" "s22" $second; "vmul.f32" "s23" "s23" $second;
                "vadd.f32" "s0" "s0" "s16"; "vadd.f32" "s1" "s1" "s17"; "vadd.f32" "s2" "s2" "s18"; "vadd.f32" "s3" "s3" "s19";
                "vadd.f32" "s4" "s4" "s20"; "vadd.f32" "s5" "s5" "s21"; "vadd.f32" "s6" "s6" "s22"; "vadd.f32" "s7" "s7" "s23";),
        )
    };
}

/// Two inputs, six rows: `$first` and `$second` hold the inputs.
macro_rules! float_six {
    ($first:literal, $second:literal) => {
        concat!(
            "vldm r0!, {{s8-s19}}\n",
            each!("vmul.f32" "s8" "s8" $first; "vmul.f32" "s9" "s9" $first; "vmul.f32" "s10" "s10" $first;
                "vmul.f32" "s11" "s11" $first; "vmul.f32" "s12" "s12" $first; "vmul.f32" "s13" "s13" $first;
                "vadd.f32" "s0" "s0" "s8"; "vadd.f32" "s1" "s1" "s9"; "vadd.f32" "s2" "s2" "s10";
                "vadd.f32" "s3" "s3" "s11"; "vadd.f32" "s4" "s4" "s12"; "vadd.f32" "s5" "s5" "s13";
                "vmul.f32" "s14" "s14" $second; "vmul.f32" "s15" "s15" $second; "vmul.f32" "s16" "s16" $second;
                "vmul.f32" "s17" "s17" $second; "vmul.f32" "s18" "s18" $second; "vmul.f32" "s19" "s19" $second;
                "vadd.f32" "s0" "s0" "s14"; "vadd.f32" "s1" "s1" "s15"; "vadd.f32" "s2" "s2" "s16";
                "vadd.f32" "s3" "s3" "s17"; "vadd.f32" "s4" "s4" "s18"; "vadd.f32" "s5" "s5" "s19";),
        )
    };
}

/// ReLU of four accumulators, stored one by one: a cycle less than STM.
macro_rules! float_relu {
    ($a:literal, $b:literal, $c:literal, $d:literal) => {
        concat!(
            "vmov r4, ",
            $a,
            "\nvmov r5, ",
            $b,
            "\nvmov r6, ",
            $c,
            "\nvmov r7, ",
            $d,
            "\n",
            "bic r4, r4, r4, asr #31\nbic r5, r5, r5, asr #31\nbic r6, r6, r6, asr #31\nbic r7, r7, r7, asr #31\n",
            "str r4, [r2], #4\nstr r5, [r2], #4\nstr r6, [r2], #4\nstr r7, [r2], #4\n",
        )
    };
}

/// # Safety
/// `stream`, `inputs` and `outputs` must point to live, aligned memory as long as `shape` says, which [`Float::new`] made.
#[unsafe(naked)]
unsafe extern "C" fn float_kernel(shape: &FloatShape, stream: *const [u8; 4], inputs: *const u32, outputs: *mut u32) {
    naked_asm!(
        ".arch armv7e-m",
        ".fpu fpv4-sp-d16",
        ".balign 4",
        "push {{r4-r11, lr}}",
        "vpush {{s16-s31}}",
        // r0 becomes the stream, r1 the inputs, r2 the outputs, r3 the end of the twelves' outputs.
        "ldm.w r0, {{r7-r11}}",
        "mov.w r0, r1",
        "mov.w r1, r2",
        "mov.w r2, r3",
        "add.w r3, r3, r7",
        "add.w r9, r9, r1",
        "add.w r11, r11, r2",
        "cmp.w r2, r3",
        "beq.w 50f",
        "adr.w r4, 90f",
        "ldr.w lr, [r4, r8, lsl #2]",
        // Blocks of twelve rows: biases, pairs of inputs on the way into the loop, groups of eight inputs.
        "20:",
        "vldm r0!, {{s0-s11}}",
        "mov.w r12, r1",
        "cmp.w r8, #0",
        "bne.w 24f",
        "10:",
        "vldm r12!, {{s24-s31}}",
        float_twelve!("s24"),
        float_twelve!("s25"),
        "11:",
        float_twelve!("s26"),
        float_twelve!("s27"),
        "12:",
        float_twelve!("s28"),
        float_twelve!("s29"),
        "13:",
        float_twelve!("s30"),
        float_twelve!("s31"),
        "cmp.w r12, r9",
        "bne.w 10b",
        "cmp.w r10, #0",
        "bne.w 40f",
        float_relu!("s0", "s1", "s2", "s3"),
        float_relu!("s4", "s5", "s6", "s7"),
        float_relu!("s8", "s9", "s10", "s11"),
        "14:",
        "cmp.w r2, r3",
        "bne.w 20b",
        // Blocks of eight rows, in the same way.
        "50:",
        "mov.w r3, r11",
        "cmp.w r2, r3",
        "beq.w 59f",
        "adr.w r4, 91f",
        "ldr.w lr, [r4, r8, lsl #2]",
        "60:",
        "vldm r0!, {{s0-s7}}",
        "mov.w r12, r1",
        "bx lr",
        ".balign 4",
        "61:",
        "vldm r12!, {{s26-s31}}",
        "b.w 71f",
        "62:",
        "vldm r12!, {{s28-s31}}",
        "b.w 72f",
        "63:",
        "vldm r12!, {{s30-s31}}",
        "b.w 73f",
        "70:",
        "vldm r12!, {{s24-s31}}",
        float_eight!("s24", "s25"),
        "71:",
        float_eight!("s26", "s27"),
        "72:",
        float_eight!("s28", "s29"),
        "73:",
        float_eight!("s30", "s31"),
        "cmp.w r12, r9",
        "bne.w 70b",
        "cmp.w r10, #0",
        "bne.w 80f",
        float_relu!("s0", "s1", "s2", "s3"),
        float_relu!("s4", "s5", "s6", "s7"),
        "54:",
        "cmp.w r2, r3",
        "bne.w 60b",
        "59:",
        "vpop {{s16-s31}}",
        "pop {{r4-r11, pc}}",
        "21:",
        "vldm r12!, {{s26-s31}}",
        "b.w 11b",
        "22:",
        "vldm r12!, {{s28-s31}}",
        "b.w 12b",
        "23:",
        "vldm r12!, {{s30-s31}}",
        "b.w 13b",
        "24:",
        "bx lr",
        ".balign 4",
        "40:",
        "vstm r2!, {{s0-s11}}",
        "b.w 14b",
        "80:",
        "vstm r2!, {{s0-s7}}",
        "b.w 54b",
        ".balign 4",
        "90:",
        ".word 10b + 1, 23b + 1, 22b + 1, 21b + 1",
        "91:",
        ".word 70b + 1, 63b + 1, 62b + 1, 61b + 1",
    )
}

/// The same for a single block of six rows.
///
/// # Safety
/// As for [`float_kernel`].
#[unsafe(naked)]
unsafe extern "C" fn float_six_kernel(shape: &FloatShape, stream: *const [u8; 4], inputs: *const u32, outputs: *mut u32) {
    naked_asm!(
        ".arch armv7e-m",
        ".fpu fpv4-sp-d16",
        ".balign 4",
        "push {{r4-r11, lr}}",
        "vpush {{s16-s31}}",
        // r0 becomes the stream, r1 the inputs, r2 the outputs, r3 the end of the twelves' outputs.
        "ldm.w r0, {{r7-r11}}",
        "mov.w r0, r1",
        "mov.w r1, r2",
        "mov.w r2, r3",
        "add.w r3, r3, r7",
        "add.w r9, r9, r1",
        "add.w r11, r11, r2",
        "adr.w r4, 90f",
        "ldr.w lr, [r4, r8, lsl #2]",
        "vldm r0!, {{s0-s5}}",
        "mov.w r12, r1",
        "bx lr",
        ".balign 4",
        "21:",
        "vldm r12!, {{s26-s31}}",
        "b.w 11f",
        "22:",
        "vldm r12!, {{s28-s31}}",
        "b.w 12f",
        "23:",
        "vldm r12!, {{s30-s31}}",
        "b.w 13f",
        "10:",
        "vldm r12!, {{s24-s31}}",
        float_six!("s24", "s25"),
        "11:",
        float_six!("s26", "s27"),
        "12:",
        float_six!("s28", "s29"),
        "13:",
        float_six!("s30", "s31"),
        "cmp.w r12, r9",
        "bne.w 10b",
        "cmp.w r10, #0",
        "bne.w 40f",
        float_relu!("s0", "s1", "s2", "s3"),
        "vmov r4, s4",
        "vmov r5, s5",
        "bic r4, r4, r4, asr #31",
        "bic r5, r5, r5, asr #31",
        "stm.w r2!, {{r4-r5}}",
        "b.w 59f",
        "40:",
        "vstm r2!, {{s0-s5}}",
        "59:",
        "vpop {{s16-s31}}",
        "pop {{r4-r11, pc}}",
        ".balign 4",
        "90:",
        ".word 10b + 1, 23b + 1, 22b + 1, 21b + 1",
    )
}

/// [`super::tanh`] of whole pairs of words; gives what is left.
pub(super) fn tanh(words: &mut [u32]) -> &mut [u32] {
    let (pairs, rest) = words.as_chunks_mut::<2>();
    let pairs = pairs.as_mut_ptr_range();
    if !pairs.is_empty() {
        // SAFETY: the kernel reads and writes exactly the pairs between these pointers, at least one, which come from a live slice. Of
        // the table it reads what `network::tanh::tanh` reads: the index is at most that of its last entry. It changes none but registers
        // which a called function may change, apart from those that it saves.
        unsafe { tanh_kernel(pairs.start.cast(), pairs.end.cast()) };
    }
    rest
}

/// Two arguments at a time, so that one's arithmetic fills the other's stalls: 62 cycles.
///
/// # Safety
/// From `words` to `end` there must be live memory of a positive, even number of words.
#[unsafe(naked)]
unsafe extern "C" fn tanh_kernel(words: *mut u32, end: *const u32) {
    naked_asm!(
        ".arch armv7e-m",
        ".fpu fpv4-sp-d16",
        ".balign 4",
        "push {{r4-r7}}",
        // 1.5 × 2²³, 16, 1/16, 9; the table less sixteen times the bits of the first.
        "movw r2, #0",
        "movt r2, #0x4b40",
        "vmov s12, r2",
        "vmov.f32 s13, #16.0",
        "mov.w r3, #0x3d800000",
        "vmov s14, r3",
        "movw r6, #0",
        "movt r6, #0x4110",
        "movw r7, #:lower16:{table}",
        "movt r7, #:upper16:{table}",
        "sub.w r7, r7, #0xb4000000",
        ".balign 4",
        "10:",
        "ldr.w r2, [r0]",
        "ldr.w r3, [r0, #4]",
        "bic r4, r2, #0x80000000",
        "bic r5, r3, #0x80000000",
        "cmp r4, r6",
        "it hi",
        "movhi r4, r6",
        "vmov s0, r4",
        "cmp r5, r6",
        "it hi",
        "movhi r5, r6",
        "vmov s1, r5",
        "vmul.f32 s2, s0, s13",
        "vmul.f32 s3, s1, s13",
        "vadd.f32 s2, s2, s12",
        "vadd.f32 s3, s3, s12",
        "vmov r4, s2",
        "vmov r5, s3",
        "vsub.f32 s2, s2, s12",
        "vsub.f32 s3, s3, s12",
        "add.w r4, r7, r4, lsl #4",
        "vmul.f32 s2, s2, s14",
        "vmul.f32 s3, s3, s14",
        "add.w r5, r7, r5, lsl #4",
        "vldm r4, {{s4-s7}}",
        "vsub.f32 s0, s0, s2",
        "vsub.f32 s1, s1, s3",
        "vldm r5, {{s8-s11}}",
        "vmul.f32 s7, s7, s0",
        "vmul.f32 s11, s11, s1",
        "vadd.f32 s6, s6, s7",
        "vadd.f32 s10, s10, s11",
        "vmul.f32 s6, s6, s0",
        "vmul.f32 s10, s10, s1",
        "vadd.f32 s5, s5, s6",
        "vadd.f32 s9, s9, s10",
        "vmul.f32 s5, s5, s0",
        "vmul.f32 s9, s9, s1",
        "vadd.f32 s4, s4, s5",
        "vadd.f32 s8, s8, s9",
        "and r2, r2, #0x80000000",
        "and r3, r3, #0x80000000",
        "vmov r4, s4",
        "vmov r5, s8",
        "orr.w r4, r4, r2",
        "orr.w r5, r5, r3",
        "str.w r4, [r0], #4",
        "str.w r5, [r0], #4",
        "cmp r0, r1",
        "bne 10b",
        "pop {{r4-r7}}",
        "bx lr",
        table = sym crate::network::tanh::CUBIC,
    )
}
