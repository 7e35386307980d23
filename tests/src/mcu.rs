//! The benchmark of kernels: what an evaluation costs on the microcontroller, beside other engines, and how exact it is.
//!
//! [`nets`] are evaluated by [`kernels`] in `tests/peers/mcu-benchmark` on the emulated board, each from an image ([`images`]) in
//! flash and in RAM; the plugin in `tests/cycles` counts ([`counter`]), [`measurement`] puts the figures together, [`table`]
//! prints them. Other [`cores`] run our kernels in `firmware/board/twins`.

pub mod cores;
pub mod counter;
pub mod images;
pub mod kernels;
pub mod measurement;
pub mod memory;
pub mod nets;
pub mod quantised;
pub mod table;
