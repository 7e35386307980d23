//! Dense float layers.
//!
//! Twelve accumulators in s0-s11, an input's weights in s12-s23, eight inputs in s24-s31. Eight inputs × 12 rows: 96 VMUL, 96
//! VADD, 8 × 13 + 9 cycles of VLDM: 305. What rows are left go by eight: accumulators in s0-s7, two inputs' weights in s8-s23;
//! eight inputs: 64 + 64 + 4 × 17 + 9 = 205. Six rows alone: 48 + 48 + 4 × 13 + 9 = 157. No result is used by the next
//! instruction, which would stall.

use core::arch::naked_asm;

use super::{aligned, each, floats};
use crate::network::kernel::stream::float_blocks;

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
pub(in crate::network::kernel) struct Float<'a> {
    /// Exactly the blocks that `shape` says, on a word boundary.
    stream: &'a [[u8; 4]],
    shape: FloatShape,
    six: bool,
}

impl<'a> Float<'a> {
    /// A layer of so many words, if it suits the kernels.
    pub(in crate::network::kernel) fn new(stream: &'a [[u8; 4]], inputs: usize, relu: bool, outputs: usize) -> Option<Self> {
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

    /// What the twin's `float` computes, if there are enough inputs and outputs.
    #[inline(always)]
    pub(in crate::network::kernel) fn run(&self, inputs: &[u32], outputs: &mut [u32]) {
        let shape = &self.shape;
        if inputs.len() < shape.inputs as usize / 4 || outputs.len() < shape.outputs as usize / 4 {
            return;
        }
        let (stream, from, to) = (self.stream.as_ptr(), inputs.as_ptr(), outputs.as_mut_ptr());
        // SAFETY: the pointers come from live slices. `new`, which alone makes a shape, has checked that the stream is aligned to
        // words and that the three lengths fit together: `shape.outputs` are exactly one block of six, or the blocks of twelve
        // and the rest of eight rows, for each of which the kernel reads its part of the stream and all of `shape.inputs`
        // (`pairs` pairs, then whole groups of eight). It writes exactly `shape.outputs`. Both are inside of the slices (checked
        // above). It keeps the registers that the calling convention protects.
        unsafe {
            if self.six {
                float_six_kernel(shape, stream, from, to);
            } else {
                float_kernel(shape, stream, from, to);
            }
        }
    }
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
            each!("vmov" "r4" $a; "vmov" "r5" $b; "vmov" "r6" $c; "vmov" "r7" $d;),
            each!("bic" "r4" "r4" "r4, asr #31"; "bic" "r5" "r5" "r5, asr #31"; "bic" "r6" "r6" "r6, asr #31";
                "bic" "r7" "r7" "r7, asr #31"; "str" "r4" "[r2]" "#4"; "str" "r5" "[r2]" "#4"; "str" "r6" "[r2]" "#4";
                "str" "r7" "[r2]" "#4";),
        )
    };
}

/// # Safety
/// `stream`, `inputs` and `outputs` must point to live, aligned memory as long as `shape` says, which [`Float::new`] made.
#[unsafe(naked)]
unsafe extern "C" fn float_kernel(shape: &FloatShape, stream: *const [u8; 4], inputs: *const u32, outputs: *mut u32) {
    naked_asm!(
        floats!(),
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
        floats!(),
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
