//! The quadrotor loop with the add-on before it, and all that flies with them.
//!
//! ```text
//! line ─► link ─► application ─► autopilot ─► setpoints, states ─► flight
//!  ▲                                                                  │
//!  │        adapter (lanes, guard, bounds) ─► reference ─► position loop ─► thrust vector ─► attitude loop ─► mixer
//!  │                                                                                                            │
//!  └────── reports ◄─ link ◄─ application ◄─ autopilot ◄─ motor commands ◄──────────────────────────────────────┘
//! ```
//!
//! `no_std`, no heap, no unsafe code, no clock: time is an argument. SI units; world frame ENU (z up), body frame FLU, Hamilton
//! quaternion body to world, f32. The same bits on the host and on a Cortex-M4F.
//!
//! # Layers
//!
//! Values that cross the boundary are at the bottom. The baseline loop, its settings and its signals know nothing of a link; the
//! flight stack puts the add-on before them, and the link carries its values. The course
//! says what trajectory is flown. The autopilot arms and disarms the flight stack as
//! the link says, the application gives both a serial line. A recording holds every call of the flight stack. What is above may
//! use what is below, never the other way round:
//!
//! | layer | modules | what they hold |
//! |--:|---|---|
//! | 1 | `types` | states, setpoints, references, motor commands |
//! | 2 | `control` | the baseline loop: position loop, attitude loop, mixer |
//! | 2 | `motion` | from one motion into another: braking, blending |
//! | 2 | `quadrotor` | which channels a quadrotor's models map between |
//! | 3 | `caps` | what corrections of a quadrotor's references may be |
//! | 3 | `settings` | vehicle constants, gains and rates |
//! | 4 | `flight` | the baseline loop with the add-on before it |
//! | 4 | `link` | messages as bytes which may be lost, damaged or delayed |
//! | 5 | `course` | the trajectory: gaps, re-plans, braking |
//! | 5 | `learning` | corrections that are learned while it flies |
//! | 5 | `replay` | recorded flights, and how they are flown again |
//! | 6 | `autopilot` | arming, and what happens when nothing arrives any more |
//! | 7 | `application` | the autopilot behind its serial line |
//!
//! `reset`, `restart` and `clear` mean what they mean in [`impromptu_firmware`].
#![cfg_attr(not(test), no_std)]
// Tests may compare with the standard library.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod application;
pub mod autopilot;
pub mod caps;
pub mod control;
pub mod course;
pub mod flight;
pub mod learning;
pub mod link;
pub mod motion;
pub mod quadrotor;
pub mod replay;
pub mod settings;
pub mod types;

pub use application::Application;
pub use flight::{Flight, QuadrotorAdapter};
pub use settings::{Rates, Setting, Settings, SettingsRefusal};
pub use types::{MotorCommand, Reference, Setpoint, State, Tick};
