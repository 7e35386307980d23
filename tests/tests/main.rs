//! Table of contents of the promises.

mod board;
mod emulator;
