//! The program `host-sim` as its users run it.

mod program;
mod refusals;
mod steps;
mod tables;
