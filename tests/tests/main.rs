//! Table of contents of the promises.
//!
//! - [`demo`]: what `cargo run --release` shows, threshold by threshold, and that the README tells the same;
//! - [`board`]: whole flights on the emulated microcontroller, bit by bit, with golden instruction counts;
//! - [`decoder`]: mutated model files are refused or flown, never a panic;
//! - [`emulator`]: the emulator is found, fails loudly, and counts repeatably;
//! - [`mcu`]: what kernels cost on the microcontroller, beside other engines, with a golden table;
//! - [`image`]: what is flashed is within its budget, leaves the models alone, and starts behind a boot loader;
//! - [`kernels`]: the network kernels in assembly give the bits of their portable twin;
//! - [`link`]: any bytes on the link are refused or messages, never a panic;
//! - [`unsafe_code`]: there is none but those kernels, each block with its reason;
//! - [`upload`]: a model goes over the link into the flash, and flies from the next start on.
//!
//! The parts have tests of their own: plant against an independent simulator and every generator and parser in `host-sim`, model
//! files bit by bit damaged in `model-export`, kernels and values in `firmware`.

mod board;
mod decoder;
mod demo;
mod emulator;
mod image;
mod kernels;
mod link;
mod mcu;
mod pil;
mod unsafe_code;
mod upload;
