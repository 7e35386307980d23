//! Encodings as the LLVM assembler makes them.

use impromptu_tests::elf::instruction::{Condition, Flow, Stack, decode};

/// Where the instructions are.
const ADDRESS: u32 = 0x0800_1000;

#[test]
fn the_stack_pointer_is_followed() {
    use Stack::{Down, Dynamic, Same};
    let instructions = [
        ("push {r4, lr}", 0xb510, 0, Down(8)),
        ("pop {r4, pc}", 0xbd10, 0, Down(-8)),
        ("push.w {r4-r11, lr}", 0xe92d, 0x4ff0, Down(36)),
        ("pop.w {r4-r8}", 0xe8bd, 0x01f0, Down(-20)),
        ("vpush {s16-s31}", 0xed2d, 0x8a10, Down(64)),
        ("vpop {d8, d9}", 0xecbd, 0x8b04, Down(-16)),
        ("vldmia r0!, {s0-s7}", 0xecb0, 0x0a08, Same),
        ("sub sp, #504", 0xb0fe, 0, Down(504)),
        ("add sp, #8", 0xb002, 0, Down(-8)),
        ("sub.w sp, sp, #4096", 0xf5ad, 0x5d80, Down(4096)),
        ("sub.w sp, sp, #1179648", 0xf5ad, 0x1d90, Down(1_179_648)),
        ("addw sp, sp, #4095", 0xf60d, 0x7dff, Down(-4095)),
        ("str r8, [sp, #-4]!", 0xf84d, 0x8d04, Down(4)),
        ("ldr r8, [sp], #4", 0xf85d, 0x8b04, Down(-4)),
        ("strd r4, r5, [sp, #-16]!", 0xe96d, 0x4504, Down(16)),
        ("ldrd r4, r5, [sp], #16", 0xe8fd, 0x4504, Down(-16)),
        ("strd r4, r5, [sp, #16]", 0xe9cd, 0x4504, Same),
        ("ldrex r0, [r1]", 0xe851, 0x0f00, Same),
        ("mov r7, sp", 0x466f, 0, Same),
        ("mov sp, r7", 0x46bd, 0, Dynamic),
        ("add sp, r4", 0x44a5, 0, Dynamic),
        ("sub.w sp, sp, r3", 0xebad, 0x0d03, Dynamic),
        ("ldr.w sp, [r0]", 0xf8d0, 0xd000, Dynamic),
        ("msr msp, r0", 0xf380, 0x8808, Dynamic),
        ("msr control, r0", 0xf380, 0x8814, Dynamic),
        ("msr basepri, r0", 0xf380, 0x8811, Same),
        ("vmrs APSR_nzcv, fpscr", 0xeef1, 0xfa10, Same),
    ];
    for (text, first, second, stack) in instructions {
        assert_eq!(decode(ADDRESS, first, second).stack, stack, "{text}");
    }
}

#[test]
fn the_flow_is_followed() {
    let instructions = [
        ("pop {r4, pc}", 0xbd10, 0, Flow::Return),
        ("pop.w {r4-r11, pc}", 0xe8bd, 0x8ff0, Flow::Return),
        ("ldr pc, [sp], #8", 0xf85d, 0xfb08, Flow::Return),
        ("bx lr", 0x4770, 0, Flow::Return),
        ("mov pc, lr", 0x46f7, 0, Flow::Return),
        ("bx r3", 0x4718, 0, Flow::JumpRegister),
        ("mov pc, r0", 0x4687, 0, Flow::JumpRegister),
        ("ldr.w pc, [r0, r1, lsl #2]", 0xf850, 0xf021, Flow::JumpRegister),
        ("ldmdb r0, {r1, pc}", 0xe910, 0x8002, Flow::JumpRegister),
        ("ldr.w pc, [pc, #8]", 0xf8df, 0xf008, Flow::JumpLiteral(ADDRESS + 12)),
        ("blx r2", 0x4790, 0, Flow::CallRegister),
        ("tbb [pc, r0]", 0xe8df, 0xf000, Flow::Table { at: ADDRESS + 4, wide: false }),
        ("tbh [pc, r0, lsl #1]", 0xe8df, 0xf010, Flow::Table { at: ADDRESS + 4, wide: true }),
        ("udf #0", 0xde00, 0, Flow::Trap),
        ("udf.w #0", 0xf7f0, 0xa000, Flow::Trap),
        ("bkpt #171", 0xbeab, 0, Flow::Next),
        ("svc #1", 0xdf01, 0, Flow::Next),
        ("wfi", 0xbf30, 0, Flow::Next),
        ("itttt ls", 0xbf9f, 0, Flow::Conditional(Condition { code: 9, count: 4, alike: 0b1111 })),
        ("ite hs", 0xbf2c, 0, Flow::Conditional(Condition { code: 2, count: 2, alike: 0b01 })),
        ("b .-10", 0xe7f9, 0, Flow::Jump(ADDRESS - 10)),
        ("bne .-10", 0xd1f9, 0, Flow::Branch(ADDRESS - 10)),
        ("cbz r0, .+10", 0xb118, 0, Flow::Branch(ADDRESS + 10)),
        ("b.w .-1488", 0xf7ff, 0xbd16, Flow::Jump(ADDRESS - 1488)),
        ("bl .+3382", 0xf000, 0xfe99, Flow::Call(ADDRESS + 3382)),
        ("bne.w .-984", 0xf47f, 0xae12, Flow::Branch(ADDRESS - 984)),
    ];
    for (text, first, second, flow) in instructions {
        assert_eq!(decode(ADDRESS, first, second).flow, flow, "{text}");
    }
}
