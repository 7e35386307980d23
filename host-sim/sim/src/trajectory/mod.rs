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
mod names;
mod pen;
mod piecewise;
mod random_spline;
mod rows;
mod sample;
mod scribble;
mod segments;
mod shapes;
mod smoothing_spline;
mod strokes;
mod table;
pub mod tones;

pub use catalogue::{by_name, load, read};
pub use error::TrajectoryError;
pub use excitation::{MultisineSettings, growing_tones, hover, multisine, single_tone};
pub use letters::letters;
pub use motion::{Curve, LEAD_SECONDS, Motion, TAIL_SECONDS};
pub use names::KNOWN_NAMES;
pub use pen::Pace;
pub use piecewise::{Piece, PiecewisePolynomial};
pub use random_spline::{SplineSettings, random_spline};
pub use sample::{DEFAULT_RATE_HZ, Sample, Trajectory};
pub use segments::read_segments;
pub use shapes::{circle, figure_eight, helix, lissajous, star, trefoil};
pub use strokes::{STROKE_ACCELERATION, STROKE_SPEED, stroke, strokes};
pub use table::read_table;

#[cfg(test)]
mod tests;
