//! A quadrotor in closed loop with its firmware: what it shall fly, the body and the air that it flies in, what it measures, and
//! what came of it. Usable by itself: no threads are needed (feature `threads`), no files (vehicles are in the program, CSV is
//! read from any source).
//!
//! ```text
//! Trajectory ──► setpoint ──► flight stack (the firmware's own) ──► motor commands ──► Plant ◄── Weather
//!                                   ▲                                                   │
//!                                   └──────────── delay ◄── Sensors ◄───────────────────┘ ──► FlightLog
//! ```
//!
//! SI units; world frame ENU (z up), body frame FLU, Hamilton quaternion body to world; f64 here, f32 in the firmware. Everything
//! random comes from a seed; the same seed gives the same bits on any number of threads.
//!
//! The lowest layer is physics and wishes, neither of which knows the other. Above it is what disturbs and what measures, then
//! the condition that names both, then flights through the firmware, and at the top a loop that flies many of them.
//!
//! | layer | modules | what they hold |
//! |---|---|---|
//! | 1 | `plant`, `trajectory` | the rigid body with its rotors and vehicle files; what is desired at each tick |
//! | 1 | `columns` | tables with named columns |
//! | 2 | `weather`, `sensors`, `flight_log` | wind and disturbance; noise and delay; what a flight leaves behind, as CSV |
//! | 2 | `controller` | loops that a vehicle may have in the place of the flight stack's own |
//! | 3 | `condition` | what a flight meets, by name |
//! | 4 | `rollout` | closed-loop flights, eight at once |
//! | 5 | `flights` | a vehicle with its gains under one condition, which flies many flights |
//! | 6 | `learned` | flights that learn, and what is left of their error |
//!
//! ```
//! use impromptu_sim::{condition::Condition, flights::Loop, plant::Vehicle, trajectory::strokes};
//!
//! let condition = Condition::named("lab").expect("a condition");
//! let quadrotor = Loop::new(Vehicle::named("crazyflie")?, "stock", condition)?;
//! let trajectories = strokes(1, 1, 1.0, quadrotor.rate_hz())?;
//! let errors = quadrotor.errors(&trajectories, None, 1.0, 7)?;
//! assert!(errors[0] > 0.01 && errors[0] < 0.5, "RMS of a stroke without add-on, m");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod columns;
pub mod condition;
pub mod controller;
pub mod flight_log;
pub mod flights;
pub mod learned;
pub mod plant;
pub mod rollout;
pub mod sensors;
pub mod trajectory;
pub mod weather;
