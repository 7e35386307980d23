//! Experiments: collect flights, learn, design the feedback lane, export, fly, compare.
//!
//! *in* a [`Recipe`] and a [`Loop`]; *out* models and [`crate::report::Results`]; *never* a choice made on the test flights;
//! *source* Zhou 2017, section V; Li 2017 (30 unseen strokes).

mod breakdown;
mod build;
pub mod demo;
mod evaluation;
mod files;
mod flights;
mod gates;
mod lane;
mod learn;
mod models;
mod monitor;
mod recipe;

pub use breakdown::{Breakdown, largest_sound_error};
pub use build::{BuildError, Built, Purpose, best_in_flight, build, derived, smoothing, training_logs, validation_strokes};
pub use evaluation::{EvaluationError, evaluate, model_card, per_flight, traces};
pub use files::write_model_files;
pub use flights::{FlightsError, Loop, reduction};
pub use gates::{AxisGates, check_gates};
pub use lane::{LaneChoice, LaneRefusal, choose_lane, dithered_logs, lanes, strongest_lane};
pub use learn::{Candidates, Judge, LearnError, Learned, Rows, learn};
pub use models::{FromFlights, ModelSet, describe, feedforward};
pub use monitor::{monitor, promise};
pub use recipe::{Excitation, LaneRecipe, Recipe, Signal};
