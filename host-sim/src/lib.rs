//! Everything that runs on the PC: plant, weather, sensors, trajectories, closed-loop flights, training,
//! design of the feedback lane, experiments, reports and the command line.
//!
//! SI units; world frame ENU (z up), body frame FLU, Hamilton quaternion body to world; f64 here, f32 in the firmware.

pub mod channel;
pub mod cli;
pub mod condition;
pub mod emulator;
pub mod examples;
pub mod experiment;
pub mod feedback_design;
pub mod flight_log;
pub mod pil;
pub mod plant;
pub mod report;
pub mod rollout;
pub mod sensors;
pub mod study;
pub mod training;
pub mod trajectory;
pub mod weather;
