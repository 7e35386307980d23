//! What machines are made of.
//!
//! *in* nothing, or a seed; *out* figures of a machine; *never* a figure that depends on more than these; *source* as in
//! `machines`.

use std::f64::consts::TAU;

use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;

/// What the axes of a machine are.
pub(super) struct Plant {
    pub(super) axes: &'static [&'static str],
    pub(super) unit: &'static str,
    /// References a second.
    pub(super) rate_hz: f64,
    /// Natural frequency, rad/s, and damping of the position loop.
    pub(super) frequency: f64,
    pub(super) damping: f64,
    /// Frequency, Hz, of the spring between drive and load; none if 0.
    pub(super) spring_hz: f64,
    /// Coulomb friction, unit/s².
    pub(super) friction: f64,
    /// Gravity, unit/s², and pull of a neighbour's acceleration.
    pub(super) gravity: f64,
    pub(super) pull: f64,
    /// How far it goes, and the fastest tone, Hz.
    pub(super) far: f64,
    pub(super) fastest_hz: f64,
    /// Dead time of the drive and age of what is measured, s.
    pub(super) dead_s: f64,
    pub(super) age_s: f64,
    /// Disturbance, as a share of what it takes to hold the farthest position.
    pub(super) disturbance: f64,
    /// Noise of position and velocity.
    pub(super) noise: [f64; 2],
    pub(super) dither: f64,
}

impl Plant {
    /// One axis with friction.
    pub(super) fn servo() -> Self {
        Self {
            axes: &["angle"],
            unit: "rad",
            rate_hz: 100.0,
            frequency: 7.7,
            damping: 0.7,
            spring_hz: 0.0,
            friction: 1.0,
            gravity: 0.0,
            pull: 0.0,
            far: 1.5,
            fastest_hz: 1.2,
            dead_s: 0.02,
            age_s: 0.005,
            disturbance: 2e-3,
            noise: [1e-3, 1e-2],
            dither: 0.02,
        }
    }

    /// Two axes that carry their loads by springs.
    pub(super) fn gantry() -> Self {
        Self {
            axes: &["x", "y"],
            unit: "m",
            frequency: 9.0,
            damping: 0.8,
            spring_hz: 4.0,
            friction: 0.1,
            far: 0.4,
            fastest_hz: 0.9,
            noise: [1e-4, 1e-3],
            dither: 0.004,
            ..Self::servo()
        }
    }

    /// Three quick axes.
    pub(super) fn gimbal() -> Self {
        Self {
            axes: &["yaw", "pitch", "roll"],
            rate_hz: 200.0,
            frequency: 18.0,
            friction: 0.5,
            gravity: 1.0,
            far: 0.8,
            fastest_hz: 2.0,
            dead_s: 0.005,
            noise: [5e-4, 1e-2],
            dither: 0.01,
            ..Self::servo()
        }
    }

    /// Six axes that pull at each other.
    pub(super) fn arm() -> Self {
        Self {
            axes: &["j1", "j2", "j3", "j4", "j5", "j6"],
            rate_hz: 125.0,
            frequency: 10.0,
            damping: 0.9,
            friction: 1.0,
            gravity: 4.0,
            pull: 0.05,
            far: 1.0,
            fastest_hz: 0.8,
            noise: [2e-4, 5e-3],
            dither: 0.01,
            ..Self::servo()
        }
    }

    /// One axis from a seed.
    pub(super) fn drawn(seed: u64) -> Self {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut between = |low: f64, high: f64| low * (high / low).powf(random.random_range(0.0..1.0));
        let rate_hz = between(50.0, 200.0);
        let frequency = between(2.0, 20.0f64.min(rate_hz / 7.0));
        let (far, noise) = (between(0.3, 3.0), between(1e-4, 1e-3));
        let stiffness = far * frequency * frequency;
        let spring = seed.is_multiple_of(3);
        Self {
            rate_hz,
            frequency,
            damping: between(if spring { 0.7 } else { 0.5 }, 1.2),
            spring_hz: if spring { between(2.0, 4.0) * frequency / TAU } else { 0.0 },
            friction: between(2e-3, 4e-2) * stiffness,
            gravity: between(1e-3, 0.1) * stiffness,
            far,
            fastest_hz: between(0.4, 1.2) * frequency / TAU,
            dead_s: between(0.01, 0.2) / frequency,
            age_s: between(0.01, 0.2) / frequency,
            disturbance: between(1e-3, 2e-2),
            noise: [noise * far, noise * far * frequency],
            dither: 0.012 * far,
            ..Self::servo()
        }
    }
}
