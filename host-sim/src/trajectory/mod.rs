//! Desired trajectories: what the vehicle is asked to fly, for training, validation and test.
//!
//! - in: a seed, a shape's parameters, a word, or a file;
//! - out: a [`Motion`] (a curve in continuous time, re-timed exactly by [`Motion::scaled`]) and, sampled at the rate of
//!   the position loop, a [`Trajectory`] with a hover before and after;
//! - never: a jump of position, velocity or acceleration in a generated motion, nor velocity and acceleration that are
//!   not the derivatives of position;
//! - source: Li et al., ICRA 2017 (hand-drawn strokes with curvature-limited speed, three growing tones), Zhou, Helwa,
//!   Schoellig, CDC 2017, section V (what is flown and how the error is measured).
//!
//! World frame ENU, z up; m, m/s, m/s², rad.

mod catalogue;
mod error;
mod excitation;
mod letters;
mod motion;
mod pen;
mod piecewise;
mod random_spline;
mod rows;
mod scribble;
mod segments;
mod shapes;
mod smoothing_spline;
mod strokes;
mod table;
mod tones;

pub use catalogue::{KNOWN_NAMES, by_name, load, read};
pub use error::TrajectoryError;
pub use excitation::{MultisineSettings, growing_tones, multisine, single_tone};
pub use letters::letters;
pub use motion::{Curve, LEAD_SECONDS, Motion, TAIL_SECONDS};
pub use pen::Pace;
pub use piecewise::{Piece, PiecewisePolynomial};
pub use random_spline::{SplineSettings, random_spline};
pub use segments::read_segments;
pub use shapes::{circle, figure_eight, helix, lissajous, star, trefoil};
pub use strokes::{STROKE_ACCELERATION, STROKE_SPEED, stroke, strokes};
pub use table::read_table;

use std::ops::Range;
use std::path::Path;

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
/// Tick 0 is the beginning of a hover at the first point, [`LEAD_SECONDS`] long; after the drawn part follows a hover at
/// the last point, [`TAIL_SECONDS`] long. Only the drawn part is scored, as in Li et al. 2017.
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
    /// The catalogue's trajectory of that name at normal speed; see [`by_name`].
    ///
    /// # Errors
    /// An unknown name, a malformed argument or a rate outside 1 to 1000 Hz.
    pub fn by_name(name: &str, rate_hz: f64) -> Result<Self, TrajectoryError> {
        by_name(name)?.sampled(rate_hz)
    }

    /// The trajectory of a CSV file at normal speed; see [`load`].
    ///
    /// # Errors
    /// An unreadable or malformed file (the error names line and field) or a rate outside 1 to 1000 Hz.
    pub fn load(path: &Path, rate_hz: f64) -> Result<Self, TrajectoryError> {
        load(path)?.sampled(rate_hz)
    }

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
pub(crate) fn norm([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}

/// Distance between two points.
pub(crate) fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    norm(std::array::from_fn(|k| a[k] - b[k]))
}

#[cfg(test)]
mod tests;
