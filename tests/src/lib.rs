//! What the promises need to be tested: the emulated microcontroller, its cycle model, proofs on its binaries,
//! C programs, other cores, golden texts, what any bytes do to what is told them, the structure of the sources. The promises
//! themselves are in `tests/`.
//!
//! | layer | modules | what they hold |
//! |--:|---|---|
//! | 1 | `golden` | texts that a run is compared with |
//! | 1 | `structure` | which file uses which |
//! | 1 | `bytes` | what the bytes of a fuzz target say |
//! | 2 | `decoder`, `link` | bytes for what reads bytes |
//! | 2 | `calls` | any order of calls to an add-on |
//! | 2 | `elf` | what can be proven of a binary without running it |
//! | 3 | `board`, `c` | flights on the emulated microcontroller, by Rust and by C |
//! | 3 | `twins` | the same cases on other cores |
//! | 4 | `mcu` | what the kernels cost there |
//! | 5 | `settings` | any settings, states and commands for the flight stack |

pub mod board;
pub mod bytes;
pub mod c;
pub mod calls;
pub mod decoder;
pub mod elf;
pub mod golden;
pub mod link;
pub mod mcu;
pub mod settings;
pub mod structure;
pub mod twins;

pub use impromptu_pil::emulator;
