//! Curves in continuous time, exact re-timing, sampling.

use super::{Sample, Trajectory, TrajectoryError};
use std::fmt;
use std::sync::Arc;

/// Hover at the first point before the drawn part, s.
pub const LEAD_SECONDS: f64 = 1.0;
/// Hover at the last point after the drawn part, s: long enough for every preview and for the loop to settle.
pub const TAIL_SECONDS: f64 = 1.5;

/// A curve in continuous time with its analytical derivatives.
pub trait Curve: Send + Sync {
    /// Length in time, s.
    fn duration(&self) -> f64;

    /// Position, velocity, acceleration and heading at a time in 0..=duration.
    fn at(&self, seconds: f64) -> Sample;
}

/// A named curve and the speed at which it is flown. Re-timing happens here, before sampling, so that it is exact.
#[derive(Clone)]
pub struct Motion {
    name: String,
    curve: Arc<dyn Curve>,
    speed: f64,
}

impl fmt::Debug for Motion {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let duration = self.duration();
        write!(formatter, "Motion({}, {duration} s)", self.name)
    }
}

impl Motion {
    /// A curve with a name, flown as it is.
    pub fn new(name: impl Into<String>, curve: impl Curve + 'static) -> Self {
        Self { name: name.into(), curve: Arc::new(curve), speed: 1.0 }
    }

    /// The name that its trajectories get.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The same curve under another name.
    #[must_use]
    pub fn named(self, name: impl Into<String>) -> Self {
        Self { name: name.into(), ..self }
    }

    /// The same path flown `factor` times as fast: duration / factor, speed * factor, acceleration * factor².
    ///
    /// # Panics
    /// When the factor is not a positive finite number.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        assert!(factor.is_finite() && factor > 0.0, "a motion is scaled by a positive factor");
        let speed = self.speed * factor;
        Self { speed, ..self }
    }

    /// Length of the drawn part, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.curve.duration() / self.speed
    }

    /// What is desired `seconds` after the drawn part's beginning. Outside the drawn part the first or last point is
    /// held at rest.
    #[must_use]
    pub fn at(&self, seconds: f64) -> Sample {
        let length = self.curve.duration();
        let time = seconds * self.speed;
        if time < 0.0 {
            return self.curve.at(0.0).at_rest();
        }
        if time > length {
            return self.curve.at(length).at_rest();
        }
        let sample = self.curve.at(time);
        Sample {
            velocity: sample.velocity.map(|v| v * self.speed),
            acceleration: sample.acceleration.map(|a| a * self.speed * self.speed),
            ..sample
        }
    }

    /// Samples at a rate in Hz, with the hovers before and after.
    ///
    /// # Errors
    /// A rate outside 1 to 1000 Hz, or a motion longer than an hour.
    pub fn sampled(&self, rate_hz: f64) -> Result<Trajectory, TrajectoryError> {
        if !(1.0..=1000.0).contains(&rate_hz) {
            return Err(TrajectoryError::Rate { rate_hz });
        }
        let duration = self.duration();
        if duration.is_nan() || duration > LONGEST_SECONDS {
            return Err(TrajectoryError::TooLong { name: self.name.clone(), seconds: duration });
        }
        let lead = (LEAD_SECONDS * rate_hz).round() as usize;
        let tail = (TAIL_SECONDS * rate_hz).round() as usize;
        // A duration that is a whole number of ticks but for rounding keeps its last tick.
        let drawn = (duration * rate_hz + 1e-9).floor() as usize + 1;
        let time = |index: usize| ((index as f64 - lead as f64) / rate_hz).min(duration);
        let mut samples: Vec<Sample> = (0..lead + drawn).map(|i| self.at(time(i))).collect();
        samples.extend(std::iter::repeat_n(self.at(duration).at_rest(), tail));
        Ok(Trajectory { name: self.name.clone(), rate_hz, samples, scored: lead..lead + drawn })
    }

    /// Largest speed and acceleration, found on a grid of `step` seconds: m/s, m/s².
    #[must_use]
    pub fn peaks(&self, step: f64) -> (f64, f64) {
        let count = (self.duration() / step).ceil() as usize;
        (0..=count).fold((0.0_f64, 0.0_f64), |(speed, acceleration), index| {
            let sample = self.at((index as f64 * step).min(self.duration()));
            (super::sample::norm(sample.velocity).max(speed), super::sample::norm(sample.acceleration).max(acceleration))
        })
    }
}

/// Longest motion that is sampled, s: a guard against files with a wrong unit of time.
pub(super) const LONGEST_SECONDS: f64 = 3600.0;
