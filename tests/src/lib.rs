//! What the promises need to be tested: the emulated microcontroller, its cycle model, proofs on its binaries,
//! C programs, other cores, golden texts, bytes for the decoder and the link, the structure of the sources. The promises
//! themselves are in `tests/`.
//!
//! | layer | modules | what they hold |
//! |--:|---|---|
//! | 1 | `golden` | texts that a run is compared with |
//! | 1 | `structure` | which file uses which |
//! | 1 | `decoder`, `link` | bytes for what reads bytes |
//! | 2 | `elf` | what can be proven of a binary without running it |
//! | 3 | `board`, `c` | flights on the emulated microcontroller, by Rust and by C |
//! | 3 | `twins` | the same cases on other cores |
//! | 4 | `mcu` | what the kernels cost there |

pub mod board;
pub mod c;
pub mod decoder;
pub mod elf;
pub mod golden;
pub mod link;
pub mod mcu;
pub mod structure;
pub mod twins;

pub use impromptu_pil::emulator;
