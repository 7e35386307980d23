//! Figures as data: curves and dots over two axes, whole in the JSON document.
//!
//! *in* points of a study; *out* a [`Figure`] that a view can draw; *never* more than six curves, each with a colour of its own.

use serde::{Deserialize, Serialize};

/// A figure as data: drawn in the page, whole in the JSON document.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Section of the report.
    pub section: String,
    /// Name in the JSON document, in snake case.
    pub name: String,
    /// What is seen, in a sentence.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Curves, at most six, each with a colour of its own.
    pub curves: Vec<Curve>,
}

impl Figure {
    /// How the error melts while a loop learns in flight: points (s, cm) without learning and with it, the root mean square over
    /// so many flights of what `flown` names.
    pub fn first_minute(section: &str, flown: &str, flights: usize, without: Vec<(f64, f64)>, with: Vec<(f64, f64)>) -> Self {
        Self {
            section: section.into(),
            name: "first_minute".into(),
            title: format!(
                "The error melts while it flies: {flown}, nothing trained before. Position error second by second, root mean \
                 square of {flights} flights of unseen strokes, one stroke after another; rests between them are left out."
            ),
            x: Axis::linear("time in motion [s]"),
            y: Axis::logarithmic("position error [cm]"),
            curves: vec![Curve::line("learning", with), Curve::line("without learning", without)],
        }
    }
}

/// An axis: quantity and unit, linear or logarithmic.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Axis {
    /// Quantity and unit, as `error [cm]`.
    pub label: String,
    /// Logarithmic: what is not positive is a gap.
    pub logarithmic: bool,
}

impl Axis {
    /// A linear axis.
    pub fn linear(label: &str) -> Self {
        Self { label: label.into(), logarithmic: false }
    }

    /// A logarithmic axis.
    pub fn logarithmic(label: &str) -> Self {
        Self { label: label.into(), logarithmic: true }
    }
}

/// How points are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mark {
    /// A line through them.
    #[default]
    Line,
    /// A dot each.
    Dots,
    /// Both.
    LineAndDots,
}

/// A curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// What it is, for the legend.
    pub label: String,
    /// How it is drawn.
    pub mark: Mark,
    /// Points (x, y).
    pub points: Vec<(f64, f64)>,
}

impl Curve {
    /// A line.
    pub fn line(label: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { label: label.into(), mark: Mark::Line, points: points.into_iter().collect() }
    }

    /// Dots.
    pub fn dots(label: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { mark: Mark::Dots, ..Self::line(label, points) }
    }

    /// A line with a dot at each point.
    pub fn line_and_dots(label: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { mark: Mark::LineAndDots, ..Self::line(label, points) }
    }
}
