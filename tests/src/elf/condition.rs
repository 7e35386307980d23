//! Conditional instructions: IT blocks, and what writes the flags that they depend on.
//!
//! *in* halfwords; *out* the length and pattern of a block, and whether the flags may change; *never* an instruction that
//! compares passes for one that does not; *source* Armv7-M Architecture Reference Manual (DDI 0403E), A7.7.38 and A7.3.

/// The instructions of an IT block that are still to come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Condition {
    /// Number of the first one's condition; the lowest bit turns it into its opposite.
    pub code: u8,
    /// How many there are.
    pub count: u8,
    /// For each, from the lowest bit on, whether it is executed if the first one of the block is.
    pub alike: u8,
}

/// Whether an instruction of one halfword compares. Within an IT block the others leave the flags alone.
pub(super) fn compares(half: u16) -> bool {
    matches!(half >> 11, 0b00101) || matches!(half >> 8, 0x45) || matches!(half >> 6, 0x108 | 0x10a | 0x10b)
}

/// Whether an instruction of two halfwords has the bit that lets it write the flags, or moves those of the floating-point unit.
pub(super) fn sets_flags(first: u16, second: u16) -> bool {
    let data = first >> 9 == 0b111_0101 || (0b111_1000..=0b111_1011).contains(&(first >> 9)) || first >> 9 == 0b111_1101;
    data && first & 0x10 != 0 || first == 0xeef1 && second >> 12 == 15
}

/// An IT instruction.
pub(super) fn condition(half: u16) -> Condition {
    let count = 4 - (half & 0xf).trailing_zeros() as u8;
    // The mask's bits, from the highest on, are the lowest bit of the condition for each instruction after the first.
    let alike = |index: u8| index == 0 || half >> (4 - index) & 1 == half >> 4 & 1;
    Condition {
        code: (half >> 4 & 0xf) as u8,
        count,
        alike: (0..count).filter(|index| alike(*index)).map(|index| 1 << index).sum(),
    }
}
