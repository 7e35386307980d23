//! One axis of a flight as the identification reads it: the signals, and where their lags lie in a row of regressors.
//!
//! in: slices of one length; out: rows of regressors and targets; never: a row which changes when the whole flight is moved in
//! space.

/// One axis of one flight, sampled at the reference's own rate; all slices have the same length.
///
/// `reference_*[k]` is what the loop was given at tick `k`, after `measured_*[k]` had arrived (with whatever delay the
/// sensors have). World frame ENU.
#[derive(Clone, Copy, Debug)]
pub struct AxisLog<'a> {
    /// Position as the loop measured it, m.
    pub measured_position: &'a [f64],
    /// Velocity as the loop measured it, m/s.
    pub measured_velocity: &'a [f64],
    /// Position reference as the loop received it, every correction and the dither included, m.
    pub reference_position: &'a [f64],
    /// Velocity reference as the loop received it, m/s.
    pub reference_velocity: &'a [f64],
    /// The dither alone, m, when it was logged: then it is also checked that it reached the reference.
    pub dither: Option<&'a [f64]>,
}

/// Where each signal's lags lie in a row of regressors. The newest position is the origin of the row, so it has no column.
#[derive(Clone, Copy, Debug)]
pub(super) struct Columns {
    pub(super) lags: usize,
}

impl Columns {
    pub(super) fn regressors(self) -> usize {
        4 * self.lags - 1
    }

    /// Column of the measured position `lag` ticks old; `lag` starts at 1.
    pub(super) fn position(self, lag: usize) -> usize {
        lag - 1
    }

    pub(super) fn velocity(self, lag: usize) -> usize {
        self.lags - 1 + lag
    }

    pub(super) fn reference_position(self, lag: usize) -> usize {
        2 * self.lags - 1 + lag
    }

    pub(super) fn reference_velocity(self, lag: usize) -> usize {
        3 * self.lags - 1 + lag
    }

    /// Writes the regressors at tick `k` and, behind them, the two targets; `row` has `regressors() + 2` elements.
    pub(super) fn fill(self, log: &AxisLog, k: usize, row: &mut [f64]) {
        let origin = log.measured_position[k];
        for lag in 0..self.lags {
            let past = k - lag;
            if lag > 0 {
                row[self.position(lag)] = log.measured_position[past] - origin;
            }
            row[self.velocity(lag)] = log.measured_velocity[past];
            row[self.reference_position(lag)] = log.reference_position[past] - origin;
            row[self.reference_velocity(lag)] = log.reference_velocity[past];
        }
        row[self.regressors()] = log.measured_position[k + 1] - origin;
        row[self.regressors() + 1] = log.measured_velocity[k + 1];
    }

    /// The columns of a row of this layout which a shorter row, of `lags` lags, consists of, targets included.
    pub(super) fn selection(self, lags: usize) -> Vec<usize> {
        let mut selection = Vec::with_capacity(4 * lags + 1);
        selection.extend((1..lags).map(|lag| self.position(lag)));
        selection.extend((0..lags).map(|lag| self.velocity(lag)));
        selection.extend((0..lags).map(|lag| self.reference_position(lag)));
        selection.extend((0..lags).map(|lag| self.reference_velocity(lag)));
        selection.extend([self.regressors(), self.regressors() + 1]);
        selection
    }

    /// Ticks of a log of `length` samples which have a full past and a next sample.
    pub(super) fn ticks(self, length: usize) -> std::ops::Range<usize> {
        self.lags - 1..length.saturating_sub(1).max(self.lags - 1)
    }
}
