//! Processor in the loop: the plant here, the flight stack in the binary that is flashed.
//!
//! *in* flight plans; *out* the flights that the microcontroller flew, and what it measured of itself; *never* another bit than
//! the software's, if the link is perfect; *source* the link is `impromptu_flight::link`.
//!
//! At the bottom is what a link and an emulator are by themselves: lines of bytes, QEMU with the build of what it runs, the flash
//! of a binary. A [`Board`] speaks the firmware's protocol over a line and is a flight stack like the software's; above it a
//! model is uploaded, an emulated board started, and flights are flown with both and compared bit by bit.
//!
//! | layer | modules | what they hold |
//! |---|---|---|
//! | 1 | `line`, `emulator` | bytes to and from the firmware; builds and QEMU |
//! | 1 | `flash`, `error` | models in an ELF file; why nothing flies |
//! | 2 | `lockstep`, `serial`, `faults` | lines through FIFOs, a socket, or with faults |
//! | 2 | `board` | the microcontroller as a flight stack |
//! | 3 | `connection`, `upload` | kinds of link, and what each needs of the system; a model over the link |
//! | 3 | `learning` | what a vehicle that learns is told, and tells |
//! | 3 | `flights` | flights beside the software's |
//! | 4 | `emulated` | the emulated board with a model, and what was learned, in its flash |

mod board;
mod connection;
mod emulated;
pub mod emulator;
mod error;
mod faults;
mod flash;
mod flights;
mod learning;
mod line;
#[cfg(unix)]
mod lockstep;
#[cfg(unix)]
mod serial;
mod upload;

pub use board::{Board, Figures};
pub use connection::LinkKind;
pub use emulated::{Emulated, connect, firmware, restart, start, start_recalling};
pub use error::PilError;
pub use faults::{Faults, Faulty};
pub use flights::{CYCLES_PER_INSTRUCTION, PilReport, fly, fly_learning, learner};
pub use line::Line;
