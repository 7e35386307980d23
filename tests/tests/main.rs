//! Table of contents of the promises.
//!
//! - [`demo`]: what `cargo run --release` shows, threshold by threshold, and that the README tells the same;
//! - [`board`]: whole flights on the emulated microcontroller, bit by bit, with golden instruction counts;
//! - [`c_face`]: C programs get the bits of Rust, the header is what the source says, random calls do no harm;
//! - [`calls`]: calls to an add-on in any order, and any settings and commands: within all bounds, or refused, never a panic;
//! - [`decoder`]: mutated model files are refused or flown, never a panic;
//! - [`elf`]: what a control tick can reach in the flashed binary: no panic, no heap; its stack, with golden memory;
//! - [`guard`]: lanes that do harm are handed over before the error is 1.5 times the baseline's, with numbers;
//! - [`healthy`]: hours of flights in which nothing is wrong: the guard trips in none;
//! - [`hostile`]: whatever is desired, flown and measured: where both lanes are worse than the baseline, with a golden table;
//! - [`emulator`]: the emulator is found, fails loudly, and counts repeatably;
//! - [`mcu`]: what kernels cost on the microcontroller, beside other engines, with a golden table;
//! - [`image`]: what is flashed is within its budget, leaves the models alone, and starts behind a boot loader;
//! - [`kernels`]: layers, networks and flights give the same bits on every core and in WebAssembly;
//! - [`learning`]: loops that learn in flight from nothing keep their bounds, and no flight is harmed, from the first one on;
//! - [`link`]: any bytes on the link are refused or messages, never a panic;
//! - [`processor`]: control is never late, whatever the network takes; the processor's share; late inferences;
//! - [`pil`]: the flashed binary flies the plant, bit for bit, through good lines and bad ones;
//! - [`structure`]: no circle between files, no use against the layers that each crate states;
//! - [`servo`]: the servo of the library's examples, its model made again from its logs, its tasks on the emulated board;
//! - [`upload`]: a model goes over the link into the flash, and flies from the next start on.
//!
//! The parts have tests of their own: plant against an independent simulator and every generator and parser in `host-sim`, model
//! files bit by bit damaged in `model-export`, kernels and values in `firmware`.

mod board;
mod c_face;
mod calls;
mod decoder;
mod demo;
mod elf;
mod emulator;
mod guard;
mod healthy;
mod hostile;
mod image;
mod kernels;
mod learning;
mod link;
mod mcu;
mod pil;
mod processor;
mod servo;
mod structure;
mod upload;
