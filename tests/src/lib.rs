//! What the promises need to be tested: the emulated microcontroller, its cycle model, C programs, golden texts, bytes for the decoder. The
//! promises themselves are in `tests/`.

pub mod board;
pub mod c;
pub mod decoder;
pub mod emulator;
pub mod golden;
pub mod mcu;
