//! Table of contents of the promises.

mod emulator;
