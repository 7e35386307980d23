//! Polylines: gaps where a number is not finite or is none that a plot can show, and no more points than the eye can see.

use std::ops::Range;

pub(super) type Point = (f64, f64);

/// Largest magnitude that has a place in a plot: beyond it differences and squares of differences leave the numbers, and no
/// quantity here has such values in any unit. What is larger is a gap, as what is not finite.
const LARGEST: f64 = 1e12;
/// Least extent of an axis over its largest magnitude: neighbouring ticks must be different numbers.
const LEAST_SHARE: f64 = 1e-6;

/// Whether a value has a place in a plot.
pub(super) fn shown(value: f64) -> bool {
    value.abs() <= LARGEST
}

/// The smallest interval that holds all values that have a place, or `None` without one.
pub(super) fn span(values: impl IntoIterator<Item = f64>) -> Option<Range<f64>> {
    values.into_iter().filter(|value| shown(*value)).fold(None, |span, value| match span {
        None => Some(value..value),
        Some(Range { start, end }) => Some(start.min(value)..end.max(value)),
    })
}

/// Widens an interval by a share of its length at either end, and to at least `least`, which is raised to what can be told apart
/// at this distance from 0.
pub(super) fn widened(span: &Range<f64>, share: f64, least: f64) -> Range<f64> {
    let centre = 0.5 * (span.start + span.end);
    let least = least.max(LEAST_SHARE * span.start.abs().max(span.end.abs()));
    let half = (0.5 + share) * (span.end - span.start).max(least);
    centre - half..centre + half
}

/// Splits at points that have no place, and thins each piece: no dropped point is further than `tolerance`
/// (in each axis' own unit) from the line that is left. Ramer, Douglas and Peucker's method.
pub(super) fn polylines(points: &[Point], tolerance: (f64, f64)) -> Vec<Vec<Point>> {
    points
        .split(|point| !(shown(point.0) && shown(point.1)))
        .filter(|piece| piece.len() > 1)
        .map(|piece| thinned(piece, tolerance))
        .collect()
}

fn thinned(points: &[Point], tolerance: (f64, f64)) -> Vec<Point> {
    let mut kept = vec![false; points.len()];
    kept[0] = true;
    kept[points.len() - 1] = true;
    let mut open = vec![(0, points.len() - 1)];
    while let Some((first, last)) = open.pop() {
        let farthest = (first + 1..last)
            .map(|i| (distance(points[i], points[first], points[last], tolerance), i))
            .max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((distance, middle)) = farthest
            && distance > 1.0
        {
            kept[middle] = true;
            open.push((first, middle));
            open.push((middle, last));
        }
    }
    points.iter().zip(kept).filter_map(|(point, keep)| keep.then_some(*point)).collect()
}

/// Distance of `point` from the stretch `start`-`end`, in tolerances.
fn distance(point: Point, start: Point, end: Point, tolerance: (f64, f64)) -> f64 {
    let scaled = |p: Point| ((p.0 - start.0) / tolerance.0, (p.1 - start.1) / tolerance.1);
    let ((px, py), (ex, ey)) = (scaled(point), scaled(end));
    let length_squared = ex * ex + ey * ey;
    let along = if length_squared > 0.0 { ((px * ex + py * ey) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
    (px - along * ex).hypot(py - along * ey)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_peaks_and_drops_what_lies_on_a_line() {
        let mut points: Vec<Point> = (0..=100).map(|i| (f64::from(i), 0.0)).collect();
        points[50].1 = 5.0;
        let lines = polylines(&points, (0.1, 0.1));
        assert_eq!(lines, [vec![(0.0, 0.0), (49.0, 0.0), (50.0, 5.0), (51.0, 0.0), (100.0, 0.0)]]);
    }

    #[test]
    fn a_number_that_is_not_finite_is_a_gap() {
        let points = [(0.0, 0.0), (1.0, 1.0), (2.0, f64::NAN), (3.0, 1.0), (4.0, 0.0)];
        assert_eq!(polylines(&points, (1e-3, 1e-3)).len(), 2);
        assert_eq!(span([f64::NAN, 2.0, -1.0, f64::INFINITY]), Some(-1.0..2.0));
        assert_eq!(span([f64::NAN]), None);
        assert!(polylines(&[], (1.0, 1.0)).is_empty());
    }
}
