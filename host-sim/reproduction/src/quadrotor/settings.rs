//! What the quadrotor study covers.

use serde::{Deserialize, Serialize};

/// What the study covers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct QuadrotorSettings {
    /// Seed of everything random.
    pub seed: u64,
    /// Training flights on the predecessor's loop, of 100 s each.
    pub flights: u32,
    /// Passes over the training data.
    pub epochs: usize,
    /// Validation strokes.
    pub validation: usize,
    /// Test strokes.
    pub strokes: usize,
    /// Trials of iterative learning.
    pub trials: usize,
    /// Training strokes on the Crazyflie.
    pub crazyflie_flights: u32,
}

impl Default for QuadrotorSettings {
    fn default() -> Self {
        Self { seed: 1, flights: 8, epochs: 60, validation: 8, strokes: 30, trials: 10, crazyflie_flights: 300 }
    }
}

impl QuadrotorSettings {
    /// A few flights and epochs: the same conclusions, other numbers.
    pub fn quick() -> Self {
        Self { flights: 4, epochs: 16, validation: 4, strokes: 6, trials: 3, crazyflie_flights: 60, ..Self::default() }
    }
}
