//! Closed ranges of real numbers, computed in f64 with a margin for its rounding.

/// Relative margin for the rounding of the computations here: n · 2⁻⁵³ for sums of up to 1,500 terms is 2e-13.
pub(super) const MARGIN: f64 = 1e-12;

/// A closed range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Interval {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Interval {
    pub(super) fn magnitude(self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    pub(super) fn middle(self) -> f64 {
        0.5 * (self.low + self.high)
    }

    /// Largest distance from the middle, however that was rounded.
    pub(super) fn radius(self) -> f64 {
        (self.high - self.middle()).max(self.middle() - self.low)
    }

    pub(super) fn widened(self, by: f64) -> Self {
        Self { low: self.low - by, high: self.high + by }
    }

    pub(super) fn hull(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }
}

/// The next f32 that is not smaller.
pub(super) fn upward(value: f64) -> f32 {
    let nearest = value as f32;
    if f64::from(nearest) < value { nearest.next_up() } else { nearest }
}
