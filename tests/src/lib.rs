//! What the promises need to be tested: the emulated microcontroller. The promises themselves are in `tests/`.

pub mod emulator;
