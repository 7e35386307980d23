//! The quadrotor loop with the add-on before it, and all that flies with them.
//!
//! `no_std`, no heap, no unsafe code, no clock: time is an argument. SI units; world frame ENU (z up), body frame FLU, Hamilton quaternion
//! body to world, f32. The same bits on the host and on a Cortex-M4F.
#![cfg_attr(not(test), no_std)]
// Tests may compare with the standard library.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod types;

pub mod control;

pub mod settings;

pub mod quadrotor;

pub mod flight;

pub mod link;

pub mod autopilot;

pub mod application;

pub mod replay;
