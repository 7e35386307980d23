//! What the promises need to be tested: the emulated microcontroller, golden texts. The promises themselves are in `tests/`.

pub mod board;
pub mod emulator;
pub mod golden;
