//! What the promises need to be tested: the emulated microcontroller, its cycle model, proofs on its binaries,
//! C programs, other cores, golden texts, bytes for the decoder and the link. The promises themselves are in `tests/`.

pub mod board;
pub mod c;
pub mod decoder;
pub mod elf;
pub mod golden;
pub mod link;
pub mod mcu;
pub mod twins;

pub use impromptu_host_sim::emulator;
