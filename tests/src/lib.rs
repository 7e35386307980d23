//! What the promises need to be tested: the emulated microcontroller, its cycle model, proofs on its binaries, golden texts, bytes for
//! the decoder. The promises themselves are in `tests/`.

pub mod board;
pub mod decoder;
pub mod elf;
pub mod emulator;
pub mod golden;
pub mod mcu;
