//! The same computations on other machines: [`cases`] for the program in `firmware/board/twins`, and the [`cores`] that run it.

pub mod cases;
pub mod cores;
