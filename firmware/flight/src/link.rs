//! The serial link: messages to and from the vehicle as bytes which may be lost, damaged or delayed.
//!
//! *in* bytes, as they come, or messages; *out* messages whose every number is finite, or frames; *never* a panic, a message that
//! was not sent (but for a chance of 2^-32 in each damaged frame), or a number that was rounded or normalised; *source* this file
//! and the order of the fields in [`message`] and [`outcome`] are the protocol's specification.
//!
//! ```text
//! frame    COBS( payload, CRC ) 0x00           at most 256 bytes
//! CRC      CRC-32/ISO-HDLC of the payload, little-endian
//! payload  version (1), sequence, message      at most 250 bytes
//! message  postcard: varints, f32 as four little-endian bytes
//! ```
//!
//! The sequence counts the sender's frames modulo 256. What lies between two zeros is a frame or nothing, so whatever happens the
//! receiver is in step again at the next zero. Version 1 is frozen: `link/frozen.rs` holds the exact bytes of every message.
//! Messages and reasons may be added behind the last one; everything else makes another version.
//!
//! # Trust
//! The check sum finds damage, not malice: whoever can write to the line flies the vehicle, and a recording that is said again
//! to a disarmed vehicle is a host like any other. So the line is a wire, and what bridges it to a radio has to know who
//! speaks. What holds for any speaker: no message turns a time-out off, changes the control rate, or makes a number of the loop
//! one that no vehicle has; while armed no setting, no second arming and no setpoint of the past is taken.

pub mod message;
pub mod outcome;

mod check;
mod counts;
mod port;
mod receiver;
mod sender;

#[cfg(test)]
mod channel;
#[cfg(test)]
mod frozen;

use crc::{CRC_32_ISO_HDLC, Crc, Table};

pub use counts::{Counts, Fault};
pub use message::{Command, Commands, Direction, Message, Report, Reports};
pub use outcome::{ModelFault, Outcome, Quantity, Reason};
pub use port::{SendError, receive, send};
pub use receiver::{Order, RECENT, Received, Receiver};
pub use sender::{Sender, encode};

/// Version of the protocol that this build speaks.
pub const VERSION: u8 = 1;
/// Most bytes of a payload: version, sequence, message.
pub const PAYLOAD: usize = 250;
/// Most bytes of a payload and its check sum: the longest run that COBS lengthens by one byte alone.
pub const BODY: usize = PAYLOAD + 4;
/// Most bytes of a frame, its zero included.
pub const FRAME: usize = BODY + 2;
/// Most bytes of a model in one [`message::ModelChunk`].
pub const CHUNK: usize = 192;

/// The same table as the model file's, so that it is in flash once: 1 KB, and a fifth of the time that no table takes.
const CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);
