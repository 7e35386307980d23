//! The program `host-sim` as its users run it.

mod demo;
mod diagnose;
#[cfg(unix)]
mod files;
mod help;
mod learn;
mod program;
mod refusals;
mod steps;
mod tables;
