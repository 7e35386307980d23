//! What the robustness study covers.

use std::path::PathBuf;

use impromptu_sim::flights::Loop;
use impromptu_training::Recipe;

use super::draw::Ranges;

/// What the study covers.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Seed of everything random.
    pub seed: u64,
    /// The loops; a model is built for each.
    pub loops: Vec<Loop>,
    /// Test strokes.
    pub strokes: usize,
    /// Vehicles drawn for each loop.
    pub draws: u32,
    /// Strokes that each of them flies.
    pub draw_strokes: usize,
    /// Flights of each kind in the table of the guard's trips.
    pub guard_flights: u32,
    /// Ranges of the draws.
    pub ranges: Ranges,
    /// Recipe of the models.
    pub recipe: Recipe,
    /// Folder for the draws.
    pub out: PathBuf,
}
