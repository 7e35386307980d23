//! Everything that flies: a learned add-on for control loops, and the quadrotor loop that is its first user.
//!
//! ```text
//! desired trajectory ──► features ──► network lane (sub-rate, interpolated) ──┐
//!       (preview)           ▲                                                 ├─► correction ─► adapted reference ─► baseline loop ─► motors
//!                           │   ┌─► feedback lane (every reference tick) ─────┘    (bounded)      (every tick)            ▲
//!                           └───┴──────────────────── measured state ─────────────────────────────────────────────────────┘
//! ```
//!
//! `no_std`, no heap, no unsafe code but in the Cortex-M4 kernels, no clock: time is an argument. SI units; world frame ENU (z up), body frame FLU, Hamilton quaternion
//! body to world, f32. The same bits on the host and on a Cortex-M4F. Errors exist where bytes enter
//! ([`model::Model::from_bytes`], [`storage`]); in flight nothing returns a `Result`.
#![cfg_attr(not(test), no_std)]
// Tests may compare with the standard library.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod math;

pub mod lanes;

pub mod format;

pub mod preview;

pub mod features;

pub mod model;

pub mod network;

pub mod feedback;

pub mod guard;

pub mod adapter;

pub mod region;

pub mod exchange;

pub mod storage;
