//! Figures over time.

use impromptu_report::{Axis, Curve, Figure};

use crate::siso::fixtures::PERIOD;

/// Samples between points: a figure is a few hundred points wide.
const STRIDE: usize = 10;

/// A curve of one number a sample.
pub(super) fn curve(label: &str, values: impl IntoIterator<Item = f64>) -> Curve {
    let points = values.into_iter().enumerate().step_by(STRIDE);
    Curve::line(label, points.map(|(sample, value)| (sample as f64 * PERIOD, value)))
}

/// A figure over time.
pub(super) fn over_time(section: &str, name: &str, title: &str, y: Axis, curves: Vec<Curve>) -> Figure {
    Figure { section: section.into(), name: name.into(), title: title.into(), x: Axis::linear("time [s]"), y, curves }
}

/// The axis of a magnitude of errors.
pub(super) fn error_axis() -> Axis {
    Axis::logarithmic("|y - y_d|")
}
