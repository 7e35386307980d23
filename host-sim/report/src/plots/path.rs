//! A path in space: desired, flown by the baseline, flown with the add-on.

use super::axes::{Labels, axes, curve, inner_size};
use super::canvas::{Ink, panel};
use super::curve::{Point, span, widened};
use crate::cases::Scene;
use maud::Markup;
use std::ops::Range;

const SIZE: (u32, u32) = (340, 270);
/// A path whose smallest extent is less than this share of its largest is shown in the plane of the other two.
const FLAT: f64 = 0.15;

/// How points in space come onto paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum View {
    /// The plane of two world axes (0 = x, 1 = y, 2 = z).
    Plane(usize, usize),
    /// Isometric, seen from above.
    Isometric,
}

impl View {
    /// Chosen by the extents of the desired path.
    fn of(points: &[[f64; 3]]) -> Option<Self> {
        let mut extents = [0.0; 3];
        for (axis, extent) in extents.iter_mut().enumerate() {
            let span = span(points.iter().map(|point| point[axis]))?;
            *extent = span.end - span.start;
        }
        let smallest = (0..3).min_by(|a, b| extents[*a].total_cmp(&extents[*b]))?;
        let largest = extents.into_iter().fold(0.0, f64::max);
        Some(match smallest {
            _ if extents[smallest] > FLAT * largest => Self::Isometric,
            0 => Self::Plane(1, 2),
            1 => Self::Plane(0, 2),
            _ => Self::Plane(0, 1),
        })
    }

    fn project(self, points: &[[f64; 3]]) -> Vec<Point> {
        let (cos, sin) = (0.75_f64.sqrt(), 0.5);
        points
            .iter()
            .map(|&[x, y, z]| match self {
                Self::Plane(across, up) => ([x, y, z][across], [x, y, z][up]),
                Self::Isometric => ((x - y) * cos, z + (x + y) * sin),
            })
            .collect()
    }

    fn labels(self) -> Labels<'static> {
        const NAMES: [&str; 3] = ["x [m]", "y [m]", "z [m]"];
        match self {
            Self::Plane(across, up) => Labels { x: NAMES[across], y: NAMES[up] },
            Self::Isometric => Labels { x: "isometric, right [m]", y: "isometric, up [m]" },
        }
    }
}

/// The scored part of a flight in space; `None` when it has no finite point.
pub(crate) fn path_in_space(scene: &Scene<'_>) -> anyhow::Result<Option<Markup>> {
    let first = scene.first();
    let Some(view) = View::of(scored(&first.desired, &first.scored)) else {
        return Ok(None);
    };
    let desired = view.project(scored(&first.desired, &first.scored));
    let baseline = scene.baseline().map(|trace| view.project(scored(&trace.flown, &trace.scored)));
    let add_on = scene.add_on().map(|trace| view.project(scored(&trace.flown, &trace.scored)));

    let all = || [Some(&desired), baseline.as_ref(), add_on.as_ref()].into_iter().flatten().flatten();
    let (Some(x), Some(y)) = (span(all().map(|point| point.0)), span(all().map(|point| point.1))) else {
        return Ok(None);
    };
    // One metre is as long across as it is up.
    let (width, height) = inner_size(SIZE);
    let (x, y) = (widened(&x, 0.0, 1e-6), widened(&y, 0.0, 1e-6));
    let metres_per_pixel = ((x.end - x.start) / width).max((y.end - y.start) / height);
    let (x, y) = (about_centre(&x, 1.08 * metres_per_pixel * width), about_centre(&y, 1.08 * metres_per_pixel * height));

    let description = "Path over the scored part of the flight: desired, baseline and with the add-on.";
    let drawn = panel(SIZE, &first.trajectory, description, |area| {
        let mut chart = axes(area, x, y, &view.labels())?;
        curve(&mut chart, &desired, Ink::Desired.line(5.0))?;
        if let Some(points) = &baseline {
            curve(&mut chart, points, Ink::Baseline.line(1.8))?;
        }
        if let Some(points) = &add_on {
            curve(&mut chart, points, Ink::BothLanes.line(1.4))?;
        }
        Ok(())
    })?;
    Ok(Some(drawn))
}

fn about_centre(span: &Range<f64>, length: f64) -> Range<f64> {
    let centre = 0.5 * (span.start + span.end);
    centre - 0.5 * length..centre + 0.5 * length
}

/// The scored samples, however wrong the range is.
fn scored<'a>(points: &'a [[f64; 3]], range: &Range<usize>) -> &'a [[f64; 3]] {
    points.get(range.start..range.end.min(points.len())).unwrap_or(&[])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_path_is_seen_from_the_front_and_a_helix_from_above() {
        let flat: Vec<[f64; 3]> = (0..9).map(|i| [f64::from(i), 0.01, f64::from(i * i)]).collect();
        assert_eq!(View::of(&flat), Some(View::Plane(0, 2)));
        let helix: Vec<[f64; 3]> = (0..9).map(f64::from).map(|t| [t.cos(), t.sin(), 0.2 * t]).collect();
        assert_eq!(View::of(&helix), Some(View::Isometric));
        assert_eq!(View::of(&[[f64::NAN; 3]]), None);
        assert!(scored(&flat, &Range { start: 20, end: 3 }).is_empty());
    }
}
