//! Where models and what was learned lie in flash: the last three sectors, which memory.x keeps free of the program.
//!
//! *in* nothing; *out* the bytes of the slots; *never* what the compiler thinks that they are; *source* RM0090, table 5: sector 9
//! for what was learned, 10 and 11 for models.

use core::hint::black_box;

/// Bytes of a slot: a sector of the flash, which is erased as a whole.
pub const SLOT: usize = 128 * 1024;

/// All slots. A model behind its header lies on a boundary of 16 bytes.
#[repr(C, align(16))]
struct Slots([[u8; SLOT]; 3]);

/// Named so that memory.x places it over the sectors. It is not loaded: the zeros are the compiler's alone, who does not know of
/// uploads.
static IMPROMPTU_SLOTS: Slots = Slots([[0; SLOT]; 3]);

/// The slots of models: what the flash holds.
pub fn slots() -> [&'static [u8]; 2] {
    let Slots([_, first, second]) = black_box(&IMPROMPTU_SLOTS);
    [first, second]
}

/// The slot of what was learned: what the flash holds.
pub fn learned() -> &'static [u8] {
    let Slots([learned, ..]) = black_box(&IMPROMPTU_SLOTS);
    learned
}
