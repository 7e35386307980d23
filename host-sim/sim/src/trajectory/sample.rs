//! A desired trajectory, one sample for each tick of the position loop.

use std::ops::Range;

/// Rate of the position loop for which trajectories are sampled unless told otherwise, Hz.
pub const DEFAULT_RATE_HZ: f64 = 100.0;

/// What is desired at one tick of the position loop.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Position in the world frame, m.
    pub position: [f64; 3],
    /// Velocity in the world frame, m/s.
    pub velocity: [f64; 3],
    /// Acceleration in the world frame, m/s² (gravity not included).
    pub acceleration: [f64; 3],
    /// Heading about the world's z axis, rad, not wrapped.
    pub yaw: f64,
}

impl Sample {
    /// The same place and heading, at rest.
    #[must_use]
    pub fn at_rest(self) -> Self {
        Self { velocity: [0.0; 3], acceleration: [0.0; 3], ..self }
    }

    /// True when every number is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let vectors = [self.position, self.velocity, self.acceleration];
        self.yaw.is_finite() && vectors.as_flattened().iter().all(|x| x.is_finite())
    }
}

/// A desired trajectory, one sample for each tick of the position loop.
///
/// Tick 0 is the beginning of a hover at the first point, [`LEAD_SECONDS`](super::LEAD_SECONDS) long; after the drawn part
/// follows a hover at the last point, [`TAIL_SECONDS`](super::TAIL_SECONDS) long. Only the drawn part is scored, as in Li et al.
/// 2017.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// What it is, as the catalogue writes it (for example `strokes:7:3`), or the file's name.
    pub name: String,
    /// Samples a second: the rate of the position loop, Hz.
    pub rate_hz: f64,
    /// One sample a tick; never empty.
    pub samples: Vec<Sample>,
    /// The drawn part: the indices over which the error sqrt(mean |p_d - p|²) is measured.
    pub scored: Range<usize>,
}

impl Trajectory {
    /// What is desired at a tick. Ticks before the beginning hold the first position, ticks after the end hold the last
    /// one, both at rest: this is the end rule of the preview.
    #[must_use]
    pub fn sample_at(&self, tick: i64) -> Sample {
        let last = self.samples.len() - 1;
        match usize::try_from(tick) {
            Ok(index) if index <= last => self.samples[index],
            Ok(_) => self.samples[last].at_rest(),
            Err(_) if tick < 0 => self.samples[0].at_rest(),
            Err(_) => self.samples[last].at_rest(),
        }
    }

    /// Length of the drawn part, s.
    #[must_use]
    pub fn drawn_seconds(&self) -> f64 {
        self.scored.len().saturating_sub(1) as f64 / self.rate_hz
    }

    /// Largest speed of any sample, m/s.
    #[must_use]
    pub fn peak_speed(&self) -> f64 {
        self.samples.iter().fold(0.0, |peak, s| norm(s.velocity).max(peak))
    }

    /// Largest acceleration of any sample, m/s².
    #[must_use]
    pub fn peak_acceleration(&self) -> f64 {
        self.samples.iter().fold(0.0, |peak, s| norm(s.acceleration).max(peak))
    }
}

/// Euclidean length of a vector.
pub(super) fn norm([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}

/// Distance between two points.
pub(super) fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    norm(std::array::from_fn(|k| a[k] - b[k]))
}
