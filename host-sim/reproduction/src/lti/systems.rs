//! The paper's systems and its test trajectory.

use crate::siso::{StateSpace, fixtures};

/// One of the paper's systems.
pub(super) struct System {
    /// In names of numbers.
    pub(super) key: &'static str,
    /// In texts.
    pub(super) title: &'static str,
    pub(super) model: StateSpace,
}

pub(super) fn systems() -> [System; 2] {
    [
        System { key: "s1", title: "S1 (zero 0.2)", model: fixtures::minimum_phase() },
        System { key: "s2", title: "S2 (zero 1.002)", model: fixtures::non_minimum_phase() },
    ]
}

/// The test trajectory at a sample.
pub(super) fn desired(sample: i64) -> f64 {
    fixtures::test_trajectory(sample as f64 * fixtures::PERIOD)
}
