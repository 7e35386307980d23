//! tanh of f32.

use core::arch::naked_asm;

use super::floats;

/// tanh of whole pairs of words; gives what is left.
pub(in crate::network::kernel) fn tanh(words: &mut [u32]) -> &mut [u32] {
    let (pairs, rest) = words.as_chunks_mut::<2>();
    let pairs = pairs.as_mut_ptr_range();
    if !pairs.is_empty() {
        // SAFETY: the kernel reads and writes exactly the pairs between these pointers, at least one, which come from a live
        // slice. Of the table it reads what `network::tanh::tanh` reads: the index is at most that of its last entry. It changes
        // none but registers which a called function may change, apart from those that it saves.
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
        floats!(),
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
